"""Every method that meets thin probes: no path and no speed lets one through, forces, volumes, and what is skipped."""

import itertools
import re
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from massspring import METHODS, Attachment, Clock, Free, ImplicitVolume, Plane, Probe, Setup, Trajectory, simulate
from massspring.body.inside import is_inside, surface_distance
from massspring.kernels.probe.arrays import COMPARED, IN_CONTACT, LEFT_BEHIND
from massspring.run.checks import check_probes
from tests.massspring.conftest import SOFT
from tests.massspring.kernels.probe.test_stage import BALL, EDGE, R, frames_of, pressed
from tests.massspring.methods.test_methods import clock_for, thrown


def crossed(before, after, tip_before, tip_after, triangles, margin=1e-3):
    """Triangles that a tip passes in a step, by an independent route: 100 samples in time, all triangles at once.

    `margin`: weights from which on a corner counts; negative: the rim belongs to the triangle.
    """
    begin, end = before[triangles] - tip_before, after[triangles] - tip_after

    def corners(t):
        return (1 - t)[:, None, None] * begin + t[:, None, None] * end

    def volume(t):
        y = corners(t)
        return np.einsum("fi,fi->f", y[:, 0], np.cross(y[:, 1], y[:, 2]))

    passed = np.zeros(len(triangles), dtype=bool)
    times = np.linspace(0.0, 1.0, 101)
    for low, high in itertools.pairwise(times):
        low, high = np.full(len(triangles), low), np.full(len(triangles), high)
        first = volume(low)
        turned = np.flatnonzero(first * volume(high) < 0)
        if not len(turned):
            continue
        for _ in range(40):  # the sample may lie far from the root where the tip crosses the organ within one step
            middle = 0.5 * (low + high)
            same = volume(middle) * first > 0
            low, high = np.where(same, middle, low), np.where(same, high, middle)
        y = corners(high)[turned]
        edge = np.stack([y[:, 1] - y[:, 0], y[:, 2] - y[:, 0]], axis=2)
        share = np.einsum("kij,kj->ki", np.linalg.pinv(edge), -y[:, 0])
        passed[turned] |= (share > margin).all(axis=1) & (share.sum(axis=1) < 1 - margin)
    return np.flatnonzero(passed)


unit = st.tuples(*(st.floats(-1, 1) for _ in range(3))).filter(lambda v: 0.2 < np.linalg.norm(v) <= 1)


PATHS = {
    "side": unit,
    "through": st.tuples(*(st.floats(-0.6, 0.6) for _ in range(3))),
    "start": st.floats(1.1, 1.4),
    "length": st.floats(2.0, 3.5),
    "share": st.sampled_from([0.02, 0.05, 0.3, 1.0]),
    "thickness": st.sampled_from([0.0, 0.05, 0.3]),
    "method": st.sampled_from([Free(), ImplicitVolume()]),
}


def crossing_setup(side, through, start, length, share, thickness, method, held=()):
    """Across the whole ball within one frame of 20 steps, or one fiftieth of it: less than one step."""
    here = start * R * np.array(side) / np.linalg.norm(side)
    way = R * np.array(through) - here
    way *= length * R / np.linalg.norm(way)
    dt = clock_for(BALL, 1, 20).dt
    path = Trajectory((3.3 * dt, 3.3 * dt + share * 20 * dt), ((0, 0, 0), tuple(way)))
    probe = Probe(tuple(here), thickness * EDGE, path)
    attachments = (Attachment(held),) if len(held) else ()
    # A frame a step, so that every step is seen.
    return Setup(BALL, method, Clock(dt, 60, 1), (probe,), attachments, damping=30.0)


def check_crossing(setup, share):
    """After each step the tip lies outside (winding number 0) and no triangle has passed it; two frames on as well.

    Returns the last state, or the first in which the run says that a tip was driven through; up to there all holds.
    """
    probe, dt = setup.probes[0], setup.clock.dt
    x, tip, state = BALL.rest, probe.anchor, setup.start()
    for t, state in frames_of(setup):
        if check_probes(state, setup.obstacles) is not None:
            return state, tip, probe.anchor + probe.path(t), x
        now = probe.anchor + probe.path(t)
        assert np.isfinite(state.x).all()
        assert not is_inside(now, state.x, BALL.triangles)
        if t < (5 + 20 * share) * dt:
            assert len(crossed(x, state.x, tip, now, BALL.triangles)) == 0
        x, tip = state.x, now
    assert state.probing.counts[LEFT_BEHIND] == 0
    assert surface_distance(tip, x, BALL.triangles) > 0.0
    return state, tip, tip, x


def apart(body, most):
    """Nodes of which no two share a triangle."""
    chosen = []
    for i in np.random.default_rng(5).permutation(body.node_count):
        around = np.unique(body.triangles[(body.triangles == i).any(axis=1)])
        if len(chosen) < most and len(around) and not np.isin(chosen, around).any():
            chosen.append(int(i))
    return np.array(chosen)


@pytest.mark.campaign
@settings(max_examples=25, deadline=None, derandomize=True)
@given(**PATHS)
def test_nor_where_single_nodes_are_attached(**path):
    """Every other triangle has an attached corner, none has two. Their free corners go ahead of the tip.

    A tip that meets an attached node head-on has nowhere to push it: the run ends there, as the next test asks.
    """
    held = apart(BALL, 32)
    setup = crossing_setup(**path, held=held)
    assume(nearest(setup.probes[0], BALL.rest[held]) > 1e-6 * EDGE)
    state = check_crossing(setup, path["share"])[0]
    assert not state.probing.passed.any()


def nearest(probe, nodes):
    """Distance of the line of a tip's path from the nearest of some nodes [m]."""
    way = probe.path(np.inf) - probe.path(0.0)
    way /= np.linalg.norm(way)
    return np.linalg.norm(np.cross(nodes - probe.anchor, way), axis=1).min()


@pytest.mark.campaign
@settings(max_examples=25, deadline=None, derandomize=True)
@given(**PATHS)
def test_attached_tissue_stops_the_run_and_nothing_else_does(**path):
    """A cap is attached: a tip that is driven through it ends the run, in a triangle that has nothing else to move.

    Outside truth for the end: the attached triangle that is named lies across the straight way of the tip.
    """
    cap = np.flatnonzero(BALL.rest[:, 2] < -0.04)
    setup = crossing_setup(**path, held=cap)
    state, before, after, _ = check_crossing(setup, path["share"])
    if state.probing.passed.any():
        corners = BALL.triangles[state.probing.passed[0] - 1]
        assert np.isin(corners, cap).all()
        still = BALL.rest[corners]
        assert len(crossed(still, still, before, after, np.array([[0, 1, 2]]), margin=-1e-9)) == 1


def test_a_blocked_run_says_which_probe_and_where():
    clock = clock_for(BALL, 30, 20)
    down = Trajectory((0.0, clock.duration), ((0, 0, 0), (0, 0, -0.06)))
    probe = Probe((0.003, 0.002, R + 0.002), 0.0, down)
    plane = Plane((0, 0, -R), (0, 0, 1))
    held = Attachment(np.flatnonzero(BALL.rest[:, 2] > 0.03))
    history = simulate(Setup(BALL, ImplicitVolume(), clock, (plane, probe), (held,)))
    assert history.outcome == "blocked" and 0 < history.good_frames < 10
    assert re.search(r"probe that is obstacle 1 was driven through triangle \d+, 3 of whose corners", history.message)


SOFT_MODULUS = 10_000.0
"""[Pa] of known pressures: stiff ones would shorten the steps, and with them the way that a probe has."""
MODULUS = {"penalty": "bulk_modulus", "pyramid": "bulk_modulus", "pressure": "ambient"}
MEETING = [
    m(**({MODULUS[m.name]: SOFT_MODULUS} if m.name in MODULUS else {})) for m in METHODS if m.capabilities.thin_probes
]
EACH = pytest.mark.parametrize("method", MEETING, ids=lambda m: m.name)
PLAIN = ("free", "implicit_volume", "penalty")
WAYS = {name: way for name, way in PATHS.items() if name != "method"}


def test_every_method_that_keeps_one_volume_by_one_pressure_and_one_motion_meets_probes():
    names = {method.name for method in MEETING}
    assert names == {"free", "implicit_volume", "shake", "projection", "baumgarte", "penalty", "pressure", "pyramid"}


@pytest.mark.parametrize(
    "method",
    [
        # One that moves nodes by a multiplier, one that pushes them by a pressure; the others share their steps.
        pytest.param(m, id=m.name, marks=() if m.name in PLAIN else pytest.mark.campaign)
        for m in MEETING
    ],
)
@settings(max_examples=12, deadline=None, derandomize=True)
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
    if method.name == "free":
        assert wrong[-1] < -1e-3
    elif method.name in ("implicit_volume", "shake", "projection", "baumgarte"):
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
    apart = np.abs(contact - other).max() / np.abs(other).max()
    assert method.name == "free" or apart < (1e-3 if method.volume_tol else 0.05)
