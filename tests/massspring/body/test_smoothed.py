"""Smoothed springs hold the energy of the smoothed deformation, and are softer than those of linear elements."""

import numpy as np
import pytest

from massspring import Volumes, tetrahedral_body
from massspring.body.laws import Edges
from massspring.body.smoothed import FACES, SMOOTHED
from massspring.body.springs import EDGES_OF_TETRAHEDRON
from tests.massspring.conftest import SOFT, block

SIDES = {"edge_smoothed": EDGES_OF_TETRAHEDRON, "face_smoothed": FACES}


@pytest.fixture(params=SMOOTHED)
def law(request):
    return request.param


def body_of(law):
    body = tetrahedral_body(*block((3, 2, 2)), SOFT, law)
    return body.keeping(Volumes.nodal(body))


def energy(body, x):
    """½ Σ k |x_i − x_j|² [J]."""
    across = x[body.springs.ends[:, 0]] - x[body.springs.ends[:, 1]]
    return 0.5 * body.springs.stiffness @ (across**2).sum(axis=1)


def smoothed_energy(body, x, sides):
    """½ mu Σ_s V_s |F̃_s|² [J], domain after domain."""
    edges = Edges(body.rest, body.tetrahedra)
    f = np.einsum("tai,taj->tij", x[body.tetrahedra], edges.gradients())
    share, domains = edges.volumes / len(sides), {}
    for t, cell in enumerate(body.tetrahedra):
        for side in sides:
            domains.setdefault(tuple(sorted(cell[side])), []).append(t)
    total = 0.0
    for cells in domains.values():
        volume = share[cells].sum()
        mean = np.einsum("t,tij->ij", share[cells], f[cells]) / volume
        total += 0.5 * SOFT.shear_modulus * volume * (mean**2).sum()
    return total


def moved(body):
    return body.rest + 0.1 * body.size * np.random.default_rng(4).normal(size=body.rest.shape)


def test_the_springs_hold_the_smoothed_energy(law):
    body = body_of(law)
    assert energy(body, moved(body)) == pytest.approx(smoothed_energy(body, moved(body), SIDES[law]), rel=1e-12)


def test_uniform_stretch_has_the_energy_of_the_solid(law):
    body, f = body_of(law), np.array([[1.2, 0.1, 0.0], [0.0, 0.9, 0.3], [0.1, 0.0, 1.1]])
    whole = 0.5 * SOFT.shear_modulus * body.volume * (f**2).sum()
    assert energy(body, body.rest @ f.T) == pytest.approx(whole, rel=1e-12)


def test_smoothing_softens(law):
    x = moved(body_of(law))
    assert 0.1 < energy(body_of(law), x) / energy(body_of("cotangent"), x) < 0.95


def test_springs_join_more_than_edges(law):
    edges = {tuple(pair) for pair in np.sort(body_of("cotangent").springs.ends, axis=1).tolist()}
    pairs = {tuple(pair) for pair in np.sort(body_of(law).springs.ends, axis=1).tolist()}
    assert edges < pairs
