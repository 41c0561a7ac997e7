"""3-D ChainMail: displacements propagate from node to node through limits on their links, without forces or masses.

Gibson, 3D ChainMail: a fast algorithm for deforming volumetric objects, Symposium on Interactive 3D Graphics 1997, on
grids; Li, Brodlie, Soft object modelling with generalised ChainMail, Computer Graphics Forum 22(4), 2003, on any mesh.
Along each axis a link may be shorter than at rest by `compression`, longer by `stretch`, and displaced by `shear` of
its other components. In each step held nodes and those inside obstacles are placed, and the others move by as little as
their links require (docs/theory.md, eq. 14.8), and `sweeps` of elastic relaxation move every node towards the mean of
the positions at which its links are at rest (14.9), within the limits.

Limits: the method is purely geometric. There is no contact force, no gravity, no inertia, and no volume; limits and
relaxation refer to fixed axes, so a rotated body is bent back. Steps in which the links between fixed nodes exceed
their limits count as limited corrections.
"""

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from massspring.body.body import Body
from massspring.errors import MassSpringError
from massspring.kernels.arrays.layout import BoundaryConditions
from massspring.kernels.jit.decorators import njit_lean
from massspring.layout.allocate import start
from massspring.layout.state import State
from massspring.methods.capabilities import Capabilities, No
from massspring.methods.literature.chain_links import Links, Mail, propagate, push_out, relax
from massspring.methods.method import Method, begin_frame
from massspring.world.obstacles import Attachment, Surroundings

ROUNDS = 20
"""Most rounds of obstacles and links in a step; the next step finds nodes that are still inside."""


@njit_lean
def chain_mail_frame(model, nodes, boundary, diagnostics, mail, sweeps):
    """One frame: place, propagate, relax (eq. 14.8, 14.9)."""
    x, before = nodes.x, nodes.v_star
    for step in range(boundary.position.shape[0]):
        mail.fixed[:] = 0
        for i in range(x.shape[0]):
            for axis in range(3):
                before[i, axis] = x[i, axis]
        for h in range(model.held_nodes.shape[0]):
            i, group = model.held_nodes[h], model.held_group[h]
            mail.fixed[i] = 1
            for axis in range(3):
                x[i, axis] = model.held_rest[h, axis] + boundary.held_displacement[step, group, axis]
        push_out(x, model, mail, boundary, step)
        torn = propagate(x, mail)
        for _ in range(ROUNDS):
            if push_out(x, model, mail, boundary, step) == 0:
                break
            torn = propagate(x, mail)
        diagnostics.limited[0] += torn
        for sweep in range(sweeps):
            relax(x, model, mail, boundary, (step, sweep % 2 == 1))
        for i in range(x.shape[0]):
            for axis in range(3):
                nodes.v[i, axis] = (x[i, axis] - before[i, axis]) / boundary.dt


@dataclass(frozen=True)
class ChainMail(Method):
    """3-D ChainMail (Gibson 1997): links of limited stretch and shear pass motion on, then relax; no forces."""

    compression: float = 0.3
    """Largest shortening of a link along an axis, over its extent along that axis [1]."""
    stretch: float = 0.3
    """Largest lengthening of a link along an axis, over its extent along that axis [1]."""
    shear: float = 0.3
    """Largest displacement of a link along an axis by shear, over the sum of its extents along the other axes [1]."""
    sweeps: int = 5
    """Sweeps of relaxation in each step."""

    name: ClassVar[str] = "chain_mail"
    order: ClassVar[int] = 0
    volume_tol: ClassVar[float | None] = None
    conserves_angular_momentum: ClassVar[bool] = False
    capabilities: ClassVar[Capabilities] = Capabilities(
        "none",
        conditionally_stable=False,
        triangle_springs=No("its links are springs between two nodes"),
        prestress=True,
        point_volumes=True,
        thin_probes=No("obstacles meet its nodes"),
        events=No("its links are of the body at rest"),
    )

    def __post_init__(self) -> None:
        for name in ("compression", "stretch", "shear"):
            if not 0.0 < getattr(self, name) < 1.0:
                raise MassSpringError(f"{self.name}'s {name} is {getattr(self, name)}; it must be between 0 and 1")
        if self.sweeps < 0:
            raise MassSpringError(f"{self.name}'s sweeps is {self.sweeps}; it cannot be negative")

    def why_not_among(self, surroundings: Surroundings) -> str | None:
        if any(surroundings.gravity):
            return "it has no masses, so gravity has no effect"
        if surroundings.moved:
            return "it has no masses, so nothing moves by itself"
        if surroundings.rough:
            return "it has no forces, so no friction"
        return "it keeps no volume that could be filled" if surroundings.targets else None

    def start(self, body: Body, attachments: tuple[Attachment, ...] = (), v: np.ndarray | None = None) -> State:
        """The body at rest, with its links."""
        n = body.node_count
        scratch = np.zeros(n, dtype=np.uint8), np.zeros(n, dtype=np.int64), np.zeros(n, dtype=np.uint8)
        return start(body, attachments, v, memory=Mail(self.links_of(body), *scratch))

    def links_of(self, body: Body) -> Links:
        """Two links for every spring, one from either end."""
        first, second = body.springs.ends.astype(np.int64).T
        begin, end = np.concatenate([first, second]), np.concatenate([second, first])
        order = np.lexsort((end, begin))
        begin, end = begin[order], end[order]
        rest = body.rest[end] - body.rest[begin]
        size = np.abs(rest)
        aside = self.shear * (size.sum(axis=1, keepdims=True) - size)
        nearer, farther = rest * (1.0 - self.compression), rest * (1.0 + self.stretch)
        low, high = np.minimum(nearer, farther) - aside, np.maximum(nearer, farther) + aside
        first_link = np.searchsorted(begin, np.arange(body.node_count + 1)).astype(np.int64)
        return Links(first_link, end, rest, low, high)

    def advance(self, state: State, boundary: BoundaryConditions) -> State:
        """One frame; the impulses of obstacles and attachments are NaN."""
        after = begin_frame(state, boundary)
        chain_mail_frame(after.model, after.nodes, boundary, after.diagnostics, after.memory, self.sweeps)
        for impulse in (after.diagnostics.contact_impulse, after.diagnostics.held_impulse):
            impulse[:] = np.nan
        return after
