"""Builds the sparse rows of J for several volumes: which triangles add to which entry, once before a run."""

import numpy as np
from scipy.sparse import csr_array

from massspring.body.volumes import Volumes
from massspring.kernels.arrays.volume_rows import VolumeRows
from massspring.layout.block_jacobi import each_alone
from massspring.layout.ring_areas import edge_chains, quadrangles
from massspring.layout.sell_chunks import aligned

DENSE_UP_TO = 64
"""Volumes up to which S is factored densely; beyond it conjugate gradients from the last multipliers are cheaper."""

OF_EACH_VOLUME = ("volume", "lam", "right", "free_diagonal", "diagonal", "search", "image", "allowed")
"""Arrays with one number per volume, float64 in either precision."""


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
    dense = m if m <= DENSE_UP_TO else 0
    return VolumeRows(
        **_rings(sums, volumes.triangles, np.argsort(by_node)),
        row_start=_starts(row, m),
        column=column.astype(np.uint32),
        node_start=_starts(column, nodes),
        node_entry=by_node.astype(np.uint32),
        node_row=row[by_node].astype(np.uint32),
        value=aligned((len(entries), 4), np.dtype(np.float64)),
        node_value=aligned((len(entries), 4), np.dtype(np.float64)),
        matrix=np.zeros((dense, dense)),
        node_vector=aligned((nodes, 4), np.dtype(np.float64)),
        push=aligned((nodes, 3), np.dtype(np.float64)),
        clusters=each_alone(0 if dense else m),
        **{name: np.zeros(m) for name in OF_EACH_VOLUME},
    )


def _rings(sums: csr_array, triangles: np.ndarray, place: np.ndarray) -> dict[str, np.ndarray]:
    """The quadrangles whose areas sum to each entry of J, and the indices of the entry, by row and by node."""
    chains, edges = edge_chains(sums, triangles)
    chains.sort_indices()
    summed, twin = _twins(chains)
    ring, corner, share = quadrangles(chains[summed], edges)
    sizes = np.bincount(ring, minlength=len(summed))
    # Rings of equal size follow each other, so that the processor predicts the loop lengths.
    order = np.lexsort((sizes, twin != summed))
    rank = np.empty(len(order), dtype=np.int64)
    rank[order] = np.arange(len(order))
    by_order = np.argsort(rank[ring], kind="stable")
    return {
        "target": np.column_stack([summed, place[summed], twin, place[twin]])[order].astype(np.uint32),
        "ring_start": np.concatenate([[0], np.cumsum(sizes[order])]).astype(np.uint32),
        "corner": corner[by_order],
        "corner_share": share[by_order],
    }


def _twins(chains: csr_array) -> tuple[np.ndarray, np.ndarray]:
    """Entries to sum, and the entry that is the negative of each (itself where none is), (c,) and (c,).

    If exactly two volumes meet at a node, they share its ring with opposite orientation. For two nodes inside a body
    the entries of each volume at the other node use the same ring, that around their edge.
    """
    # Any sum over opposite chains differs only in sign, to the last bit, since terms have the same order.
    names = np.random.default_rng(0).normal(size=chains.shape[1])  # pyright: ignore[reportOptionalSubscript]
    sums = np.asarray(chains @ names)
    alike = np.lexsort((sums, np.abs(sums)))
    first, second = np.sort([alike[:-1], alike[1:]], axis=0)
    both = csr_array(chains[first] + chains[second])
    both.eliminate_zeros()
    # Among equal absolute values the negative ones come first, so each gives at most one pair.
    opposite = (np.diff(both.indptr) == 0) & (np.diff(sums[alike]) > 0.0)
    twin = np.arange(len(sums))
    twin[first[opposite]] = second[opposite]
    summed = np.delete(np.arange(len(sums)), second[opposite])
    return summed, twin[summed]


def _starts(sorted_or_not: np.ndarray, size: int) -> np.ndarray:
    return np.concatenate([[0], np.cumsum(np.bincount(sorted_or_not, minlength=size))]).astype(np.uint32)
