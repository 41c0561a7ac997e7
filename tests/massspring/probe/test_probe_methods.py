"""Thin probes with the relatives of HCJ05 and with known pressures: what is promised of a probe holds for each."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings

from massspring import METHODS, ImplicitVolume, Probe, Setup, simulate
from massspring.kernels.probe.arrays import COMPARED, IN_CONTACT
from tests.massspring.conftest import SOFT
from tests.massspring.methods.test_methods import clock_for, thrown
from tests.massspring.probe.test_probe import BALL, R, pressed
from tests.massspring.probe.test_probe_crossing import PATHS, check_crossing, crossing_setup

SOFT_MODULUS = 10_000.0
"""[Pa] of known pressures: stiff ones would shorten the steps, and with them the way that a probe has."""
MODULUS = {"penalty": "bulk_modulus", "pyramid": "bulk_modulus", "pressure": "ambient"}
MEETING = [
    m(**({MODULUS[m.name]: SOFT_MODULUS} if m.name in MODULUS else {}))
    for m in METHODS
    if m.capabilities.thin_probes and m.name not in ("free", "implicit_volume")
]
"""Those two have tests of their own."""
EACH = pytest.mark.parametrize("method", MEETING, ids=lambda m: m.name)
WAYS = {name: way for name, way in PATHS.items() if name != "method"}


def test_every_method_that_keeps_one_volume_by_one_pressure_and_one_motion_meets_probes():
    names = {method.name for method in MEETING}
    assert names == {"shake", "projection", "baumgarte", "penalty", "pressure", "pyramid"}


@pytest.mark.parametrize(
    "method",
    [
        # One that moves nodes by a multiplier, one that pushes them by a pressure; the others share their steps.
        pytest.param(m, id=m.name, marks=() if m.name in ("shake", "penalty") else pytest.mark.campaign)
        for m in MEETING
    ],
)
@settings(max_examples=6, deadline=None, derandomize=True)
@given(**WAYS)
def test_no_path_and_no_speed_lets_a_probe_through(method, **path):
    state = check_crossing(crossing_setup(**path, method=method), path["share"])[0]
    assert not state.probing.passed.any()


@EACH
def test_sleeping_pairs_and_boxes_change_no_bit(method):
    setup, ends = pressed(method, frames=30, slide=0.02), []
    for skipping in (True, False):
        state = setup.start()
        state = replace(state, probing=state.probing._replace(skipping=skipping))
        for frame in range(setup.clock.frames):
            state = method.advance(state, setup.boundary(frame))
        assert state.probing.counts[IN_CONTACT] > 100, "the probe hardly ever touched"
        ends.append((state.x, state.v, state.lam, state.diagnostics.contact_impulse, state.probing.counts[COMPARED]))
    assert all(np.array_equal(a, b) for a, b in zip(ends[0][:-1], ends[1][:-1], strict=True))
    assert ends[0][-1] < 0.3 * ends[1][-1]


@EACH
def test_a_probe_that_meets_nothing_changes_no_bit(method):
    clock, v = clock_for(BALL, 4, 10), thrown(BALL)
    alone = Setup(BALL, method, clock, velocity=v)
    assert alone.start().probing is None  # the frame is compiled without the stage
    with_probe = replace(alone, obstacles=(Probe((0.5, 0.0, 0.0)),))
    assert np.array_equal(simulate(with_probe).final, simulate(alone).final)


@EACH
def test_the_volume_beside_a_probe_is_what_the_method_claims(method):
    """Kept: to first order in what the contacts move, nothing adds up, and at rest it is exact. Pushed: short by what
    the pressure costs, here with a modulus of which that is more than a step leaves."""
    history = simulate(pressed(method, frames=150))
    wrong = history.volume[:, 0] / BALL.volume - 1.0
    if method.name in ("shake", "projection", "baumgarte"):
        assert np.abs(wrong).max() < 1e-4
        assert abs(wrong[-1]) < 1e-6
    else:
        assert wrong[-1] < -1e-5
        # The gas: lam = p0 (V0/V − 1), the others lam = K (1 − V/V0).
        lost = -wrong[-1] / (1.0 + wrong[-1]) if method.name == "pressure" else -wrong[-1]
        assert lost == pytest.approx(history.pressure[-1, 0] / SOFT_MODULUS, rel=1e-3)


@EACH
def test_forces_balance_nothing_pulls_and_they_are_those_of_hcj05(method):
    """Pushed in as far, a body answers as HCJ05 has it: exactly where the volume is kept, else but for its shortage."""
    history = simulate(pressed(method, frames=150))
    contact, reaction = history.contact_force[-1, 0], history.held_force[-1, 0]
    assert np.abs(contact + reaction).max() < 2e-3 * np.abs(contact).max()  # what of the motion is left by then
    assert (history.contact_force[:, 0, 2] <= 0).all()
    assert contact[2] < -1e-4 * SOFT.shear_modulus * R**2
    other = simulate(pressed(ImplicitVolume(), frames=150)).contact_force[-1, 0]
    assert np.abs(contact - other).max() < (1e-3 if method.volume_tol else 0.05) * np.abs(other).max()
