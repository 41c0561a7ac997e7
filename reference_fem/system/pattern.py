"""The sparsity pattern, built once: the slot in the global matrix for each entry of each local matrix.

Only the upper triangle of the free unknowns is kept, plus the columns of held unknowns (they lift a prescribed
increment to the right-hand side). Entries that belong to neither go to one spare slot at the end.
"""

from dataclasses import dataclass

import numpy as np
import scipy.sparse as sp

from reference_fem.compiled import compiled


@dataclass(frozen=True, eq=False)
class Pattern:
    """Fixed pattern for `n` free unknowns of `total`; `values` arrays have `size` entries, the last one spare."""

    free: np.ndarray
    """Global index of each free unknown, (n,)."""
    held: np.ndarray
    """Global index of each held unknown, (m,)."""
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
        count = dofs.shape[1]
        slots = np.empty((len(dofs), count * (count + 1) // 2), dtype=np.uint32)
        rows = (self.indptr, self.indices), (self.lift_indptr, self.lift_indices)
        find_slots(np.ascontiguousarray(self.rank[dofs]), len(self.free), *rows, slots)
        return slots


@compiled()
def find_slots(local: np.ndarray, n: int, upper: tuple, lift: tuple, slots: np.ndarray):
    """Slot of every pair of each row of `local` (k, l), positions as in Pattern.rank, into slots (k, l(l+1)/2).

    upper, lift: (indptr, indices) of the two parts. Each pair is searched in its row.
    """
    for k in range(local.shape[0]):
        slot = 0
        for a in range(local.shape[1]):
            for b in range(a, local.shape[1]):
                low, high = min(local[k, a], local[k, b]), max(local[k, a], local[k, b])
                if low >= n:
                    slots[k, slot] = len(upper[1]) + len(lift[1])
                elif high < n:
                    first, last = upper[0][low], upper[0][low + 1]
                    slots[k, slot] = first + np.searchsorted(upper[1][first:last], high)
                else:
                    first, last = lift[0][low], lift[0][low + 1]
                    slots[k, slot] = len(upper[1]) + first + np.searchsorted(lift[1][first:last], high - n)
                slot += 1


def build_pattern(dofs: np.ndarray, held_mask: np.ndarray, *more: np.ndarray) -> Pattern:
    """Pattern of all element matrices on dofs (ne, l), and on more such tables; held_mask (total,) marks prescribed
    unknowns.

    With E (ne, total), 1 where an element has an unknown, EᵀE is not zero where two unknowns share an element.
    """
    free, held = np.flatnonzero(~held_mask), np.flatnonzero(held_mask)
    n, m = len(free), len(held)
    rank = np.empty(len(held_mask), dtype=np.int32)
    rank[free], rank[held] = np.arange(n), n + np.arange(m)
    tables = [dofs, *more]
    widths = np.concatenate([np.full(*table.shape) for table in tables])
    starts, members = np.concatenate([[0], np.cumsum(widths)]), np.concatenate([rank[t].ravel() for t in tables])
    members = sp.csr_matrix((np.ones(len(members), dtype=np.int32), members, starts), shape=(len(widths), n + m))
    shared = (members.T[:n] @ members).tocsr()
    upper, lift = sp.csr_matrix(sp.triu(shared[:, :n])), sp.csr_matrix(shared[:, n:])
    upper.sort_indices()
    lift.sort_indices()
    return Pattern(free, held, rank, upper.indptr, upper.indices, lift.indptr, lift.indices)
