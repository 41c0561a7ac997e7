"""Balanced, connected regions of a tetrahedral mesh, by recursive bisection along geodesic distances.

With d_a, d_b the distances within the region from two far ends a and b, a walk along a shortest path to a never raises
d_a − d_b, and one to b never lowers it. So a cut at a value of d_a − d_b leaves two connected halves, in a bent or
hollow organ as well; cells with equal values (a branch that hangs on one cell) stay together, which costs some balance.
"""

import numpy as np
from scipy.sparse import coo_array, csr_array
from scipy.sparse.csgraph import connected_components, dijkstra

from massspring.body.springs import EDGES_OF_TETRAHEDRON
from massspring.errors import MassSpringError

FACES_OF_TETRAHEDRON = np.array([[1, 2, 3], [0, 3, 2], [0, 1, 3], [0, 2, 1]])
"""Outward faces; face k lies opposite node k."""
TIE = 1e-9
"""Distances closer than this fraction of the largest are equal: far above round-off, far below an edge."""


def tetrahedron_faces(tetrahedra: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Every face of `tetrahedra` (k, 4) once: its nodes (f, 3), outward of its first cell, and its two places, (f,)
    each.

    A place is 4 t + k: face k of cell t; the second one is −1 on the boundary. Raises MassSpringError for a face of
    three cells.
    """
    nodes = tetrahedra[:, FACES_OF_TETRAHEDRON].reshape(-1, 3)
    _, first, inverse, count = np.unique(
        np.sort(nodes, axis=1), axis=0, return_index=True, return_inverse=True, return_counts=True
    )
    if (count > 2).any():
        raise MassSpringError(
            f"{int((count > 2).sum())} faces belong to three tetrahedra or more; remove doubled cells"
        )
    second = np.full(len(first), -1, dtype=np.int64)
    inverse = inverse.reshape(-1)
    repeated = np.setdiff1d(np.arange(len(nodes)), first, assume_unique=True)
    second[inverse[repeated]] = repeated
    return np.ascontiguousarray(nodes[first], dtype=np.uint32), first, second


def cell_graph(points: np.ndarray, tetrahedra: np.ndarray) -> csr_array:
    """Distance [m] between the centroids of face neighbours, (k, k)."""
    _, first, second = tetrahedron_faces(tetrahedra)
    inner = second >= 0
    a, b = first[inner] // 4, second[inner] // 4
    centroid = points[tetrahedra].mean(axis=1)
    distance = np.linalg.norm(centroid[a] - centroid[b], axis=1)
    size = (len(tetrahedra), len(tetrahedra))
    return coo_array((np.r_[distance, distance], (np.r_[a, b], np.r_[b, a])), shape=size).tocsr()


def partition(points: np.ndarray, tetrahedra: np.ndarray, volume: np.ndarray, count: int) -> np.ndarray:
    """Region 0 … count − 1 of each of `tetrahedra` (k, 4), `volume` (k,) [m³], balanced by volume, (k,).

    Raises MassSpringError when the mesh cannot be cut into so many connected regions.
    """
    if not 1 <= count <= len(tetrahedra):
        raise MassSpringError(f"{count} regions asked of {len(tetrahedra)} tetrahedra; give 1 to {len(tetrahedra)}")
    return _cut(cell_graph(points, tetrahedra), volume, count)


def node_patches(points: np.ndarray, tetrahedra: np.ndarray, size: int) -> np.ndarray:
    """Patch of each of the n nodes at `points`, joined by the edges of `tetrahedra` (k, 4): connected patches of about
    `size` nodes, (n,). Raises MassSpringError."""
    ends = np.unique(np.sort(tetrahedra[:, EDGES_OF_TETRAHEDRON].reshape(-1, 2).astype(np.int64), axis=1), axis=0)
    length = np.linalg.norm(points[ends[:, 0]] - points[ends[:, 1]], axis=1)
    both = np.r_[ends[:, 0], ends[:, 1]], np.r_[ends[:, 1], ends[:, 0]]
    graph = coo_array((np.r_[length, length], both), shape=(len(points), len(points))).tocsr()
    return _cut(graph, np.ones(len(points)), -(-len(points) // size))


def _cut(graph: csr_array, weight: np.ndarray, count: int) -> np.ndarray:
    """Part 0 … count − 1 of each member of a graph of distances, balanced by `weight`, each part connected."""
    pieces, _ = connected_components(graph, directed=False)
    if pieces > 1:
        raise MassSpringError(f"the mesh has {pieces} separate pieces; cut one connected body into regions")
    part = np.zeros(len(weight), dtype=np.int64)
    waiting = [(np.arange(len(weight)), 0, count)]
    while waiting:
        members, first, parts = waiting.pop()
        part[members] = first
        if parts > 1:
            left = _near_half(graph[members][:, members], weight[members], (parts // 2) / parts)
            if min(left.sum(), (~left).sum()) < parts // 2:
                raise MassSpringError(
                    f"the mesh is too coarse for {count} connected regions; ask for fewer or refine it"
                )
            waiting.append((members[left], first, parts // 2))
            waiting.append((members[~left], first + parts // 2, parts - parts // 2))
    return part


def _near_half(graph: csr_array, volume: np.ndarray, share: float) -> np.ndarray:
    """Which cells of a connected graph lie nearer to one end, so that they hold about `share` of the volume."""
    far_from_any = int(np.argmax(dijkstra(graph, indices=0)))
    from_a = dijkstra(graph, indices=far_from_any)
    from_b = dijkstra(graph, indices=int(np.argmax(from_a)))
    value = from_a - from_b
    order = np.argsort(value, kind="stable")
    filled = np.cumsum(volume[order]) / volume.sum()
    cuts = np.flatnonzero(np.diff(value[order]) > TIE * from_a.max())  # between two groups of equal values
    left = np.zeros(len(volume), dtype=bool)
    if len(cuts):
        left[order[: cuts[np.argmin(np.abs(filled[cuts] - share))] + 1]] = True
    return left
