"""Splits closed chains of edges into quadrangles, so that the area of a ring takes half as many products as it has
nodes."""

import numpy as np
from scipy.sparse import coo_array, csr_array


def edge_chains(shares: csr_array, triangles: np.ndarray) -> tuple[csr_array, np.ndarray]:
    """The boundaries of sums of triangles `shares` (c, f): how often each edge is passed from its lower to its higher
    node, (c, E), and the edges (E, 2).

    An edge that two triangles share is passed both ways and cancels, so the chain of a node of a closed volume is a
    ring."""
    walked = triangles.astype(np.int64)[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2)
    edges, edge = np.unique(np.sort(walked, axis=1), axis=0, return_inverse=True)
    sense = np.where(walked[:, 0] < walked[:, 1], 1.0, -1.0)
    face = np.repeat(np.arange(len(triangles)), 3)
    around = coo_array((sense, (face, edge.reshape(-1))), shape=(len(triangles), len(edges)))
    chains = csr_array(shares @ around.tocsr())
    chains.eliminate_zeros()
    return chains, edges


def quadrangles(chains: csr_array, edges: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Each closed chain (eq. 8.6) as (row of each quadrangle, ascending, its corners (q, 4), its share), (q,) each.

    Quadrangles are fans about the lowest node o of the chain: two successive edges u → v → w give (o, u, v, w), a
    single edge (o, u, v, o). Edges at o contribute nothing.
    """
    walked = chains.tocoo()
    forward = walked.data > 0
    row, share = walked.row.astype(np.int64), np.abs(walked.data)
    tail, head = (edges[walked.col, np.where(forward, end, 1 - end)] for end in (0, 1))
    low = np.full(chains.shape[0], np.iinfo(np.int64).max)  # pyright: ignore[reportOptionalSubscript]
    np.minimum.at(low, row, tail)
    away = (tail != low[row]) & (head != low[row])
    row, tail, head, share = row[away], tail[away], head[away], share[away]
    first, second = _in_twos(_followers(row, tail, head, share), row)
    end = np.where(second >= 0, head[second], low[row[first]])
    corner = np.column_stack([low[row[first]], tail[first], head[first], end])
    order = np.argsort(row[first], kind="stable")
    return row[first][order], corner[order].astype(np.uint32), share[first][order]


def _followers(row: np.ndarray, tail: np.ndarray, head: np.ndarray, share: np.ndarray) -> np.ndarray:
    """For each edge the one that continues it, in the same row and with the same share; -1 for none. No edge continues
    two."""
    nodes = int(max(tail.max(initial=0), head.max(initial=0))) + 1
    leaving, arriving = row * nodes + tail, row * nodes + head
    by_tail = np.argsort(leaving, kind="stable")
    place = np.searchsorted(leaving[by_tail], arriving) + _rank(arriving)
    follower = by_tail[np.minimum(place, len(by_tail) - 1)] if len(by_tail) else by_tail
    follows = (place < len(by_tail)) & (leaving[follower] == arriving) & (share[follower] == share)
    return np.where(follows, follower, -1)


def _rank(key: np.ndarray) -> np.ndarray:
    """How many equal keys come before each."""
    order = np.argsort(key, kind="stable")
    rank = np.empty(len(key), dtype=np.int64)
    rank[order] = np.arange(len(key)) - np.searchsorted(key[order], key[order])
    return rank


def _in_twos(after: np.ndarray, row: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """All edges, each once, in pairs of an edge and its successor (-1 if none is left)."""
    seen, firsts, seconds = np.zeros(len(after), dtype=bool), [], []
    begins = np.ones(len(after), dtype=bool)
    begins[after[after >= 0]] = False
    now = np.flatnonzero(begins)
    while not seen.all():
        while len(now):
            seen[now] = True
            second = np.where((after[now] >= 0) & ~seen[after[now]], after[now], -1)
            seen[second[second >= 0]] = True
            firsts.append(now)
            seconds.append(second)
            now = after[second[second >= 0]]
            now = now[now >= 0]
            now = now[~seen[now]]
        # The remaining edges form closed loops: one loop of each row at a time.
        rest = np.flatnonzero(~seen)
        now = rest[np.unique(row[rest], return_index=True)[1]]
    none = np.zeros(0, dtype=np.int64)
    return np.concatenate([none, *firsts]), np.concatenate([none, *seconds])
