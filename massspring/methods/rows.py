"""Builds the sparse rows of several volumes: who adds to which entry, once, before a run."""

import numpy as np

from massspring.kernels.layout import VolumeRows
from massspring.volumes import Volumes

DENSE_UP_TO = 64
"""Volumes up to which S is factored densely; beyond it conjugate gradients from the last multipliers are cheaper."""


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
    dense = m if m <= DENSE_UP_TO else 0
    return VolumeRows(
        triangles=volumes.triangles,
        normal=np.zeros((len(volumes.triangles), 3)),
        term_start=_starts(place, len(entries)),
        term_triangle=np.repeat(triangle, 3)[by_entry].astype(np.uint32),
        term_share=np.repeat(terms.data, 3)[by_entry] / 6.0,
        row_start=_starts(row, m),
        column=column.astype(np.uint32),
        node_start=_starts(column, nodes),
        node_entry=by_node.astype(np.uint32),
        node_row=row[by_node].astype(np.uint32),
        value=np.zeros((len(entries), 3)),
        matrix=np.zeros((dense, dense)),
        node_vector=np.zeros((nodes, 3)),
        **{name: np.zeros(m) for name in ("volume", "lam", "right", "diagonal", "search", "image", "allowed")},
    )


def _starts(sorted_or_not: np.ndarray, size: int) -> np.ndarray:
    return np.concatenate([[0], np.cumsum(np.bincount(sorted_or_not, minlength=size))]).astype(np.uint32)
