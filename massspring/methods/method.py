"""What a method is: settings (a frozen dataclass), claims (class variables), one compiled loop over the steps."""

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field, replace
from typing import Any, ClassVar, Literal, Protocol

import numpy as np
from scipy.sparse import csr_array

from massspring.body.body import Body
from massspring.body.springs import EDGES_OF_TRIANGLE, lengths
from massspring.body.volumes import Volumes
from massspring.errors import MassSpringError
from massspring.kernels.arrays.layout import Drive, Motion, Network, Tally, VolumeRows
from massspring.kernels.fused.chunk import RESULT, TILE
from massspring.kernels.jit.stage_clock import Ticks
from massspring.kernels.probe.arrays import Probing
from massspring.layout.jacobian_pattern import volume_rows
from massspring.layout.probe_arrays import fresh
from massspring.layout.sell_chunks import aligned, slices_of
from massspring.layout.threads import crew
from massspring.world.obstacles import Attachment

LONGEST_CORRECTION = 0.3
"""How far a step moves a node to make up for a wrong volume, in mean spring lengths: too little to turn a triangle."""


Remedy = Literal["capped", "whole", "force", "unbounded"]
"""What a step does about a volume that is far off."""


@dataclass(frozen=True, eq=False)
class State:
    """A body in motion. `advance` returns a new one and leaves the old as it was."""

    network: Network
    motion: Motion
    lam: np.ndarray
    """Interior gauge pressure of each kept volume in the last step, beyond what it is at rest [Pa], (m,); 0 for
    methods that keep none."""
    rows: VolumeRows | None = None
    """None where one closed surface is kept: a division needs no rows."""
    tally: Tally = field(default_factory=lambda: new_tally(0, 0))
    """What the last frame measured of itself."""
    memory: Any = None
    """Arrays that only the method knows, made by its `start`."""
    probing: Probing | None = None
    """Of thin probes; None where there are none: the frame is then compiled without their stage."""
    place: np.ndarray | None = None
    """Where each node is in `network` and `motion`, (n,); None where they have the numbers of the body."""

    @property
    def x(self) -> np.ndarray:
        """Positions [m], (n, 3)."""
        return self.motion.x if self.place is None else self.motion.x[self.place]

    @property
    def v(self) -> np.ndarray:
        """Velocities [m/s], (n, 3)."""
        return self.motion.v if self.place is None else self.motion.v[self.place]

    def moved_to(self, x: np.ndarray) -> "State":
        """The same at positions `x` (n, 3) [m]."""
        motion = self.motion._replace(x=self.motion.x.copy())
        motion.x[slice(None) if self.place is None else self.place] = x
        return replace(self, motion=motion)


def new_tally(obstacles: int, attachments: int, ticks: Ticks | None = None) -> Tally:
    """A tally at zero; the ticks go on."""
    skipped, capped, iterations = (np.zeros(size, dtype=np.int64) for size in (1, 1, 2))
    return Tally(np.zeros((obstacles, 3)), np.zeros((attachments, 3)), skipped, capped, iterations, ticks)


class Method(Protocol):
    """One way to advance time. A new one derives from this: a file, and a line in METHODS."""

    name: ClassVar[str]
    """Word on the command line."""
    order: ClassVar[int]
    """Claim: global error of the trajectory ~ dt^order."""
    volume_tol: ClassVar[float | None]
    """Claim: |V/V0 − 1| after a quiet step at half the stability limit; None where a step promises no volume."""
    keeps_spin: ClassVar[bool] = True
    """Claim: a body in free flight keeps its angular momentum to round-off."""
    holds_apart: ClassVar[bool] = False
    """Whether it starts with the pressure that holds springs without length apart at rest."""

    remedy: ClassVar[Remedy | None] = None
    """Claim: what a step does about a volume that is far off. "capped": each volume moves a node by no more than
    `longest_correction` to make up for it (eq. 35), the rest is left to later steps; "whole": all of it is made up for
    at once; "force": a force whose size only the length of a stable step bounds; "unbounded": one that nothing bounds
    as a volume goes to 0, so that a crushed body bursts and the run has diverged. None where no volume is kept, at most
    something that stands for it. With a remedy, steps in which a volume has nothing to push on are counted."""
    follows_targets: ClassVar[bool] = True
    """Whether the target of a kept volume is followed where it changes."""
    misses_probes: ClassVar[str | None] = "its steps have no stage for them"
    """Why thin probes are not met; None where they are, in continuous time."""
    threaded: ClassVar[bool] = False
    """Whether a frame can be shared by several threads."""
    limited: ClassVar[bool] = True
    """Whether steps beyond the stability limit diverge; where not, accuracy alone limits them."""

    def applies(self, body: Body) -> str | None:
        """Why the method cannot advance `body`; None when it can."""
        return None

    def added_stiffness(self, body: Body) -> csr_array | None:
        """B [√(N/m)], (3n, r): small oscillations about rest feel B Bᵀ beside the springs; None for nothing."""
        return None

    def start(self, body: Body, attachments: tuple[Attachment, ...] = (), v: np.ndarray | None = None) -> State:
        """The body at rest, or with velocities `v` (n, 3) [m/s]. Raises MassSpringError."""
        return start(body, attachments, v)

    def advance(self, state: State, drive: Drive) -> State:
        """One frame: as many steps as `drive.position` has rows."""
        ...


def start(
    body: Body, attachments: tuple[Attachment, ...] = (), v: np.ndarray | None = None, memory: Any = None
) -> State:
    """The body at rest, or with velocities `v` (n, 3) [m/s]. Raises MassSpringError for bad attachments."""
    kept, n = body.kept, body.node_count
    network = _network(body, attachments, swept_surface(body))
    velocity = np.zeros((n, 3)) if v is None else np.array(v, dtype=np.float64)
    if velocity.shape != (n, 3):
        raise MassSpringError(f"velocities have shape {velocity.shape}; the body has {n} nodes, give ({n}, 3)")
    real = np.dtype(np.float64)
    slices = network.slices
    motion = Motion(
        x=body.rest.copy(),
        v=velocity,
        v_star=aligned((n, 3), real),
        force=np.zeros((n, 3)),
        gradient=aligned((n, 3), real),
        touched=np.zeros(n, dtype=np.uint32),
        second=np.zeros(n, dtype=np.uint32),
        touching=np.zeros(n, dtype=np.uint32),
        entering=np.zeros(n, dtype=np.uint32),
        touching_count=np.zeros(1, dtype=np.int64),
        locked=np.zeros(n, dtype=np.uint8),
        normal=np.zeros((n, 3)),
        second_normal=np.zeros((n, 3)),
        direction=np.zeros((n, 3)),
        goal=np.zeros((n, 3)),
        clearance=np.zeros(n),
        places=aligned((n, 4), real),
        tile=aligned((1, TILE), real),
        pulled=aligned((slices.pieces, RESULT), real),
        sums=np.zeros((len(slices.lanes) + 1, 3)),
    )
    rows = None if keeps_one(kept) else volume_rows(kept, n)
    return State(network, motion, np.zeros(kept.count), rows, memory=memory)


def keeps_one(volumes: Volumes) -> bool:
    """Whether a division is enough: one closed surface."""
    return volumes.count == 1 and bool((np.abs(volumes.share.data) == 1.0).all())


def swept_surface(body: Body) -> np.ndarray:
    """The closed surface on whose rings the springs are gathered, the one volume kept where it is one, (f, 3)."""
    return turned(body.kept) if keeps_one(body.kept) else body.triangles


def turned(volumes: Volumes) -> np.ndarray:
    """The triangles of one volume, all in the sense that encloses it, (f, 3) uint32."""
    share = volumes.share.tocoo()
    triangles = volumes.triangles[share.col]
    return np.ascontiguousarray(np.where(share.data[:, None] > 0, triangles, triangles[:, ::-1]))


def nodes_of(attachments: tuple[Attachment, ...], body: Body) -> list[np.ndarray]:
    """Which nodes each attachment holds. Raises MassSpringError where they are none, not there or held twice."""
    nodes = [np.asarray(a.nodes, dtype=np.int64) for a in attachments]
    for number, held in enumerate(nodes):
        if not len(held):
            raise MassSpringError(f"attachment {number} holds no node; widen its region or refine the mesh")
        if held.min() < 0 or held.max() >= body.node_count:
            raise MassSpringError(f"attachment {number} names node {held.max()}; the body has {body.node_count} nodes")
    if len(np.unique(np.concatenate([[], *nodes]))) != sum(map(len, nodes)):
        raise MassSpringError("two attachments hold the same node; their motions could contradict each other")
    return nodes


def _network(body: Body, attachments: tuple[Attachment, ...], surface: np.ndarray) -> Network:
    nodes = nodes_of(attachments, body)
    held_nodes = np.concatenate(nodes) if nodes else np.empty(0, dtype=np.int64)
    inverse_mass = 1.0 / body.mass
    inverse_mass[held_nodes] = 0.0
    touchable = np.zeros(body.node_count, dtype=np.uint8)
    touchable[body.surface_nodes] = 1
    touchable[held_nodes] = 0
    return Network(
        ends=body.springs.ends,
        rest_length=body.springs.rest_length,
        stiffness=body.springs.stiffness,
        membrane=body.membrane,
        triangles=surface,
        mass=body.mass,
        inverse_mass=inverse_mass,
        largest_inverse_mass=float(inverse_mass.max()),
        surface_nodes=body.surface_nodes,
        touchable=touchable,
        held_nodes=held_nodes.astype(np.uint32),
        held_group=np.repeat(np.arange(len(nodes)), [len(h) for h in nodes]).astype(np.uint32),
        held_rest=body.rest[held_nodes],
        rest_lam=body.rest_lam,
        longest_correction=LONGEST_CORRECTION * _mean_length(body),
        slices=slices_of(body.springs, surface, inverse_mass, body.rest),
    )


def _mean_length(body: Body) -> float:
    """Of all springs at rest [m], the edges of triangle springs among them."""
    edges = body.membrane.triangles[:, EDGES_OF_TRIANGLE].reshape(-1, 2)
    ends = np.concatenate([body.springs.ends, edges])
    return float(lengths(body.rest, ends).mean()) if len(ends) else np.inf


def one_whole(body: Body) -> str | None:
    """Why a method that keeps the one volume inside the body's surface does not apply; None when it does."""
    kept = body.kept
    if kept.count > 1:
        return f"it keeps one volume, the body keeps {kept.count}; keep the whole, or take implicit_volume"
    if not (np.abs(kept.share.data) == 1.0).all():
        return "it keeps what one closed surface encloses, the body keeps a share of it; take implicit_volume"
    return None


def begin_frame(state: State, drive: Drive) -> State:
    """A copy to advance in place, so that the caller's state stays what it was."""
    motion = state.motion._replace(x=state.motion.x.copy(), v=state.motion.v.copy())
    obstacles = len(drive.radius) + drive.tips.end.shape[1]
    tally = new_tally(obstacles, drive.held_displacement.shape[1], state.tally.ticks)
    probing = None if state.probing is None else fresh(state.probing, tally)
    return replace(state, motion=motion, tally=tally, probing=probing)


@contextmanager
def crewed_frame(state: State, drive: Drive) -> Iterator[State]:
    """A copy to advance in place; inside, all threads of the state are there."""
    after = begin_frame(state, drive)
    with crew(after.network, after.motion, drive):
        yield after
