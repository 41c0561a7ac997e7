"""Quadratic tetrahedra in blocks, and the volumes summed over their points, as arrays."""

from typing import NamedTuple

import numpy as np

from massspring.kernels.jit.by_address import by_address

BLOCK = 16
"""Elements per block: a multiple of the lanes of a vector register."""
NODES, POINTS, CORNERS = 10, 4, 4
NEAR_SIZE = 8
"""Volumes of a cluster of the preconditioner: larger blocks have more numbers that do not count."""
RIGIDITIES = 6
ROWS, AREAS = 3 * NODES, 9
"""Rows of an element: x, y, z of every node; rows of a point in `area` and `corner_force`: x, y, z of three corners."""
SUMS = ROWS + AREAS
"""Row of the first point's sum in the tile."""


@by_address
class FacetRows(NamedTuple):
    """Up to p points in each of f facets, all but the last FURTHER fixed, and the state of their contact."""

    node: np.ndarray
    """Corners, then mid-sides, (f, 6) uint32."""
    count: np.ndarray
    """Points in use, the first ones of p, (f,) int64."""
    half_side: np.ndarray
    """Half the longest side at rest, from corner to corner [m], (f,)."""
    shape: np.ndarray
    """Shape functions at the points, (f, p, 6)."""
    mass: np.ndarray
    """Effective mass of a point, 1/Σ_a w_a N_a² [kg], (f, p)."""
    reach: np.ndarray
    """Bounding radius of a facet about its middle, with a margin [m], (f,)."""
    near: np.ndarray
    """Scratch: facets that may touch an obstacle in this step, (f,) uint32."""
    contact_id: np.ndarray
    """1 + the obstacle that a point touches, 0 for none, (f, p) int64."""
    pressing: np.ndarray
    """Normal force f at each point [N], (f, p)."""
    normal: np.ndarray
    """Of the obstacle, towards the body, (f, p, 3)."""
    dragging: np.ndarray
    """Friction force, tangential to the obstacle [N], (f, p, 3)."""
    anchor: np.ndarray
    """Position at which friction holds a point, relative to the obstacle [m], (f, p, 3)."""
    coupling: np.ndarray
    """Acceleration of point p of a facet per unit of force at point q, Σ_a w_a N_qa N_pa [1/kg], (f, p, p)."""
    candidate: np.ndarray
    """Scratch: 1 + the obstacle that a point may touch in this step, 0 for none, (f, p) int64."""
    slope: np.ndarray
    """Scratch: gradient of the gap at the predicted position of a point, (f, p, 3)."""
    gap: np.ndarray
    """Scratch: linearised gap at the end of the step for speed 0, less the part of the penetration that may remain [m],
    (f, p)."""
    start: np.ndarray
    """Scratch: position of a point at the start of the step [m], (f, p, 3)."""
    last_force: np.ndarray
    """Scratch: the force on a point before it is corrected [N], (f, p, 3)."""
    pressed: np.ndarray
    """Scratch: whether a facet had a force in its last sweep, (f,) bool."""
    point_speed: np.ndarray
    """Scratch: velocities of the points of a facet [m/s], (p, 3)."""
    change: np.ndarray
    """Scratch: changes of the forces on them [N], (p, 3)."""


@by_address
class Inverse(NamedTuple):
    """S⁻¹ at rest of m volumes, nearly: P C Pᵀ over c vertices and closed surfaces, and blocks R between clusters of
    near volumes. It need not be exact."""

    coarse_start: np.ndarray
    """First entry of each volume in `coarse` and `weight`, (m + 1,) uint32."""
    coarse: np.ndarray
    """Vertex or closed surface of each entry of P, uint32."""
    weight: np.ndarray
    """The entries of P [1]."""
    far: np.ndarray
    """C over `coarse_scale` on both sides, (c, c) float32."""
    coarse_scale: np.ndarray
    """√C_vv [√(kg/m⁴)], (c,)."""
    scale: np.ndarray
    """1/√S_rr [√(kg/m⁴)], 0 for what nothing can push, (m,)."""
    order: np.ndarray
    """Volumes cluster by cluster, NEAR_SIZE in each, in the last perhaps fewer, (m,) uint32."""
    near_start: np.ndarray
    """First block of each cluster, (b + 1,) uint32."""
    near_cluster: np.ndarray
    """The cluster that each block couples to, uint32; none if C alone is S⁻¹."""
    near: np.ndarray
    """The blocks of R over `scale` on both sides, 0 beyond the last volume, (NEAR_SIZE q, NEAR_SIZE) float32."""
    moment: np.ndarray
    """Scratch: Pᵀ of the residual, then C Pᵀ of it, (c,)."""
    scaled: np.ndarray
    """Scratch: the scaled moment, (c,) float32."""
    part: np.ndarray
    """Scratch: the scaled residual by cluster, and in the last row a product, (b + 1, NEAR_SIZE) float32."""


@by_address
class ElementRows(NamedTuple):
    """b blocks of elements with the scratch of a pass over them, in one precision.

    A row holds one number of each element of a block. Unused places repeat the first element; they push nothing, and
    their volumes are ignored.
    """

    node: np.ndarray
    """(10 b, BLOCK) uint32."""
    used: np.ndarray
    """1 for each element, 0 for an unused place, (b, BLOCK)."""
    own: float
    """ρ of the corner next to a point; `other` of each of the three others."""
    other: float
    corner_volume: np.ndarray
    """The volume of each corner, (4 b, BLOCK) uint32."""
    volume_start: np.ndarray
    """First entry of each volume of the tissue in `volume_entry`, (v + 1,) uint32."""
    volume_entry: np.ndarray
    """Flat index in `corner_share` of each contribution to a volume, uint32."""
    tile: np.ndarray
    """Scratch: a vector at the nodes of a block, the common part of its slopes at the points, a sum for each point,
    (43, BLOCK)."""
    corner_pressure: np.ndarray
    """Scratch: the pressure of each corner's volume [Pa], (4 b, BLOCK)."""
    corner_share: np.ndarray
    """Scratch: contributions of the elements to the volumes of their corners, (4 b, BLOCK)."""
    corner_force: np.ndarray
    """Scratch: what each point of a block does to three corners [N], (36, BLOCK)."""
    push: np.ndarray
    """Scratch: forces of the elements of a block on their nodes [N], (30, BLOCK)."""
    force: np.ndarray
    """Their sum at each node [N], (n, 4); the fourth number is 0."""


@by_address
class PointRows(NamedTuple):
    """m volumes over b blocks of quadratic tetrahedra: first v of the tissue, then those inside closed surfaces."""

    exact: ElementRows
    """For positions, in the precision of the run."""
    quick: ElementRows
    """For the iteration of the multipliers, in single precision: each step measures the volumes anew, so that its
    errors do not add up."""
    area: np.ndarray
    """w_q cof F_q ∇b_i of three corners [m²], (36 b, BLOCK) float32."""
    velocity: np.ndarray
    """Scratch: velocities or accelerations of the nodes [m/s, m/s²], (n, 4) float32; the fourth number is 0."""
    rigidity: np.ndarray
    """−mu w_q ∇b_i·∇b_j at rest of the pairs 11, 12, 13, 22, 23, 33 [N/m], (24 b, BLOCK); 0 if the springs of the body
    are summed as springs."""
    elastic: bool
    """Whether all springs are in `rigidity`."""
    per_weight: np.ndarray
    """1/w_q [1/m³], (4 b, BLOCK)."""
    bulk: float
    """b [Pa] of the pressure −b (J_q − 1) at points with the pressure of rest."""
    rest_pressure: float
    """[Pa]; above it b rises."""
    corner_eased: np.ndarray
    """Scratch: `eased` of each corner's volume [Pa], (4 b, BLOCK)."""
    most_squeezed: np.ndarray
    """Largest 1 − J_q at a step of the frame so far, in each lane, (1, BLOCK)."""
    closed_triangles: np.ndarray
    """Closed surface whose volume is kept in addition to those of the tissue, (t, 3) uint32; empty for a solid body."""
    closed_nodes: np.ndarray
    """Its nodes, (c,) uint32."""
    closed_gradient: np.ndarray
    """dV/dx of its volume [m²], (n, 3)."""
    heavier: np.ndarray
    """Gravitational mass less inertial mass of each node [kg], (n,)."""
    volume: np.ndarray
    """V_r [m³], (m,)."""
    lam: np.ndarray
    """Multipliers [Pa], (m,); on entry those of the last step."""
    eased: np.ndarray
    """The multipliers, followed slowly [Pa], (m,)."""
    right: np.ndarray
    """Residual of the right-hand side with the current multipliers [m³/s²], (m,)."""
    diagonal: np.ndarray
    """S_rr at rest without contact [m⁴/kg], (m,); 0 for what nothing can push."""
    inverse: Inverse
    """The preconditioner."""
    search: np.ndarray
    """(m,)."""
    image: np.ndarray
    """(m,)."""
    allowed: np.ndarray
    """Residual at which the iteration ends, (m,)."""
    node_vector: np.ndarray
    """Scratch: velocities of the nodes of facets near an obstacle [m/s], (n, 4)."""
    field: np.ndarray
    """Scratch: forces on nodes [N], (n, 3)."""
    moved: np.ndarray
    """Scratch: accelerations of the nodes by forces [m/s²], (n, 3)."""
    facets: FacetRows
    """Contact at points of facets; without facets if obstacles touch nodes."""
