"""Elastic bodies of linear and quadratic elements, their energy from the definition, and a closed form."""

import numpy as np
from scipy.optimize import brentq

from massspring import Body, Volumes, quadratic_body, tetrahedral_body
from massspring.body.laws import Edges
from massspring.body.points import PointVolumes
from tests.massspring.conftest import SOFT, block
from tests.massspring.quadratic import curved_block, quadratic_block

MU = SOFT.shear_modulus


def linear_solid(cells=(3, 3, 2), **options) -> Body:
    """Linear tetrahedra with one volume per node."""
    body = tetrahedral_body(*block(cells, **options), SOFT, "cotangent")
    return body.keeping(Volumes.nodal(body))


def curved_solid(**options) -> Body:
    """Quadratic tetrahedra with bent sides."""
    return quadratic_body(*curved_block(), SOFT, **options)


def straight_solid(cells=(2, 2, 2), distortion=0.15, **options) -> Body:
    """Quadratic tetrahedra with straight sides."""
    return quadratic_body(*quadratic_block(cells, distortion=distortion), SOFT, **options)


def deformation(body: Body, x: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """F at the points of all elements at `x` (n, 3), (p, 3, 3), and their weights [m³], (p,)."""
    if isinstance(body.kept, PointVolumes):
        return body.kept.deformation(x).reshape(-1, 3, 3), body.kept.weight.ravel()
    edges = Edges(body.rest, body.tetrahedra)
    return np.einsum("kai,kaj->kij", x[body.tetrahedra], edges.gradients()), edges.volumes


def energy_without_volume(body: Body, x: np.ndarray) -> float:
    """∫ mu/2 (|F|² − 3) − mu (J − 1) + b/2 (J − 1)² [J], straight from the definition."""
    f, weight = deformation(body, x)
    j = np.linalg.det(f)
    density = MU / 2 * ((f * f).sum(axis=(1, 2)) - 3) - MU * (j - 1) + body.local_bulk / 2 * (j - 1) ** 2
    return float(weight @ density)


def nodal_energy(body: Body, x: np.ndarray, ratio: float) -> float:
    """The same with K/2 Σ V0_r (V_r/V0_r − 1)²: a pressure for each kept volume."""
    strain = body.kept.measure(x) / body.rest_volumes - 1
    return energy_without_volume(body, x) + 0.5 * ratio * MU * float(body.rest_volumes @ strain**2)


def uniaxial(stretch: float, bulk: float) -> tuple[float, float]:
    """(stretch across, nominal stress [Pa]) of a bar drawn to `stretch` with free sides, W = mu/2 (|F|² − 3) − mu
    (J − 1) + bulk/2 (J − 1)² [Pa].

    Free sides: mu c = (mu − bulk (J − 1)) · a c with the stretch along a, J = a c²; stress mu a − (mu − bulk (J − 1))
    c².
    """
    a = stretch

    def side(c: float) -> float:
        return MU - (MU - bulk * (a * c * c - 1.0)) * a

    c = float(brentq(side, 0.3, 3.0, xtol=1e-15))
    return c, MU * a - (MU - bulk * (a * c * c - 1.0)) * c * c


def stretched(rest: np.ndarray, stretch: float, bulk: float) -> np.ndarray:
    """A body in uniaxial stretch along z."""
    across, _ = uniaxial(stretch, bulk)
    return rest * np.array([across, across, stretch])
