"""Arrays of the stage for thin probes: p probes, f triangles, n nodes, m volumes, at most r rows.

Triangles are numbered along a space-filling curve (`Probing.surface`), so that the triangles of a block are close
together.
"""

from typing import NamedTuple

import numpy as np

from massspring.kernels.arrays.layout import Contacts, FrameDiagnostics, Model, Nodes, Tips
from massspring.kernels.arrays.volume_rows import VolumeRows
from massspring.kernels.jit.by_address import by_address
from massspring.kernels.probe.continuous import Pair

COUNTS = (
    "steps in contact",
    "rounds of search",
    "steps that carried nodes",
    "steps that left a triangle behind",
    "boxes compared",
    "pairs tested",
    "nodes carried",
)
"""Names of the columns of `Probing.counts`."""
IN_CONTACT, SEARCH_ROUNDS, CARRYING, LEFT_BEHIND, COMPARED, TESTED, CARRIED = range(len(COUNTS))


@by_address
class Rows(NamedTuple):
    """Point contacts of the step: row k pushes the nodes of one triangle along one direction, with an impulse >= 0."""

    count: np.ndarray
    """Rows in use, (1,) int64."""
    triangle: np.ndarray
    """(r,) uint32."""
    probe: np.ndarray
    """(r,) uint32."""
    node: np.ndarray
    """Corners of the triangle, (r, 3) uint32."""
    weight: np.ndarray
    """Barycentric weights b of the contact, (r, 3)."""
    direction: np.ndarray
    """Unit normal n, from the probe into the tissue, (r, 3)."""
    moves: np.ndarray
    """W̃_i n [1/kg] of each corner, (r, 3, 3)."""
    flow: np.ndarray
    """g_k = Σ_i b_i J_i W̃_i n [m²/kg], how the volumes change with the impulse, (r, m)."""
    answer: np.ndarray
    """S⁻¹ g_k [1/m²], the pressures that undo this change, (r, m)."""
    matrix: np.ndarray
    """A [1/kg], (r, r)."""
    right: np.ndarray
    """Velocity that each row requires beyond the motion without contacts [m/s], (r,)."""
    impulse: np.ndarray
    """c >= 0 [N s], (r,)."""
    active: np.ndarray
    """Rows that press, (r,) bool."""
    small: np.ndarray
    """A of the pressing rows, factored in place, (r, r)."""
    part: np.ndarray
    """Right side and solution of the pressing rows, (2, r)."""


@by_address
class Probing(NamedTuple):
    """Thin probes and a surface: sleeping pairs, near pairs of the step, and contacts."""

    radius: np.ndarray
    """Distance that the surface keeps from each tip [m], (p,); positive even for a probe without thickness."""
    skipping: bool
    """Whether sleeping pairs and boxes are used to skip triangles; the result is the same bit for bit without."""
    travel: np.ndarray
    """Upper bound on how much nearer any node has come to any tip since the start [m], (1,)."""
    surface: np.ndarray
    """Triangles in the order of the curve, (f, 3) uint32."""
    number: np.ndarray
    """Number of each triangle in the body, (f,) uint32."""
    wake: np.ndarray
    """Travel at which a block of triangles must be checked again [m], (p, ceil(f / TRIANGLE_BLOCK))."""
    near: np.ndarray
    """Triangles that may meet a tip in this step, ascending, (p, f) uint32."""
    near_count: np.ndarray
    """(p,) int64."""
    time: np.ndarray
    """Time at which a tip passes through each near triangle, 0 … 1 of the step; larger if it does not, (f,)."""
    passing: np.ndarray
    """Weights and direction of each passing, (f, 6)."""
    rows: Rows
    base: np.ndarray
    """u_i, velocity without contact of the corners of near triangles [m/s], (n, 3)."""
    push: np.ndarray
    """Σ_k b_ki c_k W̃_i n_k, the velocity that contacts add; of a carried node its velocity relative to the tip [m/s],
    (n, 3); zero between steps."""
    velocity: np.ndarray
    """v⁺_i with the current contacts [m/s], (n, 3)."""
    change: np.ndarray
    """δ, change of the pressures of the kept volumes [Pa], (m,)."""
    carried: np.ndarray
    """1 + the probe that takes a node along, 0 for none, (n,) uint32; zero between steps."""
    taken: np.ndarray
    """The carried nodes, in the order in which they were taken, (n,) uint32."""
    taken_count: np.ndarray
    """(1,) int64."""
    passed: np.ndarray
    """1 + the body's number of the first triangle that a tip was driven through, 0 for none, (p,) int64."""
    pair: Pair
    diagnostics: FrameDiagnostics
    """Diagnostics of the frame."""
    counts: np.ndarray
    """COUNTS since the start, (7,) int64."""


class Stage(NamedTuple):
    """Data of one step for the functions of this stage."""

    model: Model
    nodes: Nodes
    contacts: Contacts
    tips: Tips
    probes: Probing
    volumes: VolumeRows | None
    """None where one volume is kept or none."""
    mobility: float
    """G·W̃·G of the one volume [m⁴/kg]; 0 where none is kept, or several."""
    step: int
    dt: float
