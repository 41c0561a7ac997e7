"""The fast half of the oracle pack, and the pack's own contract. The slow half runs in `python -m studies.lab.verify`;
those of the fast half that take longest are a campaign."""

import numpy as np
import pytest

from reference_fem import exact
from reference_fem.oracles import ORACLES, Check, Curve, manufactured

LONG = ("thick_sphere", "manufactured")
FAST = [
    pytest.param(oracle, id=oracle.name, marks=[pytest.mark.campaign] if oracle.name in LONG else [])
    for oracle in ORACLES
    if oracle.fast
]


@pytest.mark.parametrize("oracle", FAST)
def test_every_number_is_where_it_must_be(oracle):
    outcome = oracle.measure()
    assert outcome.checks
    off = [f"{c.quantity}: {c.got:.8g}, expected {c.expected:.8g}" for c in outcome.checks if not c.met]
    assert not off, "; ".join(off)


def test_oracles_have_names_of_their_own_and_a_source():
    names = [oracle.name for oracle in ORACLES]
    assert len(set(names)) == len(names)
    assert all(oracle.source and oracle.title for oracle in ORACLES)


@pytest.mark.parametrize(("got", "met"), [(1.009, True), (0.991, True), (1.011, False), (np.nan, False)])
def test_a_check_judges_by_the_relative_deviation(got, met):
    assert Check("force", "N", 1.0, got, 0.01, "mesh", 3).met is met
    assert Check("force", "N", -100.0, -100.0 * got, 0.01, "mesh", 3).met is met


@pytest.mark.parametrize(("got", "met"), [(3.1, True), (2.8, False), (np.nan, False)])
def test_a_check_in_units_of_its_quantity(got, met):
    assert Check("order", "1", 3.0, got, 0.15, "mesh", 3, absolute=True).met is met


def test_the_order_of_a_curve_is_its_slope_at_the_fine_end():
    sizes = (0.4, 0.2, 0.1)
    errors = (1.0, 2.0 * 0.2**3, 2.0 * 0.1**3)
    assert Curve("u", "P2/P1", sizes, errors).order == pytest.approx(3.0, abs=1e-12)


def test_the_closed_forms_have_the_published_values():
    """Five digits are published."""
    for ratio, displacement in exact.THICK_CYLINDER.items():
        assert exact.thick_cylinder_displacement(ratio) == pytest.approx(displacement, rel=1e-5)
    for stretch, pressure in ((1.1, 0.287155), (1.25, 0.551869), (1.5, 0.755433)):
        assert exact.thick_sphere_pressure(1.0, 1.0, 2.0, stretch) == pytest.approx(pressure, abs=1e-6)
    assert exact.thick_sphere_pressure(1.0, 1.0, 1.25, 1.5) == pytest.approx(0.275019, abs=1e-6)


def test_the_made_up_motion_is_differentiated_right():
    """F against central differences of the positions, J against 1 + q / kappa."""
    X, kappa = np.random.default_rng(0).uniform(0.0, 1.0, (3, 20)), 7.0
    _, F, q = manufactured.motion(X, kappa)
    for axis, e in enumerate(1e-5 * np.eye(3)[:, :, None]):
        slope = (manufactured.motion(X + e, kappa)[0] - manufactured.motion(X - e, kappa)[0]) / 2e-5
        np.testing.assert_allclose(F[:, :, axis], slope.T, atol=1e-9)
    np.testing.assert_allclose(np.linalg.det(F), 1.0 + q / kappa, rtol=1e-13)
