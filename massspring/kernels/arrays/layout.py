"""Springs as arguments of compiled loops: triangle springs, and the other springs in slices of 64 nodes."""

from typing import NamedTuple

import numpy as np

from massspring.kernels.jit.by_address import by_address
from massspring.kernels.jit.stage_clock import StageTimes


@by_address
class Membrane(NamedTuple):
    """t triangle springs; edge a of a triangle lies opposite its node a."""

    triangles: np.ndarray
    """(t, 3) uint32."""
    rest_square: np.ndarray
    """L_a² [m²], (t, 3)."""
    stiffness: np.ndarray
    """k_a of each edge [N/m³], (t, 3)."""
    coupling: np.ndarray
    """c_a of the two edges that meet at node a [N/m³], (t, 3)."""


@by_address
class Slices(NamedTuple):
    """Neighbours of all nodes: S slices of 64 nodes, r rows of 64 neighbours.

    The first rows of a slice walk the rings of its nodes: the neighbours on the kept surface in order, first to last.
    The others are all remaining springs. Shorter lists are filled up with springs of no stiffness. The first `pieces`
    slices hold pieces of nodes that have too many neighbours for a lane, or several rings.
    """

    node: np.ndarray
    """(S, 64) uint32; empty lanes repeat a node of the slice."""
    lanes: np.ndarray
    """Lanes in use, (S,) int64."""
    first: np.ndarray
    """First node of a full slice whose nodes have consecutive numbers, else -1, (S,) int64."""
    start: np.ndarray
    """First row of each slice, (S + 1,) int64."""
    rings: np.ndarray
    """Number of rows of each slice that are rings, (S,) int64."""
    neighbour: np.ndarray
    """(r, 64) uint32."""
    rest_length: np.ndarray
    """[m], (r, 64)."""
    stiffness: np.ndarray
    """The u different rows of stiffnesses [N/m], (u, 64): few if all springs of a kind are equally stiff; 0 for no
    spring."""
    stiffness_row: np.ndarray
    """Index into `stiffness` of each row, (r,) uint32."""
    inverse_mass: np.ndarray
    """[1/kg], (S, 64)."""
    pieces: int
    split_node: np.ndarray
    """Nodes in pieces, (q,) uint32."""
    split_start: np.ndarray
    """First entry of each split node in `split_piece`, (q + 1,) int64."""
    split_piece: np.ndarray
    """Slice × 64 + lane of each piece, int64."""
    held_start: np.ndarray
    """Where in `held_lane` each slice begins, (S + 1,) int64."""
    held_lane: np.ndarray
    """Lanes of the nodes whose motion is prescribed, but for those in pieces, int64."""
    origin: int
    """The node to which the positions are relative in the sum for the volume."""
    without_length: bool
    """Whether all springs have a rest length of 0."""


@by_address
class Model(NamedTuple):
    """What does not change during a run; s springs, f triangles, n nodes, h held nodes, c surface nodes."""

    ends: np.ndarray
    """Spring ends, (s, 2) uint32. Unsigned: signed indices cost up to 1.9 times in gather loops."""
    rest_length: np.ndarray
    """[m], (s,)."""
    stiffness: np.ndarray
    """[N/m], (s,)."""
    membrane: Membrane
    """Triangle springs, none in most bodies."""
    triangles: np.ndarray
    """Closed surface of the one volume that is kept, outward, (f, 3) uint32; of the whole where there are several."""
    mass: np.ndarray
    """Inertial mass [kg], (n,)."""
    inverse_mass: np.ndarray
    """[1/kg], (n,); 0 marks a node whose motion is prescribed."""
    largest_inverse_mass: float
    surface_nodes: np.ndarray
    """Nodes on the surface, (c,) uint32."""
    touchable: np.ndarray
    """1 for nodes that obstacles can touch: on the surface and not held, (n,) uint8."""
    held_nodes: np.ndarray
    """(h,) uint32."""
    held_group: np.ndarray
    """Attachment each held node belongs to, (h,) uint32."""
    held_rest: np.ndarray
    """Rest positions of the held nodes [m], (h, 3)."""
    rest_lam: np.ndarray
    """Multiplier of each kept volume at rest [Pa], (m,): together they balance springs without length."""
    correction_limit: float
    """Largest distance by which the correction of a volume error may move a node in a step [m]; later steps correct the
    rest."""
    slices: Slices


@by_address
class Nodes(NamedTuple):
    """Positions, velocities and forces of the n nodes; they change in every step."""

    x: np.ndarray
    """Positions [m], (n, 3)."""
    v: np.ndarray
    """Velocities [m/s], (n, 3)."""
    v_star: np.ndarray
    """Velocities predicted from all explicit forces, before multipliers and contact [m/s], (n, 3)."""
    force: np.ndarray
    """Forces on held nodes [N], (n, 3); rows of free nodes are not kept up to date."""
    gradient: np.ndarray
    """G = dV/dx of the one volume that is kept [m²], (n, 3); 0 where none is, or several."""


@by_address
class Contacts(NamedTuple):
    """Nodes that obstacles touch in this step, and the directions of motion that contact removes."""

    contact_id: np.ndarray
    """0 for a free node, else 1 + the obstacle it lies on, (n,) uint32."""
    second: np.ndarray
    """1 + the second obstacle of a node that lies on the edge between two, (n,) uint32."""
    mode: np.ndarray
    """Directions that obstacles take from a node (kernels.contact.node_contact), (n,) uint8."""
    normal: np.ndarray
    """Unit normal of the touched obstacle, towards the body, (n, 3)."""
    second_normal: np.ndarray
    """Of the second obstacle, (n, 3)."""
    direction: np.ndarray
    """The normal of a node that slides, the edge of one between two obstacles, (n, 3)."""
    v_target: np.ndarray
    """Velocity in the removed directions that ends the step on the obstacles, reduced by friction [m/s], (n, 3)."""
    active: np.ndarray
    """The touched nodes, in the order in which they were found, (n,) uint32; released ones among them."""
    active_count: np.ndarray
    """(1,) int64."""
    entering: np.ndarray
    """Scratch: nodes that would enter an obstacle, (n,) uint32."""
    predicted_gap: np.ndarray
    """Distance to the nearest obstacle at the end of the predicted step [m], inf for touched nodes, (n,)."""
    beside_start: np.ndarray
    """Where the mid-side nodes next to each corner of `contact_facets` begin in `beside`, (n + 1,) uint32."""
    beside: np.ndarray
    """Mid-side nodes, those of a corner together, uint32."""
    stayed: np.ndarray
    """Scratch: corners that lay on planes in the last step, 1 + that plane, 1 + a second one or 0, (n, 3) uint32."""


@by_address
class Workspace(NamedTuple):
    """Scratch of the pass over all springs: nothing is allocated inside a frame."""

    padded_positions: np.ndarray
    """Positions [m] and a zero, (n, 4)."""
    tile: np.ndarray
    """Scratch of `kernels.fused` for one slice (kernels.fused.chunk)."""
    pulled: np.ndarray
    """Forces and 6 G of the slices of pieces, (pieces, 384)."""
    sums: np.ndarray
    """Contributions of the slices to 18 V, G·v* and G·W·G, (S + 1, 3) float64; the last row is that of nodes in
    pieces."""


class Push(NamedTuple):
    """The force that keeps volumes on every node, f_i = factor · direction_i [N].

    One volume: lam G_i; several: (Jᵀ lam)_i, summed before, with a factor of 1. Kernels use only the product. The two
    factors stay separate because G is computed before lam: an array of forces would need one more pass over all nodes
    whenever lam changes, and dt w (lam G) rounds differently from (dt lam w) G.
    """

    direction: np.ndarray
    """G [m²] or Jᵀ lam [N], (n, 3)."""
    factor: float
    """lam [Pa] or 1."""


@by_address
class Tips(NamedTuple):
    """Where the tips of p thin probes are during a frame of q steps."""

    start: np.ndarray
    """At the start of each step [m], (q, p, 3)."""
    end: np.ndarray
    """At the end of each step [m], (q, p, 3)."""


@by_address
class BoundaryConditions(NamedTuple):
    """Loads, obstacles and targets during one frame of q steps; o obstacles, g attachments."""

    dt: float
    """[s]."""
    damping: float
    """Mass-proportional damping c [1/s]."""
    gravity: np.ndarray
    """[m/s²], (3,)."""
    is_plane: np.ndarray
    """(o,) bool; the others are capsules; a capsule of length 0 is a sphere."""
    plane_normal: np.ndarray
    """Unit normals, towards the body, (o, 3)."""
    radius: np.ndarray
    """Of spheres and capsules [m], (o,)."""
    span: np.ndarray
    """From the start of a capsule's axis to its end [m], (o, 3)."""
    friction: np.ndarray
    """Coulomb's coefficient [1], (o,); inf where nothing slips."""
    rough: bool
    """Whether any obstacle has friction."""
    inside: np.ndarray
    """Whether an obstacle touches points inside facets; else it touches nodes, (o,) bool."""
    position: np.ndarray
    """Plane points, sphere centres and starts of capsules at the end of each step [m], (q, o, 3)."""
    velocity: np.ndarray
    """Of the obstacles, mean over each step [m/s], (q, o, 3)."""
    held_displacement: np.ndarray
    """Of the attachments at the end of each step [m], (q, g, 3)."""
    held_velocity: np.ndarray
    """Of the attachments, mean over each step [m/s], (q, g, 3)."""
    volume_target: np.ndarray
    """Target of each kept volume at the end of each step [m³], (q, m)."""
    tips: Tips
    """Of thin probes, which are not among the obstacles above."""


class Accuracy(NamedTuple):
    """Stopping criterion of the iteration for the multipliers."""

    tolerance: float
    """Volume error left by the linear solve, over the volume [1]."""
    most_iterations: int


@by_address
class FrameDiagnostics(NamedTuple):
    """Counts and sums of one frame. The loop adds to them; the caller sets them to zero before."""

    contact_impulse: np.ndarray
    """Impulse of each obstacle on the body [N s], those of thin probes last, (o + p, 3)."""
    held_impulse: np.ndarray
    """Impulse of each attachment on the body [N s], (g, 3)."""
    earlier_contact: np.ndarray
    """`contact_impulse` before the last step of the frame, (o + p, 3); NaN where the method does not look back."""
    earlier_held: np.ndarray
    """`held_impulse` before the last step of the frame, (g, 3); NaN where the method does not look back."""
    work: np.ndarray
    """Of obstacles and attachments on the body before the last step of the frame [J], (1,)."""
    singular: np.ndarray
    """Steps in which a volume with an error had no gradient, so that no pressure could act, (1,) int64."""
    limited: np.ndarray
    """Steps that corrected only part of a volume error, (1,) int64."""
    iterations: np.ndarray
    """Iterations for the multipliers: their sum, and the most in one step, (2,) int64; 0 where they are direct."""
    stage_times: StageTimes
    """Where the time goes, if it is measured."""
