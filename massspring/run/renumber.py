"""Node numbers during a run: the nodes of a slice are consecutive, and neighbours are near in memory.

Outside a run the numbers of the mesh apply; `State.x` and `State.v` use them.
"""

from dataclasses import dataclass, replace

import numpy as np

from massspring.body.body import Body
from massspring.layout.allocate import nodes_of, swept_surface
from massspring.layout.sell_chunks import places_in_slices
from massspring.layout.state import State
from massspring.methods.method import Method
from massspring.world.obstacles import Attachment

MANY = 512
"""Fewest nodes for which renumbering pays: the data of smaller bodies fits the first-level cache in any order."""


@dataclass(frozen=True, eq=False)
class Numbered:
    """A body with the node numbers of a run."""

    body: Body
    permutation: np.ndarray | None
    """Number in `body` of each node of the mesh, (n,); None if they are the same."""

    def start(self, method: Method, attachments: tuple[Attachment, ...], velocity: np.ndarray | None) -> State:
        """The body at rest, or with velocities (n, 3) [m/s]; arguments and results use the numbers of the mesh.

        Raises MassSpringError for bad attachments.
        """
        if self.permutation is None:
            return method.start(self.body, attachments, velocity)
        held = tuple(
            replace(attachment, nodes=np.sort(self.permutation[nodes]))
            for attachment, nodes in zip(attachments, nodes_of(attachments, self.body), strict=True)
        )
        order = np.argsort(self.permutation)
        state = method.start(self.body, held, None if velocity is None else np.asarray(velocity)[order])
        return replace(state, permutation=self.permutation)


def numbered(body: Body) -> Numbered:
    """The nodes of a large body in the order in which `kernels.fused` passes over them."""
    if body.node_count < MANY:
        return Numbered(body, None)
    permutation = places_in_slices(body.springs, swept_surface(body), body.rest)
    return Numbered(renumbered(body, permutation), permutation)


def renumbered(body: Body, permutation: np.ndarray) -> Body:
    """The same body, whose node i has number `permutation[i]` (n,); springs, triangles and volumes keep theirs."""
    order, number = np.argsort(permutation), permutation.astype(np.uint32)
    volumes = body.volumes
    return replace(
        body,
        rest=body.rest[order],
        mass=body.mass[order],
        contact_facets=number[body.contact_facets],
        inertia=None if body.inertia is None else body.inertia[order],
        springs=replace(body.springs, ends=number[body.springs.ends]),
        triangles=number[body.triangles],
        tetrahedra=number[body.tetrahedra],
        volumes=None if volumes is None else volumes.renumbered(number),
        membrane=body.membrane._replace(triangles=number[body.membrane.triangles]),
    )
