"""Virtual nodes: a mesh cut along a sheet that its faces do not follow (Molino, Bao, Fedkiw 2004).

A cell that the sheet crosses becomes two copies, one for each side. A copy has the share of its cell's stiffness, mass
and volume that lies on its side, and its corners on the other side are virtual nodes. Copies are joined by the nodes of
a face on which both have tissue. A cell with the same share in stiffness and mass keeps its frequencies, so that no
sliver shortens the time step.

Only nodes behind the front of a cut have virtual ones. A cell in which the front ends is cut in part: its copies have
the cut part of its section, and a third one, which joins both sides, has the rest.
"""

from dataclasses import dataclass

import numpy as np
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

from massspring.body.partition import FACES_OF_TETRAHEDRON, tetrahedron_faces
from massspring.errors import MassSpringError


@dataclass(frozen=True, eq=False)
class VirtualNodes:
    """Copies of the k cells of a mesh of n nodes."""

    cells: np.ndarray
    """Nodes of each copy in the order of its cell, (k', 4) uint32; nodes on the side of the copy keep their numbers."""
    cell: np.ndarray
    """The cell that each is a copy of, ascending, (k',)."""
    side: np.ndarray
    """+1 in front of the sheet, −1 behind it, 0 for a whole cell and for the copy that joins both sides, (k',)."""
    share: np.ndarray
    """Part of the cell that each copy has, (k',): positive, 1 for all copies of a cell together."""
    parent: np.ndarray
    """For each node its node before the cut, (n',); the first n nodes keep their numbers, the others are virtual."""


def part_in_front(level: np.ndarray) -> np.ndarray:
    """Part of the volume of tetrahedra in which a linear function is positive, (c,), from its values `level` (c, 4) at
    the corners, none of them 0 and not all of one sign."""
    a, b, c, d = np.sort(level, axis=1)[:, ::-1].T
    with np.errstate(divide="ignore", invalid="ignore"):
        one = a**3 / ((a - b) * (a - c) * (a - d))
        three = 1.0 + d**3 / ((a - d) * (b - d) * (c - d))
        # A wedge between two corners in front and the places where their edges are cut, as three tetrahedra.
        ac, ad, bc, bd = (front / (front - behind) for front, behind in ((a, c), (a, d), (b, c), (b, d)))
        two = ac * ad + ac * (1.0 - ad) * bd + (1.0 - ac) * bc * bd
    return np.choose((level > 0).sum(axis=1) - 1, [one, two, three])


def virtual_nodes(cells: np.ndarray, level: np.ndarray, parted: np.ndarray, part: np.ndarray) -> VirtualNodes:
    """The mesh of `cells` (k, 4) cut along a sheet.

    `level` (n,): signed distance of each node from the sheet, in any unit. `parted` (n,) bool: which nodes lie behind
    the front of the cut. `part` (k,): the part of each cell's section that is cut [1]. Raises MassSpringError for a
    node on the sheet, and for a cut that parts no cell.
    """
    cells = np.asarray(cells, dtype=np.int64)
    if (level == 0).any():
        raise MassSpringError(f"{int((level == 0).sum())} nodes lie on the sheet of a cut; move it a little")
    front = level[cells] > 0
    cut = front.any(axis=1) & ~front.all(axis=1) & parted[cells].any(axis=1) & (part > 0)
    if not cut.any():
        raise MassSpringError("a cut parts no cell; make it larger, or use a finer mesh there")
    sides = [np.flatnonzero(~cut), np.flatnonzero(cut & (part < 1)), np.flatnonzero(cut), np.flatnonzero(cut)]
    cell, side = np.concatenate(sides), np.repeat([0, 0, 1, -1], [len(rows) for rows in sides])
    share = np.concatenate([np.ones(len(sides[0])), 1.0 - part[sides[1]], part[sides[2]], part[sides[3]]])
    copied = side != 0
    share[copied] *= part_in_front(side[copied, None] * level[cells[cell[copied]]])
    order = np.lexsort((side, cell))
    cell, side, share = cell[order], side[order], share[order]
    virtual = (side != 0)[:, None] & (front[cell] != (side > 0)[:, None]) & parted[cells[cell]]
    new, group = cells[cell], _joined(cells, cell, side, level)[virtual]
    _, first, number = np.unique(group, return_index=True, return_inverse=True)
    parent = np.concatenate([np.arange(len(level)), new[virtual][first]])
    new[virtual] = len(level) + number
    return VirtualNodes(np.ascontiguousarray(new, dtype=np.uint32), cell, side, share, parent)


def _joined(cells: np.ndarray, cell: np.ndarray, side: np.ndarray, level: np.ndarray) -> np.ndarray:
    """The group of each corner of each copy, (k', 4). Corners at the same node are in one group if two copies of the
    same side share a face on which both have tissue."""
    _, first, second = tetrahedron_faces(cells)
    first, second = first[second >= 0], second[second >= 0]
    nodes = cells[(first // 4)[:, None], FACES_OF_TETRAHEDRON[first % 4]]
    ends = []
    for sign in (1, -1):
        copy = np.full(len(cells), -1, dtype=np.int64)
        copy[cell[side == sign]] = np.flatnonzero(side == sign)
        joins = (sign * level[nodes] > 0).any(axis=1) & (copy[first // 4] >= 0) & (copy[second // 4] >= 0)
        corners = []
        for place in (first[joins], second[joins]):
            local = FACES_OF_TETRAHEDRON[place % 4]
            by_node = np.argsort(cells[(place // 4)[:, None], local], axis=1)
            corners.append(4 * copy[place // 4][:, None] + np.take_along_axis(local, by_node, axis=1))
        ends.append(np.stack(corners).reshape(2, -1))
    pairs, size = np.concatenate(ends, axis=1), 4 * len(cell)
    graph = coo_array((np.ones(pairs.shape[1]), tuple(pairs)), shape=(size, size))
    return connected_components(graph, directed=False)[1].reshape(-1, 4)
