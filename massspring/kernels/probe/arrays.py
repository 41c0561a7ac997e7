"""What the stage for thin probes is given: p probes, f triangles, n nodes, m volumes, r rows at most.

Triangles are numbered along a curve through the body (`Probing.surface`), so that a block of them lies together.
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
"""What `Probing.counts` counts."""
IN_CONTACT, SEARCH_ROUNDS, CARRYING, LEFT_BEHIND, COMPARED, TESTED, CARRIED = range(len(COUNTS))


@by_address
class Rows(NamedTuple):
    """Point contacts of the step: row k presses nodes of one triangle along one direction, with an impulse >= 0."""

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
    """S⁻¹ g_k [1/m²], the pressures that undo it, (r, m)."""
    matrix: np.ndarray
    """A [1/kg], (r, r)."""
    right: np.ndarray
    """What the rows ask for beyond the motion without them [m/s], (r,)."""
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
    """Thin probes and a surface: sleeping pairs, the pairs of the step, its contacts."""

    radius: np.ndarray
    """How far a surface stays from each tip [m], (p,); positive also where the probe has no thickness."""
    skipping: bool
    """Whether pairs sleep and boxes are compared; the answer is the same without, bit for bit."""
    travel: np.ndarray
    """How far any node can have come nearer to any tip since the start [m], (1,)."""
    surface: np.ndarray
    """The triangles along the curve, (f, 3) uint32."""
    number: np.ndarray
    """What the body calls them, (f,) uint32."""
    wake: np.ndarray
    """Travel at which the next triangle of a block must be looked at again [m], (p, ceil(f / TRIANGLE_BLOCK))."""
    near: np.ndarray
    """Triangles that may meet a tip in this step, ascending, (p, f) uint32."""
    near_count: np.ndarray
    """(p,) int64."""
    time: np.ndarray
    """When a tip passes through each near triangle, 0 … 1 of the step, or more, (f,)."""
    passing: np.ndarray
    """Weights and direction of each passing, (f, 6)."""
    rows: Rows
    base: np.ndarray
    """u_i, what a node does without contact [m/s], (n, 3); of corners of near triangles."""
    push: np.ndarray
    """Σ_k b_ki c_k W̃_i n_k, what the contacts add, or how much faster than its tip a carried node goes [m/s], (n, 3);
    zero between steps."""
    velocity: np.ndarray
    """v⁺_i as the step stands [m/s], (n, 3)."""
    change: np.ndarray
    """δ, of the pressures of the kept volumes [Pa], (m,)."""
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
    """Of the frame."""
    counts: np.ndarray
    """COUNTS since the start, (7,) int64."""


class Stage(NamedTuple):
    """One step as the functions of this stage see it."""

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
