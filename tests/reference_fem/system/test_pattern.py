"""Where the entries of small matrices go in the big one: against dense matrices and another order of the work."""

import numpy as np
import pytest
from skfem import MeshTet

from reference_fem.elements.shapes import build_elements
from reference_fem.system.pattern import build_pattern


@pytest.fixture
def dofs():
    """Unknowns of the elements of a small cube, (ne, l)."""
    return build_elements(MeshTet().refined(2), 4).dofs


def with_held(dofs, share):
    held = np.random.default_rng(3).random(int(dofs.max()) + 1) < share
    return build_pattern(dofs, held), held


@pytest.mark.parametrize("share", [0.0, 0.3])
def test_it_has_the_entries_of_a_dense_matrix(dofs, share):
    pattern, held = with_held(dofs, share)
    dense = np.zeros((len(held), len(held)), dtype=bool)
    for row in dofs:
        dense[np.ix_(row, row)] = True
    ones = np.ones(pattern.size)
    assert np.array_equal(pattern.upper(ones).toarray() > 0, np.triu(dense[~held][:, ~held]))
    assert np.array_equal(pattern.lifting(ones).toarray() > 0, dense[~held][:, held])


@pytest.mark.parametrize("share", [0.0, 0.3])
def test_small_matrices_add_up_to_the_dense_one(dofs, share):
    pattern, held = with_held(dofs, share)
    width, dense, values = dofs.shape[1], np.zeros((len(held), len(held))), np.zeros(pattern.size)
    rows, columns = np.triu_indices(width)
    for row, slots in zip(dofs, pattern.positions(dofs), strict=True):
        K = np.random.default_rng(int(row.sum())).integers(1, 9, (width, width)).astype(float)
        K += K.T
        dense[np.ix_(row, row)] += K
        np.add.at(values, slots, K[rows, columns])
    free = ~held
    assert np.array_equal(pattern.upper(values).toarray(), np.triu(dense[free][:, free]))
    assert np.array_equal(pattern.lifting(values).toarray(), dense[free][:, held])
