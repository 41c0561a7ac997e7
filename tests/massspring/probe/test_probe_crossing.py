"""No path and no speed lets a thin probe through a surface; attached tissue stops the run instead."""

import itertools
import re

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from massspring import (
    Attachment,
    Clock,
    ImplicitVolume,
    Plane,
    Probe,
    Setup,
    Trajectory,
    simulate,
)
from massspring.body.inside import is_inside, surface_distance
from massspring.kernels.probe.arrays import LEFT_BEHIND
from massspring.run.checks import check_probes
from tests.massspring.methods.test_methods import clock_for
from tests.massspring.probe.test_probe import BALL, EDGE, METHODS, R, frames_of


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
    "method": st.sampled_from(METHODS),
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


@settings(max_examples=25, deadline=None, derandomize=True)
@given(**PATHS)
def test_no_path_and_no_speed_lets_a_probe_through(**path):
    state = check_crossing(crossing_setup(**path), path["share"])[0]
    assert not state.probing.passed.any()


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


def test_a_tip_that_meets_an_attached_node_ends_the_run():
    top = int(np.argmax(BALL.rest[:, 2]))
    path = {"side": (0, 0, 1), "through": (0, 0, 0), "start": 1.25, "length": 2.0, "share": 0.3, "thickness": 0.0}
    state = check_crossing(crossing_setup(**path, method=METHODS[0], held=np.array([top])), 0.3)[0]
    assert top in BALL.triangles[state.probing.passed[0] - 1]


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
