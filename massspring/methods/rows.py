"""Builds the sparse rows of several volumes: who adds to which entry, once, before a run."""

import numpy as np
from scipy.sparse import csr_array

from massspring.kernels.lanes import LANES
from massspring.kernels.layout import VolumeRows
from massspring.neighbours import aligned
from massspring.volumes import Volumes

DENSE_UP_TO = 64
"""Volumes up to which S is factored densely; beyond it conjugate gradients from the last multipliers are cheaper."""

OPPOSITE = 1e-12
"""Sum of two entries, over the area vectors in them, that is round-off: they are opposite at all positions."""


def volume_rows(volumes: Volumes, nodes: int) -> VolumeRows:
    """The pattern of J for `volumes` on a body of `nodes` nodes, with its scratch arrays."""
    m = volumes.count
    terms = volumes.share.tocsc().sorted_indices()
    triangle = np.repeat(np.arange(len(volumes.triangles)), np.diff(terms.indptr))
    corners = volumes.triangles[triangle].astype(np.int64)
    key = terms.indices.astype(np.int64)[:, None] * nodes + corners
    entries, place = np.unique(key, return_inverse=True)
    row, column = entries // nodes, entries % nodes
    place = place.reshape(-1)
    by_entry = np.argsort(place, kind="stable")
    by_node = np.lexsort((row, column))
    sums = csr_array(
        (np.repeat(terms.data, 3)[by_entry] / 6.0, np.repeat(triangle, 3)[by_entry], _starts(place, len(entries))),
        shape=(len(entries), len(volumes.triangles)),
    )
    summed, twin = _twins(row, column, sums, volumes.triangles, nodes)
    kept = sums[summed]
    dense = m if m <= DENSE_UP_TO else 0
    return VolumeRows(
        triangles=volumes.triangles,
        normal=np.zeros((len(volumes.triangles), 3)),
        summed=summed.astype(np.uint32),
        twin=twin.astype(np.uint32),
        term_start=kept.indptr.astype(np.uint32),
        term_triangle=kept.indices.astype(np.uint32),
        term_share=kept.data,
        row_start=_starts(row, m),
        column=column.astype(np.uint32),
        node_start=_starts(column, nodes),
        node_entry=by_node.astype(np.uint32),
        node_row=row[by_node].astype(np.uint32),
        place=np.argsort(by_node).astype(np.uint32),
        value=aligned((len(entries), LANES), np.dtype(np.float64)),
        node_value=aligned((len(entries), LANES), np.dtype(np.float64)),
        matrix=np.zeros((dense, dense)),
        node_vector=aligned((nodes, LANES), np.dtype(np.float64)),
        **{name: np.zeros(m) for name in ("volume", "lam", "right", "diagonal", "search", "image", "allowed")},
    )


def _twins(
    row: np.ndarray, column: np.ndarray, sums: csr_array, triangles: np.ndarray, nodes: int
) -> tuple[np.ndarray, np.ndarray]:
    """Entries to sum, and the entry that is the negative of each (itself where none is), (c,) and (c,).

    The volumes of two nodes inside a body push each other's node with opposite areas: the ring of tetrahedra around
    their edge closes. Entries are polynomials of the positions, so that opposite ones at random positions are opposite
    at all.
    """
    x = np.random.default_rng(0).uniform(-1.0, 1.0, (nodes, 3))
    a, b, c = (x[triangles[:, corner]] for corner in range(3))
    value = sums @ np.cross(b - a, c - a)
    key, mirrored = row * nodes + column, column * nodes + row
    partner = np.minimum(np.searchsorted(key, mirrored), len(key) - 1)
    sizes = abs(sums) @ np.ones(len(triangles))
    opposite = np.abs(value + value[partner]).max(axis=1) <= OPPOSITE * sizes
    found = (key[partner] == mirrored) & (row != column) & opposite
    entry = np.arange(len(key))
    summed = np.flatnonzero(~found | (row < column))
    return summed, np.where(found, partner, entry)[summed]


def _starts(sorted_or_not: np.ndarray, size: int) -> np.ndarray:
    return np.concatenate([[0], np.cumsum(np.bincount(sorted_or_not, minlength=size))]).astype(np.uint32)
