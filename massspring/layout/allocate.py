"""Arrays of a run, made once: topology, state and scratch of a body at rest."""

from typing import Any, TypeGuard

import numpy as np

from massspring.body.body import Body
from massspring.body.points import PointVolumes
from massspring.body.springs import EDGES_OF_TRIANGLE, lengths
from massspring.body.volumes import Volumes
from massspring.errors import MassSpringError
from massspring.kernels.arrays.layout import Contacts, Model, Nodes, Workspace
from massspring.kernels.fused.chunk import RESULT, TILE
from massspring.layout.jacobian_pattern import volume_rows
from massspring.layout.point_rows import point_rows
from massspring.layout.sell_chunks import aligned, slices_of
from massspring.layout.state import State
from massspring.world.obstacles import Attachment

CORRECTION_LIMIT = 0.3
"""Largest distance by which the correction of a volume error moves a node in a step, in mean spring lengths: too little
to invert a triangle."""


def start(
    body: Body, attachments: tuple[Attachment, ...] = (), v: np.ndarray | None = None, memory: Any = None
) -> State:
    """The body at rest, or with velocities `v` (n, 3) [m/s]. Raises MassSpringError for bad attachments."""
    kept, n = body.kept, body.node_count
    model = _model(body, attachments, swept_surface(body))
    velocity = np.zeros((n, 3)) if v is None else np.array(v, dtype=np.float64)
    if velocity.shape != (n, 3):
        raise MassSpringError(f"velocities have shape {velocity.shape}; the body has {n} nodes, give ({n}, 3)")
    real = np.dtype(np.float64)
    slices = model.slices
    nodes = Nodes(
        x=body.rest.copy(),
        v=velocity,
        v_star=aligned((n, 3), real),
        force=np.zeros((n, 3)),
        gradient=aligned((n, 3), real),
    )
    work = Workspace(
        padded_positions=aligned((n, 4), real),
        tile=aligned((TILE,), real),
        pulled=aligned((slices.pieces, RESULT), real),
        sums=np.zeros((len(slices.lanes) + 1, 3)),
    )
    if isinstance(kept, PointVolumes):
        rows = point_rows(body, kept, model.inverse_mass)
    else:
        rows = None if keeps_one(kept) else volume_rows(kept, n)
    return State(model, nodes, _no_contacts(body), work, np.zeros(kept.count), rows, memory=memory)


def _no_contacts(body: Body) -> Contacts:
    n, facets = body.node_count, body.contact_facets.astype(np.int64)
    sides = [facets[:, pair] for pair in ([0, 3], [1, 3], [1, 4], [2, 4], [2, 5], [0, 5])]
    beside = np.unique(np.concatenate(sides), axis=0)
    return Contacts(
        **{name: np.zeros(n, dtype=np.uint32) for name in ("contact_id", "second", "active", "entering")},
        mode=np.zeros(n, dtype=np.uint8),
        **{name: np.zeros((n, 3)) for name in ("normal", "second_normal", "direction", "v_target")},
        active_count=np.zeros(1, dtype=np.int64),
        predicted_gap=np.zeros(n),
        beside_start=np.searchsorted(beside[:, 0], np.arange(n + 1)).astype(np.uint32),
        beside=beside[:, 1].astype(np.uint32),
        stayed=np.zeros((n, 3), dtype=np.uint32),
    )


def keeps_one(volumes: Volumes | PointVolumes) -> TypeGuard[Volumes]:
    """Whether one volume inside a closed surface is kept, so that a division gives its multiplier."""
    return isinstance(volumes, Volumes) and volumes.count == 1 and bool((np.abs(volumes.share.data) == 1.0).all())


def swept_surface(body: Body) -> np.ndarray:
    """The closed surface whose rings order the springs, (f, 3): that of the kept volume if it is a single one, else
    that of the body."""
    return turned(body.kept) if keeps_one(body.kept) else body.triangles


def turned(volumes: Volumes) -> np.ndarray:
    """The triangles of one volume, all oriented outward, (f, 3) uint32."""
    share = volumes.share.tocoo()
    triangles = volumes.triangles[share.col]
    return np.ascontiguousarray(np.where(share.data[:, None] > 0, triangles, triangles[:, ::-1]))


def nodes_of(attachments: tuple[Attachment, ...], body: Body) -> list[np.ndarray]:
    """The nodes that each attachment holds. Raises MassSpringError if there are none, if one does not exist, or if one
    is held twice."""
    nodes = [np.asarray(a.nodes) for a in attachments]
    for number, held in enumerate(nodes):
        if not len(held):
            raise MassSpringError(f"attachment {number} holds no node; widen its region or refine the mesh")
        if held.dtype.kind not in "iu":
            raise MassSpringError(f"the nodes of attachment {number} are {held.dtype}; give whole numbers")
        if held.min() < 0 or held.max() >= body.node_count:
            raise MassSpringError(f"attachment {number} names node {held.max()}; the body has {body.node_count} nodes")
    nodes = [held.astype(np.int64) for held in nodes]
    if len(np.unique(np.concatenate([[], *nodes]))) != sum(map(len, nodes)):
        raise MassSpringError("two attachments hold the same node; their motions could contradict each other")
    return nodes


def _model(body: Body, attachments: tuple[Attachment, ...], surface: np.ndarray) -> Model:
    nodes = nodes_of(attachments, body)
    held_nodes = np.concatenate(nodes) if nodes else np.empty(0, dtype=np.int64)
    inverse_mass = 1.0 / body.moved_mass
    inverse_mass[held_nodes] = 0.0
    touchable = np.zeros(body.node_count, dtype=np.uint8)
    touchable[body.surface_nodes] = 1
    touchable[held_nodes] = 0
    return Model(
        ends=body.springs.ends,
        rest_length=body.springs.rest_length,
        stiffness=body.springs.stiffness,
        membrane=body.membrane,
        triangles=surface,
        mass=body.moved_mass,
        inverse_mass=inverse_mass,
        largest_inverse_mass=float(inverse_mass.max()),
        surface_nodes=body.surface_nodes,
        touchable=touchable,
        held_nodes=held_nodes.astype(np.uint32),
        held_group=np.repeat(np.arange(len(nodes)), [len(h) for h in nodes]).astype(np.uint32),
        held_rest=body.rest[held_nodes],
        rest_lam=body.rest_lam,
        correction_limit=CORRECTION_LIMIT * _mean_length(body),
        slices=slices_of(body.springs, surface, inverse_mass, body.rest),
    )


def _mean_length(body: Body) -> float:
    """Mean length of all springs at rest [m], including the edges of triangle springs."""
    edges = body.membrane.triangles[:, EDGES_OF_TRIANGLE].reshape(-1, 2)
    ends = np.concatenate([body.springs.ends, edges])
    return float(lengths(body.rest, ends).mean()) if len(ends) else np.inf
