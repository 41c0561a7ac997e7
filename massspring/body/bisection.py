"""The paper's surface body cut in pieces: closed surfaces with caps on the section, springs across it gone.

New nodes on the caps and the springs to them take only mass from the body. A new node starts at a position interpolated
from the nodes around it, a new spring starts without force. So the elastic energy falls by that of the cut springs.
"""

from dataclasses import dataclass

import numpy as np
from scipy.sparse import coo_array, csr_array
from scipy.sparse.csgraph import connected_components

from massspring.body.axis import closest_virtual_node, virtual_nodes
from massspring.body.body import Body
from massspring.body.build import AXIS_MASS_SHARE
from massspring.body.springs import EDGES_OF_TRIANGLE, SpringKind, Springs, bending_pairs, lengths, unique_edges
from massspring.body.surface import winding_number
from massspring.body.volumes import Volumes
from massspring.errors import MassSpringError

NEW = -1
"""Parent number of a node that was not in the body before the cut."""


@dataclass(frozen=True, eq=False)
class Growth:
    """New nodes and springs that a cut adds to a body, beyond copies of existing ones."""

    carry: csr_array
    """Weights that give the positions of its nodes from those before the cut, (n', n): a single 1 in the row of a copy,
    weights that add up to 1 in that of a new node."""
    mass: np.ndarray
    """Part of its parent's mass that each node gets [kg], (n',); 0 for a new node, whose mass is taken from its
    piece."""
    piece: np.ndarray
    """Number of the piece of each node, (n',). The cut keeps momentum and angular momentum of each piece."""
    springs: np.ndarray
    """Numbers of new springs, (q,). They start without force; then their rest lengths move to those of the rest
    shape."""


@dataclass(frozen=True, eq=False)
class Pieces:
    """The paper's body after a cut."""

    body: Body
    """Nodes of all surfaces first, then those on axes. The volume of each piece is kept."""
    parent: np.ndarray
    """For each node its node before the cut, (n',); for a new node the one with the largest weight in `carry`."""
    growth: Growth


def cut_surface(
    body: Body, points: np.ndarray, triangles: np.ndarray, parent: np.ndarray, axis: str = "straight"
) -> Pieces:
    """Cuts `body`, made by `surface_body`, into the pieces bounded by the closed surfaces `triangles` (f', 3) of nodes
    at rest positions `points` (s', 3) [m].

    `parent` (s',): the surface node of `body` that each node was; larger numbers are new nodes on the section, and each
    of these is in two pieces. Axis nodes stay in the piece that contains them. Springs within a piece do not change;
    two pieces share those in the section. A new spring is as stiff as others of its kind. A piece without axis nodes
    gets a new `axis`. Raises MassSpringError for a body of another kind, and for surfaces that form a single piece.
    """
    first = len(body.surface_nodes)
    if len(body.tetrahedra) or len(_ends(body, SpringKind.INNER)) != first:  # one for each node of the surface
        raise MassSpringError("only the paper's surface body is cut so; open a tetrahedral one along its faces")
    piece = _pieces(triangles, len(points))
    if piece.max() == 0:
        raise MassSpringError("the surfaces are one piece; a surface body is cut in two or more, not slit")
    was = np.where(parent < first, parent, NEW)
    if not np.array_equal(np.unique(was[was >= 0]), np.arange(first)):
        raise MassSpringError(
            f"the surfaces of the pieces leave out some of the {first} nodes before; give each a copy"
        )
    section = _section(body.triangles, triangles, was)
    virtual, virtual_was, virtual_piece = _axes(body, points, triangles, piece, axis)
    rest = np.concatenate([points, virtual])
    piece, was = np.concatenate([piece, virtual_piece]), np.concatenate([was, virtual_was])

    to = np.empty(len(points), dtype=np.int64)
    for k in range(piece.max() + 1):
        surface, own = np.flatnonzero(piece[: len(points)] == k), len(points) + np.flatnonzero(virtual_piece == k)
        to[surface] = own[closest_virtual_node(points[surface], rest[own])]
    place = np.full(body.node_count, NEW)
    place[virtual_was[virtual_was >= 0]] = len(points) + np.flatnonzero(virtual_was >= 0)
    fresh = len(points) + np.flatnonzero(virtual_was == NEW)
    groups = {
        SpringKind.STRUCTURAL: unique_edges(triangles, EDGES_OF_TRIANGLE),
        SpringKind.BENDING: bending_pairs(triangles),
        SpringKind.INNER: np.column_stack([np.arange(len(to)), to]),
        SpringKind.AXIAL: np.concatenate([place[_ends(body, SpringKind.AXIAL)], np.stack([fresh[:-1], fresh[1:]], 1)]),
    }
    springs, new = _springs(body, rest, was, piece, groups)
    mass, split = _masses(body, points, triangles, was, piece, section, to)
    carry = _carried(body, rest, parent, was, piece, section, triangles)
    carrier = np.asarray(carry.argmax(axis=1)).ravel()
    cut_body = Body(rest, mass, springs, np.ascontiguousarray(triangles, dtype=np.uint32), law=body.law)
    surfaces = {f"piece {k}": triangles[piece[triangles[:, 0]] == k] for k in range(piece.max() + 1)}
    cut_body = cut_body.keeping(Volumes.closed_surfaces(cut_body, surfaces))
    return Pieces(cut_body, np.where(was >= 0, was, carrier), Growth(carry, split, piece, new))


def _pieces(triangles: np.ndarray, count: int) -> np.ndarray:
    """The closed surface that each of `count` nodes is on, (count,)."""
    pairs = triangles[:, EDGES_OF_TRIANGLE].reshape(-1, 2)
    return connected_components(coo_array((np.ones(len(pairs)), pairs.T), shape=(count, count)), directed=False)[1]


def _section(before: np.ndarray, triangles: np.ndarray, was: np.ndarray) -> np.ndarray:
    """Which triangles are not among those `before` (f, 3), (f',) bool."""
    old = set(map(tuple, np.sort(before.astype(np.int64), axis=1).tolist()))
    return np.array([tuple(row) not in old for row in np.sort(was[triangles], axis=1).tolist()])


def _axes(
    body: Body, points: np.ndarray, triangles: np.ndarray, piece: np.ndarray, axis: str
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Axis nodes [m], (a', 3), existing ones first; the node that each was (NEW for new ones); the piece of each."""
    first, count = len(body.surface_nodes), piece.max() + 1
    surfaces = [triangles[piece[triangles[:, 0]] == k] for k in range(count)]
    old = body.rest[first:]
    inside = np.array([[winding_number(node, points, surface) for surface in surfaces] for node in old])
    near = piece[closest_virtual_node(old, points)]  # an axis may leave a bent organ
    of_old = np.where(inside.max(axis=1) > 0.25, inside.argmax(axis=1), near)
    spacing = float(lengths(body.rest, unique_edges(body.triangles, EDGES_OF_TRIANGLE)).mean())
    nodes, was, of = [old], [first + np.arange(len(old))], [of_old]
    for k in np.setdiff1d(np.arange(count), of_old):
        used, local = np.unique(surfaces[k], return_inverse=True)
        axis_nodes = virtual_nodes(points[used], local.reshape(-1, 3), spacing, axis)
        axis_nodes = axis_nodes[np.unique(closest_virtual_node(points[used], axis_nodes))]
        nodes.append(axis_nodes)
        was.append(np.full(len(axis_nodes), NEW))
        of.append(np.full(len(axis_nodes), k))
    return np.concatenate(nodes), np.concatenate(was), np.concatenate(of)


def _ends(body: Body, kind: SpringKind) -> np.ndarray:
    """Nodes that springs of a kind join, the larger number last, (g, 2)."""
    return np.sort(body.springs.ends[body.springs.kind == kind].astype(np.int64), axis=1)


def _springs(
    body: Body, rest: np.ndarray, was: np.ndarray, piece: np.ndarray, groups: dict[SpringKind, np.ndarray]
) -> tuple[Springs, np.ndarray]:
    """The springs of the pieces, by kind the nodes (g, 2) that may be joined, and which of them are new; copies of one
    share its stiffness."""
    old, n = body.springs, body.node_count
    ends = np.concatenate(list(groups.values()))
    kind = np.repeat([int(k) for k in groups], [len(group) for group in groups.values()])
    within = piece[ends[:, 0]] == piece[ends[:, 1]]
    ends, kind = ends[within], kind[within]

    key = _keys(was[ends], kind, n)
    old_key = _keys(old.ends.astype(np.int64), old.kind.astype(np.int64), n)
    order = np.argsort(old_key)
    at = order[np.minimum(np.searchsorted(old_key, key, sorter=order), len(order) - 1)]
    kept = (old_key[at] == key) & (was[ends] >= 0).all(axis=1)
    copies = np.bincount(at[kept], minlength=old.count)
    of_kind = np.array([_stiffness_of(old, k) for k in groups])
    stiffness, length = of_kind[kind], lengths(rest, ends)
    stiffness[kept] = old.stiffness[at[kept]] / copies[at[kept]]
    length[kept] = old.rest_length[at[kept]]
    springs = Springs(np.ascontiguousarray(ends, dtype=np.uint32), length, stiffness, kind.astype(np.uint8))
    return springs, np.flatnonzero(~kept)


def _keys(ends: np.ndarray, kind: np.ndarray, n: int) -> np.ndarray:
    """One number for each spring between two of n nodes."""
    return (kind * n + ends.min(axis=1)) * n + ends.max(axis=1)


def _stiffness_of(springs: Springs, kind: SpringKind) -> float:
    """Of all springs of a kind [N/m]; of an axis with a single node that of the edges, which weigh as much."""
    stiffness = springs.stiffness[springs.kind == kind]
    return float((stiffness if len(stiffness) else springs.stiffness[springs.kind == SpringKind.STRUCTURAL])[0])


def _masses(
    body: Body,
    points: np.ndarray,
    triangles: np.ndarray,
    was: np.ndarray,
    piece: np.ndarray,
    section: np.ndarray,
    to: np.ndarray,
) -> tuple[np.ndarray, np.ndarray]:
    """Masses of the nodes of the pieces, and the part of its parent's mass that each node gets [kg], both (n',).

    Copies share by the area on their side. The surface of a piece then gives to the section what that has of the
    piece's area, and to nodes of a new axis the share that axes have."""
    count, corners = len(points), points[triangles]
    area = 0.5 * np.linalg.norm(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1) / 3.0
    outer, inner = (
        np.bincount(triangles[mask].ravel(), np.repeat(area[mask], 3), minlength=count) for mask in (~section, section)
    )
    old = was >= 0
    split = np.where(old, body.mass[was], 0.0)
    surface = np.flatnonzero(old[:count])
    together = np.bincount(was[surface], outer[surface], minlength=body.node_count)
    split[surface] *= outer[surface] / together[was[surface]]
    mass, of = split.copy(), piece[:count]
    around = np.bincount(of, inner + outer)
    mine, per_area = np.bincount(of, inner) / around, np.bincount(of, split[:count]) / around
    mass[:count] = (1.0 - mine)[of] * split[:count] + per_area[of] * inner
    for k in np.unique(piece[~old & (np.arange(len(was)) >= count)]):
        nodes = np.flatnonzero(of == k)
        mass += np.bincount(to[nodes], AXIS_MASS_SHARE * mass[nodes], minlength=len(mass))
        mass[nodes] *= 1.0 - AXIS_MASS_SHARE
    return mass, split


def _carried(
    body: Body,
    rest: np.ndarray,
    parent: np.ndarray,
    was: np.ndarray,
    piece: np.ndarray,
    section: np.ndarray,
    triangles: np.ndarray,
) -> csr_array:
    """Weights that give node positions from those before, (n', n): on the section from its outline, on a new axis from
    the surface of the piece."""
    count = len(parent)
    rows, columns = np.flatnonzero(was >= 0), was[was >= 0]
    entries = [(rows, columns, np.ones(len(rows)))]
    # Both sides of the section have the same triangles by their numbers before.
    place = np.zeros((parent.max() + 1, 3))
    place[parent] = rest[:count]
    cap = np.unique(np.sort(parent[triangles[section]], axis=1), axis=0)
    first = len(body.surface_nodes)
    inside, outline, weights = harmonic(place, cap, first)
    born = np.flatnonzero(was[:count] < 0)
    of_row = np.searchsorted(inside, parent[born])
    entries.append((np.repeat(born, len(outline)), np.tile(outline, len(born)), weights[of_row].ravel()))
    for k in np.unique(piece[count:][was[count:] < 0]):
        nodes = np.flatnonzero((was[:count] >= 0) & (piece[:count] == k))
        fresh = count + np.flatnonzero((was[count:] < 0) & (piece[count:] == k))
        weights = affine(rest[nodes], rest[fresh])
        entries.append((np.repeat(fresh, len(nodes)), np.tile(was[nodes], len(fresh)), weights.ravel()))
    row, column, value = (np.concatenate(part) for part in zip(*entries, strict=True))
    return csr_array(coo_array((value, (row, column)), shape=(len(rest), body.node_count)))


def harmonic(points: np.ndarray, triangles: np.ndarray, first: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """(inner nodes, outer nodes, weights (i, o)): harmonic weights of the nodes numbered from `first` on by the other
    nodes of `triangles` (f, 3).

    Σ over the nodes around each of w_ij (x_j − x_i) = 0 with w_ij = ½ (cot a + cot b) of the angles opposite to the
    edge at rest (Pinkall, Polthier 1993): every linear function, so each place at rest, is met exactly.
    """
    used, local = np.unique(triangles, return_inverse=True)
    local = local.reshape(-1, 3)
    matrix = np.zeros((len(used), len(used)))
    for a in range(3):
        apex, one, other = (points[triangles[:, (a + b) % 3]] for b in range(3))
        across = np.linalg.norm(np.cross(one - apex, other - apex), axis=1)
        half = 0.5 * np.einsum("fi,fi->f", one - apex, other - apex) / across
        i, j = local[:, (a + 1) % 3], local[:, (a + 2) % 3]
        for row, column, sign in ((i, i, 1.0), (j, j, 1.0), (i, j, -1.0), (j, i, -1.0)):
            np.add.at(matrix, (row, column), sign * half)
    free = used >= first
    weights = -np.linalg.solve(matrix[np.ix_(free, free)], matrix[np.ix_(free, ~free)])
    return used[free], used[~free], weights


def affine(points: np.ndarray, places: np.ndarray) -> np.ndarray:
    """The smallest weights of `points` (p, 3) that add up to 1 and reproduce each of `places` (q, 3), (q, p)."""
    conditions = np.column_stack([np.ones(len(points)), points - points.mean(axis=0)])
    right = np.column_stack([np.ones(len(places)), places - points.mean(axis=0)])
    return right @ np.linalg.pinv(conditions)
