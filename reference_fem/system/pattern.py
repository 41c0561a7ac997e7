"""The sparsity pattern, found once: where each entry of each small matrix goes in the big one.

Only the upper triangle of the free unknowns is kept, plus the columns of held unknowns (they lift a prescribed
increment to the right-hand side). Entries that belong to neither go to one spare slot at the end.
"""

from dataclasses import dataclass

import numpy as np
import scipy.sparse as sp


@dataclass(frozen=True, eq=False)
class Pattern:
    """Fixed pattern for `n` free unknowns of `total`; `values` arrays have `size` entries, the last one spare."""

    free: np.ndarray
    """Global index of each free unknown, (n,)."""
    held: np.ndarray
    """Global index of each held unknown, (m,)."""
    keys: np.ndarray
    """Sorted key of every slot."""
    rank: np.ndarray
    """Position of every unknown in `free`, or n + its position in `held`, (total,)."""
    indptr: np.ndarray
    indices: np.ndarray
    lift_indptr: np.ndarray
    lift_indices: np.ndarray

    @property
    def size(self):
        """Entries of a `values` array."""
        return len(self.indices) + len(self.lift_indices) + 1

    def upper(self, values: np.ndarray):
        """Upper triangle of the tangent, CSR (n, n), sharing memory with values."""
        n, count = len(self.free), len(self.indices)
        return sp.csr_matrix((values[:count], self.indices, self.indptr), shape=(n, n), copy=False)

    def lifting(self, values: np.ndarray):
        """Coupling of free rows with held columns, CSR (n, m)."""
        first, shape = len(self.indices), (len(self.free), len(self.held))
        return sp.csr_matrix((values[first:-1], self.lift_indices, self.lift_indptr), shape=shape, copy=False)

    def positions(self, dofs: np.ndarray):
        """Slots of the packed upper triangles (row by row) of the local matrices on dofs (k, l): (k, l(l+1)/2)."""
        keys = pair_keys(self.rank, len(self.free), len(self.held), dofs)
        slots = np.searchsorted(self.keys, keys)
        return np.minimum(slots, self.size - 1).astype(np.uint32)


def pair_keys(rank: np.ndarray, n: int, m: int, dofs: np.ndarray):
    """One sortable number per local pair: free-free pairs first, row by row, then free-held, then the rest."""
    rows, cols = np.triu_indices(dofs.shape[1])
    a, b = rank[dofs[:, rows]], rank[dofs[:, cols]]
    low, high = np.minimum(a, b), np.maximum(a, b)
    keys = low * n + high
    lift = high >= n
    keys[lift] = n * n + low[lift] * m + (high[lift] - n)
    keys[low >= n] = n * n + n * m
    return keys


def build_pattern(dofs: np.ndarray, held_mask: np.ndarray) -> Pattern:
    """Pattern of all element matrices on dofs (ne, l); held_mask (total,) marks prescribed unknowns."""
    free, held = np.flatnonzero(~held_mask), np.flatnonzero(held_mask)
    n, m = len(free), len(held)
    rank = np.empty(len(held_mask), dtype=np.int64)
    rank[free], rank[held] = np.arange(n), n + np.arange(m)
    chunks = [np.unique(pair_keys(rank, n, m, part)) for part in np.array_split(dofs, 1 + len(dofs) // 2000)]
    keys = np.unique(np.concatenate(chunks))
    keys = keys[keys < n * n + n * m]
    own, lift = keys[keys < n * n], keys[keys >= n * n] - n * n
    width = max(m, 1)
    return Pattern(
        free, held, keys, rank,
        row_starts(own // n, n), (own % n).astype(np.int32),
        row_starts(lift // width, n), (lift % width).astype(np.int32),
    )  # fmt: skip


def row_starts(rows: np.ndarray, n: int):
    """CSR indptr from sorted row numbers."""
    return np.searchsorted(rows, np.arange(n + 1)).astype(np.int32)
