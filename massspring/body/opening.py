"""Opens a mesh along some of its inner faces: nodes are doubled, the cells do not change.

Masses, springs and volumes of a body are sums over its cells, so the opened mesh has the same totals. Positions and
velocities of its nodes are `x[parent]` and `v[parent]`; momentum and energy do not change.
"""

from dataclasses import dataclass

import numpy as np
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

from massspring.body.partition import tetrahedron_faces
from massspring.body.points import PAIRS
from massspring.errors import MassSpringError

OF_FACE = np.array([[j for j in range(4) if j != k] for k in range(4)])
"""Corners of the face opposite each corner."""
OF_QUADRATIC_FACE = np.array([[*OF_FACE[k], *(4 + np.flatnonzero(~np.equal(PAIRS, k).any(axis=1)))] for k in range(4)])
"""The same with the nodes between them."""


@dataclass(frozen=True, eq=False)
class Opening:
    """The cells of a mesh whose cut faces have become part of its boundary."""

    cells: np.ndarray
    """Nodes of each cell, (k, 4) or (k, 10) uint32; the order of cells and of the nodes in a cell does not change."""
    parent: np.ndarray
    """For each node its node before the opening, (n',); the first n nodes keep their numbers."""
    pairs: np.ndarray
    """Nodes that keep their number, behind the faces, and their copies in front of them, (p, 2)."""


def parents(before: np.ndarray, after: np.ndarray) -> np.ndarray:
    """For each number in `after` (k, c) the number at the same position in `before` (k, c), (n',). The numbers are
    nodes of cells, or volumes of cells."""
    parent = np.empty(int(after.max()) + 1, dtype=np.int64)
    parent[after.ravel()] = before.ravel()
    return parent


def opened(cells: np.ndarray, faces: np.ndarray, n: int) -> Opening:
    """The mesh of `cells` (k, 4) or (k, 10) over `n` nodes, opened along the inner `faces` (f, 3).

    A face is given by its three corners, seen anticlockwise from its front; all faces of a sheet have their fronts on
    the same side. A node is split into as many nodes as there are groups of cells around it that uncut faces join, so a
    node on the front of a cut stays single. Raises MassSpringError for a face that no two cells share, and for one that
    would not open.
    """
    cells, faces = np.asarray(cells, dtype=np.int64), np.asarray(faces, dtype=np.int64)[:, :3]
    of_face = OF_FACE if cells.shape[1] == 4 else OF_QUADRATIC_FACE
    mesh_faces, first, second = tetrahedron_faces(cells[:, :4])
    cut = _places(faces, mesh_faces.astype(np.int64), second, n)
    split = np.zeros(n, dtype=bool)
    split[cells[first[cut] // 4, :][np.arange(len(cut))[:, None], of_face[first[cut] % 4]]] = True
    joined = second >= 0
    joined[cut] = False
    group, node = _groups(cells, of_face, first[joined], second[joined], split)
    behind = np.zeros(group.max(initial=-1) + 1, dtype=bool)
    same = _sense(faces) == _sense(mesh_faces[cut].astype(np.int64))
    place = np.where(same, first[cut], second[cut])
    corners = (place // 4)[:, None] * cells.shape[1] + of_face[place % 4]
    behind[group[corners]] = True
    number = _numbers(node, behind, n)
    inside = group >= 0
    new = cells.ravel().copy()
    new[inside] = number[group[inside]]
    new = new.reshape(cells.shape)
    copies = np.flatnonzero(number >= n)
    copies = copies[np.argsort(number[copies])]
    parent = np.concatenate([np.arange(n), node[copies]])
    _check_open(new, first[cut], second[cut], faces, node[copies])
    pairs = np.column_stack([node[copies], number[copies]])
    return Opening(np.ascontiguousarray(new, dtype=np.uint32), parent, pairs)


def _places(faces: np.ndarray, mesh_faces: np.ndarray, second: np.ndarray, n: int) -> np.ndarray:
    """Where the cut faces are among those of the mesh, (f,)."""
    keys = [(np.sort(rows, axis=1) @ np.array([n * n, n, 1], dtype=np.int64)) for rows in (mesh_faces, faces)]
    order = np.argsort(keys[0])
    at = order[np.minimum(np.searchsorted(keys[0], keys[1], sorter=order), len(order) - 1)]
    lost = int(((keys[0][at] != keys[1]) | (second[at] < 0)).sum())
    if lost:
        raise MassSpringError(f"{lost} cut faces are not between two cells of the mesh; cut along its inner faces")
    if len(np.unique(at)) < len(at):
        raise MassSpringError("a cut face is given twice; give each face once")
    return at


def _sense(triangles: np.ndarray) -> np.ndarray:
    """(f,): +1 where the three numbers ascend cyclically, −1 where they descend."""
    a, b, c = triangles.T
    return np.sign((b - a) * (c - b) * (c - a))


def _groups(
    cells: np.ndarray, of_face: np.ndarray, first: np.ndarray, second: np.ndarray, split: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Group of each corner of each cell at a node to be `split` (n,), else −1, (width k,), and the node of each group.

    Corners of two cells are in one group when a face of the places `first` and `second` joins them.
    """
    width = cells.shape[1]
    sides = []
    for place in (first, second):
        corners = (place // 4)[:, None] * width + of_face[place % 4]
        order = np.argsort(cells.ravel()[corners], axis=1)
        sides.append(np.take_along_axis(corners, order, axis=1).ravel())
    here = split[cells.ravel()[sides[0]]]
    used = np.flatnonzero(split[cells.ravel()])
    local = np.full(cells.size, -1, dtype=np.int64)
    local[used] = np.arange(len(used))
    ends = local[sides[0][here]], local[sides[1][here]]
    graph = coo_array((np.ones(len(ends[0])), ends), shape=(len(used), len(used)))
    count, label = connected_components(graph, directed=False)
    group = np.full(cells.size, -1, dtype=np.int64)
    group[used] = label
    node = np.empty(count, dtype=np.int64)
    node[label] = cells.ravel()[used]
    return group, node


def _numbers(node: np.ndarray, behind: np.ndarray, n: int) -> np.ndarray:
    """Number of the node of each group: of those at one node the first, behind the faces, keeps its number."""
    order = np.lexsort((np.arange(len(node)), ~behind, node))
    copy = np.zeros(len(node), dtype=bool)
    copy[1:] = node[order][1:] == node[order][:-1]
    number = np.empty(len(node), dtype=np.int64)
    number[order] = np.where(copy, n + np.cumsum(copy) - 1, node[order])
    return number


def _check_open(
    cells: np.ndarray, first: np.ndarray, second: np.ndarray, faces: np.ndarray, copied: np.ndarray
) -> None:
    """Raises MassSpringError if both copies of a face of the cut, or of an edge inside it, have the same nodes."""
    one, other = (
        np.sort(cells[place // 4, :][np.arange(len(place))[:, None], OF_FACE[place % 4]], axis=1)
        for place in (first, second)
    )
    shut = (one == other).all(axis=1)
    sides = np.sort(faces[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2), axis=1)
    inner, count = np.unique(sides, axis=0, return_counts=True)
    chords = int((~np.isin(inner[count > 1], copied)).all(axis=1).sum())
    if shut.any() or chords:
        raise MassSpringError(
            f"{int(shut.sum())} cut faces and {chords} sides between two have all their nodes on the front of the cut,"
            " so they cannot open; use a finer mesh there"
        )
