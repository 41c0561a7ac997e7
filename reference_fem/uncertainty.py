"""Uncertainty of a number: the share of the mesh from a family of three meshes, other shares from one change of a
setting.

The mesh: grid convergence index of Roache (J. Fluids Eng. 116, 1994) in the form of Celik et al. (J. Fluids Eng. 130,
078001, 2008), for any ratio of sizes and for fields as well as numbers. The functions take plain arrays and need no
mesh or solver.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from scipy.optimize import nnls, root_scalar

from reference_fem.errors import SolveError

SAFETY, TWO_MESHES = 1.25, 3.0
"""Factors on the extrapolated error: SAFETY for three meshes, TWO_MESHES for two, whose order is assumed (Roache)."""
NESTED_SAFETY, NESTED_TWO = 1.1, 1.4
"""The same for nested meshes: calibrated so that 95 of 100 errors of the stored sequences are inside (docs/theory.md,
section 6)."""
UNCONFIRMED = 2.0
"""The factor for three meshes that converge faster than any plausible order: errors of opposite sign may cancel in the
finest two. The clamped ball was 1.3 times farther off than SAFETY would allow (docs, section 6)."""
SCATTER = 2.0
"""Factor on the spread of values that oscillate: the range of three is on average 1.7 of their standard deviation,
and the finest may be off by two of these."""
SLOWEST, FASTEST = 1.0, 3.0
"""Range of plausible orders in the element size; 3 is that of the displacement of quadratic elements."""
NESTED_RATE = 2.0 / 3.0
"""Assumed power of the number of unknowns with which the error of nested, adaptively bisected meshes falls. In theory
it is 1 if outlines of held regions dominate, else 4/3. A rate cannot be observed from three values, which depend too
much on the marking of single steps (docs/theory.md, section 6)."""
Range = tuple[float, float]
"""Slowest and fastest plausible order."""
BELIEVED: Range = (SLOWEST, FASTEST)
ORDERS = 81
"""Orders tried for a field, at most 0.025 apart: the error bar then changes by under 1 % from one to the next."""
ALIKE = 0.5
"""Cosine of two changes of a series above which they count as having the same direction; for a single error term it is
1."""


@dataclass(frozen=True)
class MeshError:
    """The error of the finest of three meshes, in the unit of the values."""

    uncertainty: float
    """Uncertainty of the finest value."""
    shift: float
    """Extrapolated minus finest value, for fields the norm of this; 0 if extrapolation is not possible."""
    order: float
    """Observed order, limited to the plausible range; NaN if the values oscillate, and the spread is used."""

    @property
    def monotone(self) -> bool:
        """Whether the values approach a limit from one side."""
        return self.order == self.order


def nested_error(unknowns: Sequence[float], changes: Sequence[float]) -> float:
    """Error of the finest of two or three nested meshes, fine to coarse, in the unit of the changes.

    unknowns: n1 > n2 (> n3); changes: |f2 − f1| (and |f3 − f1|), of numbers or norms of fields. The larger of
    NESTED_SAFETY |fi − f1|/((n1/ni)^NESTED_RATE − 1): a change that is small by chance does not make the bar small. Two
    meshes: NESTED_TWO. Raises SolveError for unknowns that do not fall, and changes that are not finite.
    """
    if len(unknowns) not in (2, 3) or len(changes) != len(unknowns) - 1 or not np.isfinite(changes).all():
        raise SolveError("an error bar needs two or three solved meshes, fine to coarse")
    if not all(fine > coarse for fine, coarse in pairwise(unknowns)):
        raise SolveError(f"nested meshes have {', '.join(f'{n:g}' for n in unknowns)} unknowns, which do not fall")
    safety = NESTED_SAFETY if len(unknowns) == 3 else NESTED_TWO
    ratios = [unknowns[0] / coarse for coarse in unknowns[1:]]
    pairs = zip(changes, ratios, strict=True)
    return max(safety * abs(change) / (ratio**NESTED_RATE - 1.0) for change, ratio in pairs)


def observed_order(
    sizes: Sequence[float], coarse_change: float, fine_change: float, believed: Range = BELIEVED
) -> float:
    """Order p of |f − f_h| ~ h^p from the sizes h1 < h2 < h3 and |f3 − f2|, |f2 − f1|, within the range `believed`.

    With r = h2/h1, R = h3/h2 the changes are in the ratio r^p (R^p − 1)/(r^p − 1), which grows with p.
    Raises SolveError unless there are three different sizes.
    """
    r, R = _ratios(sizes)
    slowest, fastest = believed

    def miss(p: float) -> float:
        return np.log(r**p * (R**p - 1) / (r**p - 1)) - np.log(coarse_change / fine_change)

    if fine_change == 0.0:
        return fastest
    if coarse_change == 0.0 or miss(slowest) >= 0:
        return slowest
    return fastest if miss(fastest) <= 0 else float(root_scalar(miss, bracket=believed, xtol=1e-12).root)


def mesh_error(sizes: Sequence[float], values: Sequence, believed: Range = BELIEVED) -> MeshError:
    """Error of the finest of two or three values of a number, or of a series of them (n,), fine to coarse.

    sizes: h1 < h2 (< h3) [m]; believed: range of orders. For changes in the same direction: the grid convergence index
    SAFETY |f2 − f1|/(r^p − 1). Otherwise SCATTER times the spread, the largest difference of two. A fine change that is
    small by chance does not make the error bar small: |f3 − f1|/((rR)^p − 1), R = h3/h2, is used if it is larger, as
    for an order faster than plausible. Two values: the slowest order, safety TWO_MESHES. Raises SolveError for sizes
    that do not grow, and values that are not finite.
    """
    values = _finite(values)
    near, ratios = values[1] - values[0], _ratios(sizes)
    change, sign = _norm(near), -float(np.sign(near[0])) if near.size == 1 else 1.0
    if len(values) == 2:
        shift = change / (ratios[0] ** believed[0] - 1)
        return MeshError(TWO_MESHES * shift, sign * shift, believed[0])
    far = values[2] - values[1]
    if _dot(near, far) < ALIKE * change * _norm(far):
        return MeshError(SCATTER * max(change, _norm(far), _norm(values[2] - values[0])), 0.0, float("nan"))
    order = observed_order(sizes, _norm(far), change, believed)
    shift = change / (ratios[0] ** order - 1)
    whole = _norm(values[2] - values[0]) / ((ratios[0] * ratios[1]) ** order - 1)
    return MeshError(_safety(order, believed) * max(shift, whole), sign * shift, order)


def field_error(sizes: Sequence[float], values: Sequence, weights: np.ndarray, believed: Range = BELIEVED) -> MeshError:
    """Error of the finest of two or three fields (n, c) at the same n points of weight (n,), fine to coarse.

    Over hundreds of points two parts can be separated: f_i = f + a h_i^p + b_i, where a is the same field on every
    mesh and b_i, of size b h_i^p, depends on the random positions of the elements of mesh i. Then, with squares of
    norms,

        |f2 − f1|² = a² (h2^p − h1^p)² + b² (h1^2p + h2^2p), |f3 − f2|² alike,
        (f2 − f1)·(f3 − f2) = a² (h2^p − h1^p) (h3^p − h2^p) − b² h2^2p,

    three equations for p, a², b², solved by least squares with p in `believed` and a², b² >= 0. The error
    is SAFETY √(a² + b²) h1^p; without b this is the grid convergence index. Fields that do not converge get SCATTER
    times the spread. The shift is the size of the part that could be extrapolated. Two fields: as mesh_error. Raises
    SolveError for sizes that do not grow, and values that are not finite.
    """
    root = np.sqrt(weights)[:, None]
    scaled = [(value * root).ravel() for value in _finite(values)]
    ratios = _ratios(sizes)
    if len(scaled) == 2:
        return mesh_error(sizes, scaled, believed)
    near, far = scaled[1] - scaled[0], scaled[2] - scaled[1]
    products = np.array([_dot(near, near), _dot(far, far), _dot(near, far)])
    if products[0] >= products[1]:
        return MeshError(SCATTER * max(_norm(near), _norm(far), _norm(scaled[2] - scaled[0])), 0.0, float("nan"))
    fits = [(*_parts(order, ratios, products), order) for order in np.linspace(*believed, ORDERS)]
    _, (common, own), order = min(fits, key=lambda fit: fit[0])
    safety = _safety(float(order), believed)
    return MeshError(safety * float(np.sqrt(common + own)), float(np.sqrt(common)), float(order))


def _safety(order: float, believed: Range) -> float:
    """Factor on an extrapolated error: UNCONFIRMED if its order is the fastest in `believed`."""
    return SAFETY if order < believed[1] else UNCONFIRMED


def _parts(order: float, ratios: Sequence[float], products: np.ndarray) -> tuple[float, np.ndarray]:
    """Misfit of the three equations of field_error for one order, and their (a² h1^2p, b² h1^2p)."""
    middle, coarse = ratios[0] ** order, (ratios[0] * ratios[1]) ** order
    rows = np.array(
        [
            [(middle - 1) ** 2, 1 + middle**2],
            [(coarse - middle) ** 2, middle**2 + coarse**2],
            [(middle - 1) * (coarse - middle), -(middle**2)],
        ]
    )
    # Each equation is weighted by its accuracy, which is relative to the two changes that it compares.
    scale = np.array([products[0], products[1], np.sqrt(products[0] * products[1])])
    parts, misfit = nnls(rows / scale[:, None], products / scale)
    return float(misfit), parts


def setting_error(change: float, factor: float) -> float:
    """Error left by a setting that was made `factor` times better, of order one in it: |change|/(1 − 1/factor).

    Holds for the errors by the contact penalty and the bulk modulus, both ~ 1/setting, and is an upper bound for that
    by load steps. Raises SolveError for a factor that is not above 1.
    """
    if not factor > 1:
        raise SolveError(f"a setting made {factor} times better tells nothing: the factor must be above 1")
    return abs(change) / (1 - 1 / factor)


def combined(shares: Mapping[str, float]) -> float:
    """One number from independent shares: the root of the sum of their squares."""
    return float(np.sqrt(sum(share**2 for share in shares.values())))


def _finite(values: Sequence) -> list[np.ndarray]:
    arrays = [np.atleast_1d(np.asarray(value, dtype=float)) for value in values]
    if not all(np.isfinite(array).all() for array in arrays):
        raise SolveError("the values of a family of meshes are not finite: one of its solutions broke off")
    return arrays


def _ratios(sizes: Sequence[float]) -> tuple[float, ...]:
    if len(sizes) not in (2, 3) or not (sizes[0] > 0 and all(a < b for a, b in pairwise(sizes))):
        raise SolveError(
            "an error bar needs two or three meshes of different size, fine to coarse; these have element sizes "
            f"{', '.join(f'{size:.3g}' for size in sizes)} m"
        )
    return tuple(b / a for a, b in pairwise(sizes))


def _dot(a: np.ndarray, b: np.ndarray) -> float:
    return float(np.vdot(a, b))


def _norm(a: np.ndarray) -> float:
    return float(np.linalg.norm(a))
