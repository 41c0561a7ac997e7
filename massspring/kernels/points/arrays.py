"""Quadratic tetrahedra side by side in blocks, and the volumes summed over their points, as arrays."""

from typing import NamedTuple

import numpy as np

from massspring.kernels.jit.by_address import by_address

BLOCK = 16
"""Elements side by side: a multiple of what a vector register holds."""
NODES, POINTS, CORNERS = 10, 4, 4
ROWS, AREAS = 3 * NODES, 9
"""Of an element: x, y, z of every node; of a point in `area`: x, y, z of three corners."""
SUMS = ROWS + AREAS
"""Row of the first point's sum in the tile."""


@by_address
class FacetRows(NamedTuple):
    """p points in each of f facets, and the state of their contact."""

    node: np.ndarray
    """Corners, then mid-sides, (f, 6) uint32."""
    shape: np.ndarray
    """Shape functions at the points, (p, 6)."""
    mass: np.ndarray
    """What resists a push at a point, 1/Σ_a w_a N_a² [kg], (f, p)."""
    reach: np.ndarray
    """How far a facet is from its middle at most [m], (f,)."""
    near: np.ndarray
    """Scratch: facets that may touch an obstacle in this step, (f,) uint32."""
    contact_id: np.ndarray
    """1 + the obstacle that a point touches, 0 for none, (f, p) int64."""
    pressing: np.ndarray
    """f [N], (f, p)."""
    normal: np.ndarray
    """Of the obstacle, towards the body, (f, p, 3)."""
    dragging: np.ndarray
    """The force along the obstacle [N], (f, p, 3)."""
    anchor: np.ndarray
    """Where friction holds a point, seen from the obstacle [m], (f, p, 3)."""
    coupling: np.ndarray
    """What a force at a point gives the others of its facet, Σ_a w_a N_qa N_pa [1/kg], (f, p, p)."""
    candidate: np.ndarray
    """Scratch: 1 + the obstacle that a point may touch in this step, 0 for none, (f, p) int64."""
    slope: np.ndarray
    """Scratch: the gradient of its gap where the point would end the step, (f, p, 3)."""
    gap: np.ndarray
    """Scratch: the gap that a point at no speed would end with, less what may be left inside [m], (f, p)."""
    start: np.ndarray
    """Scratch: where a point is at the start of the step [m], (f, p, 3)."""
    last_force: np.ndarray
    """Scratch: the force on a point before it is corrected [N], (f, p, 3)."""
    pressed: np.ndarray
    """Scratch: whether a facet had a force when it was last looked at, (f,) bool."""
    point_speed: np.ndarray
    """Scratch: of the points of a facet [m/s], (p, 3)."""
    change: np.ndarray
    """Scratch: of the forces on them [N], (p, 3)."""


@by_address
class PointRows(NamedTuple):
    """m volumes over b blocks of quadratic tetrahedra, v of vertices and then those inside closed surfaces.

    Numbers of the elements of a block follow each other in a row. Empty elements repeat the first, and
    nothing asks for what they give.
    """

    node: np.ndarray
    """(10 b, BLOCK) uint32."""
    per_weight: np.ndarray
    """1/w_q [1/m³], (4 b, BLOCK)."""
    own: float
    """ρ of the corner next to a point; `other` of each of the three others."""
    other: float
    bulk: float
    """b [Pa] of the pressure −b (J_q − 1) at the points."""
    corner_volume: np.ndarray
    """The volume of each corner, (4 b, BLOCK) uint32."""
    node_start: np.ndarray
    """Where the entries of each node begin in the next, (n + 1,) uint32."""
    node_entry: np.ndarray
    """Where its shares begin in `element_push`, seen as flat; y and z are BLOCK and 2 BLOCK further, uint32."""
    volume_start: np.ndarray
    """Where the entries of each vertex begin in the next, (v + 1,) uint32."""
    volume_entry: np.ndarray
    """Where its shares are in `corner_share`, seen as flat, uint32."""
    closed_triangles: np.ndarray
    """Of the closed surface kept beside the vertices, (t, 3) uint32; none in a solid body."""
    closed_nodes: np.ndarray
    """Its nodes, (c,) uint32."""
    closed_gradient: np.ndarray
    """dV/dx of its volume [m²], (n, 3)."""
    heavier: np.ndarray
    """What gravity pulls at beyond the mass that resists motion [kg], (n,)."""
    area: np.ndarray
    """Scratch: w_q cof F_q ∇b_i of three corners [m²], (36 b, BLOCK)."""
    stretch: np.ndarray
    """Scratch: −b (J_q − 1) [Pa], (4 b, BLOCK)."""
    corner_pressure: np.ndarray
    """Scratch: the pressure of each corner's volume [Pa], (4 b, BLOCK)."""
    corner_share: np.ndarray
    """Scratch: shares of the elements in the volumes of their corners, (4 b, BLOCK)."""
    element_push: np.ndarray
    """Scratch: forces of the elements on their nodes [N], (30 b, BLOCK)."""
    tile: np.ndarray
    """Scratch: a vector of the nodes of a block, what points share of its slopes, a sum of each, (43, BLOCK)."""
    volume: np.ndarray
    """V_r [m³], (m,)."""
    lam: np.ndarray
    """Multipliers, on the way in those of the last step [Pa], (m,)."""
    push: np.ndarray
    """The force of all volumes and of the points' own pressure on each node [N], (n, 3)."""
    right: np.ndarray
    """What the multipliers of the moment leave of the right-hand side [m³/s²], (m,)."""
    diagonal: np.ndarray
    """S_rr at rest without contact [m⁴/kg], (m,); 0 for what nothing can push."""
    inverse: np.ndarray
    """S⁻¹ at rest, scaled to a diagonal of 1 of S: a preconditioner, (m, m) float32."""
    scale: np.ndarray
    """1/√S_rr [√(kg/m⁴)], 0 for what nothing can push, (m,)."""
    scaled: np.ndarray
    """Scratch of the preconditioner, (m,) float32."""
    search: np.ndarray
    """(m,)."""
    image: np.ndarray
    """(m,)."""
    allowed: np.ndarray
    """Residual at which the iteration ends, (m,)."""
    node_vector: np.ndarray
    """(n, 4); the fourth number is 0."""
    field: np.ndarray
    """Scratch: forces on nodes [N], (n, 3)."""
    moved: np.ndarray
    """Scratch: what nodes make of forces [m/s²], (n, 3)."""
    facets: FacetRows
    """Where obstacles touch, of no facet where they touch nodes."""
