"""Angular springs: they resist bending of the surface at its nodes, in place of a volume constraint.

Nedel, Thalmann, Real time muscle deformations using mass-spring systems, Computer Graphics International 1998: in
addition to the linear springs, "angular springs" keep the angle between opposite edges at each node of the surface.
They are meant to keep the shape and so the volume. Their energy is ½ κ (θ − θ0)² (docs/theory.md, eq. 14.5); the
authors leave their constants to the user. Here κ = `ratio` k̄ |a| |b|, k̄ the mean stiffness of the linear springs, so
that bending an edge by its length takes `ratio` times the force of a linear spring.

Limits: an angle below π is the same in a bulge and in a dent of equal depth; and a volume can shrink without any angle
changing (all lengths by one factor). Only stiffness resists a change of volume, and it also adds to the force.
"""

import math
from dataclasses import dataclass
from typing import ClassVar, NamedTuple

import numpy as np
from scipy.sparse import csr_array

from massspring.body.body import Body
from massspring.body.springs import EDGES_OF_TRIANGLE, unique_edges
from massspring.errors import MassSpringError
from massspring.kernels.arrays.layout import BoundaryConditions, Push
from massspring.kernels.jit.by_address import by_address
from massspring.kernels.jit.decorators import njit_lean
from massspring.kernels.jit.stage_clock import SPRINGS, end_stage
from massspring.kernels.jit.vec3 import add_to, cross, dot, minus, over, plus, row, take_from, times
from massspring.kernels.step.begin import begin_step, open_frame, search_contacts
from massspring.kernels.step.end import end_step
from massspring.layout.allocate import start
from massspring.layout.state import State
from massspring.methods.capabilities import Capabilities, No
from massspring.methods.method import Method, begin_frame
from massspring.world.obstacles import Attachment, Surroundings

TIE = 1e-9
"""Difference below which two cosines count as equal; the first node is then chosen."""
STRAIGHT = 1e-12
"""Sine below which an angle counts as 0 or π: its gradient then has no direction."""


@by_address
class Angles(NamedTuple):
    """a angles at nodes."""

    corner: np.ndarray
    """First end, apex and second end, (a, 3) int64."""
    rest: np.ndarray
    """[rad], (a,)."""
    stiffness: np.ndarray
    """κ [N m], (a,)."""


@njit_lean
def opening(x, i, apex, j):
    """(θ, sin θ, cos θ) of the angle between the edges from `apex` to i and j, and their lengths [m]; NaN if an edge
    has no length."""
    a, b = minus(row(x, i), row(x, apex)), minus(row(x, j), row(x, apex))
    c = cross(a, b)
    across, along = math.sqrt(dot(c, c)), dot(a, b)
    la, lb = math.sqrt(dot(a, a)), math.sqrt(dot(b, b))
    return math.atan2(across, along), across / (la * lb), along / (la * lb), la, lb


@njit_lean
def angle_forces_into(x, angles, force):
    """f = −κ (θ − θ0) ∂θ/∂x [N], (n, 3), ∂θ/∂x_i = (cos θ â − b̂)/(|a| sin θ) (eq. 14.6).

    An angle of 0 or π has no direction to bend in and gives no force. Internal: forces and moments sum to zero.
    """
    force[:] = 0.0
    for k in range(angles.rest.shape[0]):
        i, apex, j = row(angles.corner, k)
        theta, sine, cosine, la, lb = opening(x, i, apex, j)
        if sine < STRAIGHT:
            continue
        moment = -angles.stiffness[k] * (theta - angles.rest[k]) / sine
        a, b = over(minus(row(x, i), row(x, apex)), la), over(minus(row(x, j), row(x, apex)), lb)
        first = over(times(moment, minus(times(cosine, a), b)), la)
        second = over(times(moment, minus(times(cosine, b), a)), lb)
        add_to(force, i, first)
        add_to(force, j, second)
        take_from(force, apex, plus(first, second))


@njit_lean
def angular_frame(frame, angles, force):
    """One frame of symplectic Euler with angular springs as one more force (eq. 3.1, 3.2, 3.5, 3.7, 14.6)."""
    push = Push(force, 1.0)
    open_frame(frame)
    for step in range(frame.boundary.position.shape[0]):
        begin_step(frame, step, False)
        angle_forces_into(frame.nodes.x, angles, force)
        end_stage(frame.diagnostics.stage_times, SPRINGS)
        search_contacts(frame, step, push)
        end_step(frame, step, push, 0.0, None)


@dataclass(frozen=True)
class AngularSprings(Method):
    """Springs that keep the angles between opposite surface edges (Nedel, Thalmann 1998); no volume kept."""

    ratio: float = 1.0
    """Stiffness of an angular spring over that of a linear one, as defined above [1]."""

    name: ClassVar[str] = "angular_springs"
    order: ClassVar[int] = 1
    volume_tol: ClassVar[float | None] = None
    capabilities: ClassVar[Capabilities] = Capabilities(
        "none",
        triangle_springs=No("its angles are as stiff as springs between two nodes"),
        thin_probes=No("contact of its angular springs with them is untested"),
        events=No("its angles are no sums over cells"),
    )

    def __post_init__(self) -> None:
        if not 0.0 < self.ratio < float("inf"):
            raise MassSpringError(f"{self.name}'s ratio is {self.ratio}; it must be positive and finite")

    def why_not_among(self, surroundings: Surroundings) -> str | None:
        return "it keeps no volume that could be filled" if surroundings.targets else None

    def added_stiffness(self, body: Body) -> csr_array:
        """B [√(N/m)], (3n, a): √κ ∂θ/∂x of every angle at rest."""
        angles = angles_of(body, self.ratio)
        slope = angle_slopes(body.rest, angles) * np.sqrt(angles.stiffness)[:, None, None]
        rows = 3 * angles.corner[:, :, None] + np.arange(3)
        columns = np.broadcast_to(np.arange(len(slope))[:, None, None], rows.shape)
        shape = (3 * body.node_count, len(slope))
        return csr_array((slope.ravel(), (rows.ravel(), columns.ravel())), shape=shape)

    def start(self, body: Body, attachments: tuple[Attachment, ...] = (), v: np.ndarray | None = None) -> State:
        """The body at rest, or with velocities `v` (n, 3) [m/s], and its angles."""
        return start(body, attachments, v, memory=angles_of(body, self.ratio))

    def advance(self, state: State, boundary: BoundaryConditions) -> State:
        after = begin_frame(state, boundary)
        angular_frame(after.frame(boundary), after.memory, np.empty_like(after.nodes.x))
        return after


def angles_of(body: Body, ratio: float) -> Angles:
    """The angles at surface nodes between each edge and the edge most nearly opposite to it."""
    ends = unique_edges(body.triangles, EDGES_OF_TRIANGLE).astype(np.int64)
    both = np.concatenate([ends, ends[:, ::-1]])
    both = both[np.argsort(both[:, 0], kind="stable")]
    apexes, begin = np.unique(both[:, 0], return_index=True)
    corners: set[tuple[int, int, int]] = set()
    for apex, ring in zip(apexes.tolist(), np.split(both[:, 1], begin[1:]), strict=True):
        edge = body.rest[ring] - body.rest[apex]
        edge /= np.linalg.norm(edge, axis=1, keepdims=True)
        cosine = edge @ edge.T
        opposite = ring[np.argmax(cosine < cosine.min(axis=1, keepdims=True) + TIE, axis=1)]
        corners |= {(min(i, j), apex, max(i, j)) for i, j in zip(ring.tolist(), opposite.tolist(), strict=True)}
    corner = np.array(sorted(corners), dtype=np.int64)
    measured = np.array([opening(body.rest, *three) for three in corner.tolist()])
    stiffness = ratio * body.springs.stiffness.mean() * measured[:, 3] * measured[:, 4]
    return Angles(corner, np.ascontiguousarray(measured[:, 0]), stiffness)


def angle_slopes(x: np.ndarray, angles: Angles) -> np.ndarray:
    """∂θ/∂x of the first end, the apex and the second end [1/m] at `x` (n, 3), (a, 3, 3); 0 for an angle of 0 or π."""
    edge = x[angles.corner[:, [0, 2]]] - x[angles.corner[:, 1]][:, None]
    length = np.linalg.norm(edge, axis=2, keepdims=True)
    unit = edge / length
    cosine = np.einsum("ai,ai->a", unit[:, 0], unit[:, 1])[:, None, None]
    sine = np.linalg.norm(np.cross(unit[:, 0], unit[:, 1]), axis=1)[:, None, None]
    ends = np.divide(cosine * unit - unit[:, ::-1], length * sine, out=np.zeros_like(unit), where=sine > 0.0)
    return np.stack([ends[:, 0], -ends.sum(axis=1), ends[:, 1]], axis=1)
