"""How far a number may be from the truth: the share of the mesh from a family of three, other shares from one change.

The mesh: grid convergence index of Roache (J. Fluids Eng. 116, 1994) as Celik et al. (J. Fluids Eng. 130, 078001,
2008) write it down, for sizes of any ratio and for fields as well as numbers. Plain arrays, no mesh, no solver.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from scipy.optimize import root_scalar

from reference_fem.errors import ReferenceProblem

SAFETY, TWO_MESHES = 1.25, 3.0
"""Factors on the extrapolated error, of three meshes and of two, whose order is a guess (Roache)."""
SCATTER = 2.0
"""Factor on the spread of values that go to and fro: the range of three is on average 1.7 of their standard deviation,
and the finest may be two of these off."""
SLOWEST, FASTEST = 1.0, 3.0
"""Range of orders that are believed: where a held patch ends the stress is singular, which leaves order 1 in the force
(energy) however small the elements; 3 is the order of the displacement of quadratic elements."""
ALIKE = 0.5
"""Cosine of two changes above which they count as the same way: noise of the meshes has 0, one mode of error 1."""


@dataclass(frozen=True)
class MeshError:
    """What three meshes say about the finest of them, in the unit of the values."""

    uncertainty: float
    """Of the finest value."""
    shift: float
    """Extrapolated minus finest value, for fields the size of it; 0 where nothing can be extrapolated."""
    order: float
    """Observed, within SLOWEST to FASTEST; NaN where the values go to and fro: the spread then counts."""

    @property
    def monotone(self) -> bool:
        """Whether the values approach a limit from one side."""
        return self.order == self.order


def cell_size(volume: float, cells: int) -> float:
    """Representative size (V/n)^(1/3) [m] of a mesh of `cells` elements, graded or not (Celik et al., eq. 1)."""
    return float(np.cbrt(volume / cells))


def observed_order(sizes: Sequence[float], coarse_change: float, fine_change: float) -> float:
    """Order p of |f − f_h| ~ h^p from the sizes h1 < h2 < h3 and |f3 − f2|, |f2 − f1|, within SLOWEST to FASTEST.

    With r = h2/h1, R = h3/h2 the changes are in the ratio r^p (R^p − 1)/(r^p − 1), which grows with p.
    Raises ReferenceProblem for sizes that are not three different ones.
    """
    r, R = _ratios(sizes)

    def miss(p: float) -> float:
        return np.log(r**p * (R**p - 1) / (r**p - 1)) - np.log(coarse_change / fine_change)

    if fine_change == 0.0:
        return FASTEST
    if coarse_change == 0.0 or miss(SLOWEST) >= 0:
        return SLOWEST
    return FASTEST if miss(FASTEST) <= 0 else float(root_scalar(miss, bracket=(SLOWEST, FASTEST), xtol=1e-12).root)


def mesh_error(sizes: Sequence[float], values: Sequence, weights: np.ndarray | None = None) -> MeshError:
    """Error of the finest value of a family of three, sizes and values fine to coarse.

    sizes: h1 < h2 < h3 [m]. values: numbers, or arrays (n,) or (n, c) at the same n points; their size is the root of
    the weighted sum of squares, weights (n,), default 1. The shift of a number has its sign, that of a field is a size.
    Raises ReferenceProblem for sizes that are not three different ones, and values that are not finite.
    """
    fine, middle, coarse = (np.atleast_1d(np.asarray(value, dtype=float)) for value in values)
    if not all(np.isfinite(value).all() for value in (fine, middle, coarse)):
        raise ReferenceProblem("the values of a family of meshes are not finite: one of its solutions broke off")
    near, far, ends = middle - fine, coarse - middle, coarse - fine
    error = changes_error(sizes, [_norm(change, weights) for change in (near, far, ends)], alike(near, far, weights))
    sign = -float(np.sign(near[0])) if near.size == 1 else 1.0
    return MeshError(error.uncertainty, sign * error.shift, error.order)


def alike(near: np.ndarray, far: np.ndarray, weights: np.ndarray | None = None) -> bool:
    """Whether two changes (n,) or (n, c) go the same way, so that they may be the tails of one error."""
    return _dot(near, far, weights) >= ALIKE * _norm(near, weights) * _norm(far, weights)


def changes_error(sizes: Sequence[float], changes: Sequence[float], same_way: bool) -> MeshError:
    """Error of the finest value from the sizes of the changes |f2 − f1|, |f3 − f2|, |f3 − f1| alone.

    Changes that go the same way: the grid convergence index SAFETY |f2 − f1|/(r^p − 1). Otherwise SCATTER times the
    spread, the largest of the three. Two sizes and one change: order SLOWEST, safety TWO_MESHES. The shift has no sign.
    Raises ReferenceProblem for sizes that do not grow.
    """
    if len(sizes) == 2:
        shift = changes[0] / (_ratios(sizes)[0] ** SLOWEST - 1)
        return MeshError(TWO_MESHES * shift, shift, SLOWEST)
    r, _ = _ratios(sizes)
    if not same_way:
        return MeshError(SCATTER * max(changes), 0.0, float("nan"))
    order = observed_order(sizes, changes[1], changes[0])
    shift = changes[0] / (r**order - 1)
    return MeshError(SAFETY * shift, shift, order)


def setting_error(change: float, factor: float) -> float:
    """Error left by a setting that was made `factor` times better, of order one in it: |change|/(1 − 1/factor).

    Holds for what contact's penalty and the bulk modulus leave, both ~ 1/setting, and bounds what load steps leave.
    Raises ReferenceProblem for a factor that makes nothing better.
    """
    if not factor > 1:
        raise ReferenceProblem(f"a setting made {factor} times better tells nothing: the factor must be above 1")
    return abs(change) / (1 - 1 / factor)


def combined(shares: Mapping[str, float]) -> float:
    """One number from independent shares: the root of the sum of their squares."""
    return float(np.sqrt(sum(share**2 for share in shares.values())))


def _ratios(sizes: Sequence[float]) -> tuple[float, ...]:
    if len(sizes) not in (2, 3) or not (sizes[0] > 0 and all(a < b for a, b in pairwise(sizes))):
        raise ReferenceProblem(
            "an error bar needs two or three meshes of different size, fine to coarse; these have element sizes "
            f"{', '.join(f'{size:.3g}' for size in sizes)} m"
        )
    return tuple(b / a for a, b in pairwise(sizes))


def _dot(a: np.ndarray, b: np.ndarray, weights: np.ndarray | None) -> float:
    products = (a * b).reshape(len(a), -1).sum(axis=1)
    return float(products.sum() if weights is None else weights @ products)


def _norm(a: np.ndarray, weights: np.ndarray | None) -> float:
    return float(np.sqrt(_dot(a, a, weights)))
