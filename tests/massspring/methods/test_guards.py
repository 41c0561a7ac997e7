"""Guards, one table over all methods: what a step does where a volume has no gradient or is far off, what a run does
behind a target that jumps, and how it ends where numbers are lost. What holds for a method is read from its claims and
capabilities."""

from dataclasses import dataclass, replace
from typing import ClassVar

import numpy as np
import pytest

from massspring import Body, Clock, Free, Method, Plane, Ramp, Setup, Trajectory, simulate
from massspring.methods.capabilities import Capabilities
from massspring.methods.method import begin_frame
from massspring.world.targets import fastest_filling
from tests.massspring.conftest import body_of
from tests.massspring.methods.test_implicit_volume import start_of
from tests.massspring.methods.test_methods import clock_for, squeeze
from tests.massspring.rows import CONTESTANTS, by_pairs, marks_of, recovers

FRAMES = 10
LOST_AFTER = 3.5
"""Frames of a clock after which what is broken has no place any more."""
LINE, PLANE = np.diag([1, 0, 0]), np.diag([1, 1, 0])
FAR_OFF = {
    "flattened": PLANE,
    "40 % too small": 0.6 ** (1 / 3) * np.eye(3),
    "40 % too large": 1.4 ** (1 / 3) * np.eye(3),
}
AT_ONCE = [("nodal", "flattened")]
"""Left out: with the volumes of all nodes wrong at once, what each may move alone adds up to hundreds of times as
much."""


@dataclass(frozen=True)
class Case:
    """A row of the table: a method on a body, in a precision."""

    method: Method
    body: Body
    precision: str

    def setup(self, clock: Clock, **options) -> Setup:
        return Setup(self.body, self.method, clock, precision=self.precision, **options)


@pytest.fixture
def case(row, request):
    method, kind, precision, _ = row
    return Case(CONTESTANTS[method], body_of(kind, request), precision)


@pytest.fixture
def option(row):
    return row[3]


def guard(options=("",), exclude=(), where=lambda method, kind: True):
    """Runs a test for every pair of method, body, precision and option that goes together."""
    chosen = [row for row in by_pairs(options, exclude) if where(CONTESTANTS[row[0]], row[1])]
    named = [pytest.param(row, id="-".join(filter(None, map(str, row))), marks=marks_of(row)) for row in chosen]
    return pytest.mark.parametrize("row", named)


@guard(where=lambda method, kind: not recovers(method))
def test_a_body_on_a_line_is_counted_and_not_thrown(case):
    """G = 0: each step of a method that would correct the volume is counted, and nothing is divided by 0. Methods that
    recover throw the nodes about (test_recovery.py)."""
    clock = clock_for(case.body, 3, 10, fraction=0.2, method=case.method)
    history = simulate(case.setup(clock, damping=20.0, positions=start_of(case.body, LINE)))
    assert history.outcome == "finished"
    assert np.isfinite(history.pressure).all()
    # The compliance of hard elements leaves no residual where J = 0: their solve does not notice.
    noticed = case.method.capabilities.correction and case.method != CONTESTANTS["element_hard"]
    assert history.singular_steps == (30 if noticed else 0)
    assert history.limited_corrections == 0, "a step that makes up for nothing is not one that makes up for a part"
    assert np.abs(history.final[:, 1:] - case.body.rest[:, 1:].mean(axis=0)).max() < 1e-6 * case.body.size


def corrected(case: Case, matrix, clock: Clock) -> tuple[float, int]:
    """How far the wrong volume of a start moves any node in one step, in longest corrections; capped steps counted.

    Against the same step with the volume there is for its target, so that springs and momentum do not count.
    """
    setup = case.setup(clock, positions=start_of(case.body, matrix))
    boundary, ends = setup.boundary(0), []
    volume = case.body.kept.measure(setup.start().x.astype(np.float64))
    for target in (case.body.rest_volumes, volume):
        after = case.method.advance(setup.start(), boundary._replace(volume_target=target[None, :].copy()))
        ends.append((after.x.astype(np.float64), int(after.diagnostics.limited[0])))
    far = np.linalg.norm(ends[0][0] - ends[1][0], axis=1).max()
    return far / setup.start().model.correction_limit, ends[0][1]


@guard(where=lambda method, kind: method.capabilities.correction == "limited" and kind in ("block", "ball"))
def test_a_limited_correction_moves_no_node_farther_than_it_claims(case):
    """0.3 mean spring lengths, at half the limit of the springs; where it says it cut, it went all that way.

    The bound is on what each volume moves alone; several add up.
    """
    # A force goes that far in a long step only; what is solved for goes at once, and short steps leave springs out.
    fraction = 0.02 if case.method.volume_tol else 0.5
    reached = 0
    for scale in (0.05, 0.5, 0.9, 0.999, 2.0):
        far, limited = corrected(case, scale * np.eye(3), clock_for(case.body, 1, 1, fraction))
        assert far < 1.0 + 2e-4  # of springs, 1e-4 in implicit ones
        assert limited == (far > 0.99)
        reached += limited
    assert 0 < reached < 5, "either nothing was cut or everything"


@guard(tuple(FAR_OFF), AT_ONCE)
def test_a_volume_far_off_comes_back(case, option):
    """At 0.2 dt_c: as closely as a kept volume is kept; what a force keeps is on its way, and no body is torn apart.

    What recovers takes five frames more, and leaves no tetrahedron inside out."""
    correction, start = case.method.capabilities.correction, FAR_OFF[option]
    clock = clock_for(case.body, 9 if recovers(case.method) else 4, 30, fraction=0.2, method=case.method)
    history = simulate(case.setup(clock, damping=20.0, positions=start_of(case.body, start)))
    if correction == "unbounded" and history.outcome == "diverged":
        assert np.linalg.det(start) < 0.1 and "diverged in frame 1 " in history.message
        return
    assert history.outcome == "finished"
    assert np.abs(history.final - case.body.rest).max() < 3 * case.body.size
    if correction:
        error = np.abs(history.volume / case.body.rest_volumes - 1)[-1].max()
        assert error < (1e-3 if case.method.volume_tol else 0.5)
    if recovers(case.method):
        assert history.min_j[-1] > 0.5


@guard(where=lambda method, kind: method.capabilities.targets)
def test_a_target_that_jumps_is_followed_behind_a_warning(case):
    clock = clock_for(case.body, 12, 10, fraction=0.1, method=case.method)
    jump = dict.fromkeys(case.body.kept.names, Ramp((0.0,), (1.1,)))
    with pytest.warns(
        UserWarning, match="moves faster than .* would tear the body apart; the target is limited to that rate"
    ):
        setup = case.setup(clock, damping=30.0, targets=jump)
    history = simulate(setup)
    assert history.outcome == "finished" and history.limited_corrections == 0
    target = history.volume_target / case.body.rest_volumes
    assert np.diff(target, axis=0, prepend=1.0).max() < 1.001 * clock.frame * fastest_filling(case.body)
    assert np.abs(target[-1] - 1.1).max() < 1e-12
    grown = history.volume[-1] / case.body.rest_volumes - 1.0
    assert np.abs(grown - 0.1).max() < (1e-3 if case.method.volume_tol else 0.05)


@pytest.mark.filterwarnings("ignore:overflow:RuntimeWarning", "ignore:invalid:RuntimeWarning")
@guard((10.0, 1e6))
def test_steps_far_above_the_limit_end_the_run(case, option):
    """Where no step is unstable, passes from where nodes would fly by themselves still lose their way in the end."""
    clock = clock_for(case.body, 4, 60, fraction=option, method=case.method)
    v = 0.01 * np.random.default_rng(1).normal(size=case.body.rest.shape)
    setup = case.setup(clock, velocity=v)
    if case.method.capabilities.conditionally_stable or option > 1e3:
        stops(setup, "", 0)
    else:
        assert simulate(setup).outcome == "finished"


@dataclass(frozen=True)
class Broken(Trajectory):
    """A path that was made elsewhere and ends in NaN."""

    until: float = 0.0

    def __call__(self, t):
        where = super().__call__(t)
        return np.where(np.asarray(t)[..., None] > self.until, np.nan, where)


def stops(setup, reason: str, good: int):
    """Runs, and checks that it ends diverged in the frame after `good` with NaN tails and the reason in its message."""
    history = simulate(setup)
    assert history.outcome == "diverged"
    assert history.good_frames == good
    assert f"frame {good + 1} " in history.message and reason in history.message
    assert np.isfinite(history.volume[:good]).all() and np.isnan(history.volume[good:]).all()
    assert np.isfinite(history.final).all()
    return history


@guard()
def test_an_obstacle_that_loses_its_place_stops_the_run(case):
    """Comparisons with NaN are false: without the guard the obstacle would just be gone."""
    clock = clock_for(case.body, FRAMES, 10, method=case.method)
    path = Broken(until=LOST_AFTER * clock.frame)
    below = Plane((0, 0, case.body.rest[:, 2].min()), (0, 0, 1), path)
    stops(case.setup(clock, obstacles=(below,), damping=20.0), "obstacle 0 is no longer finite", 3)


@pytest.mark.filterwarnings("ignore:overflow:RuntimeWarning", "ignore:invalid:RuntimeWarning")
@guard((1e200, 1e308))
def test_numbers_that_overflow_stop_the_run(case, option):
    """One node shot off at a speed whose square, or whose way within a step, is no number any more."""
    v = np.zeros_like(case.body.rest)
    v[3] = [option, 0.0, 0.0]
    clock = clock_for(case.body, FRAMES, 10)
    planes = squeeze(case.body, 0.002, clock.duration)
    stops(case.setup(clock, obstacles=planes, damping=5.0, velocity=v), "", 0)


@guard()
def test_nan_in_one_node_ends_every_solve(case):
    """Whatever iterates must end on NaN: an iteration that waits for a small residual would wait for ever."""
    setup = case.setup(clock_for(case.body, 1, 3))
    state = begin_frame(setup.start(), setup.boundary(0))
    state.nodes.x[4] = np.nan
    assert not np.isfinite(case.method.advance(state, setup.boundary(0)).x).all()


@dataclass(frozen=True)
class Poisoned(Method):
    """Springs whose forces turn into NaN, or pressures, from the fourth frame on."""

    what: str
    frames: list

    name: ClassVar[str] = "poisoned"
    order: ClassVar[int] = 1
    volume_tol: ClassVar[float | None] = None
    capabilities: ClassVar[Capabilities] = Free.capabilities

    def advance(self, state, boundary):
        self.frames.append(1)
        after = Free().advance(state, boundary)
        if len(self.frames) < 4:
            return after
        if self.what == "pressure":
            return replace(after, lam=np.full_like(after.lam, np.nan))
        poisoned = after.nodes._replace(v=np.full_like(after.v, np.nan))
        return Free().advance(replace(after, nodes=poisoned), boundary)


@pytest.mark.parametrize(("what", "reason"), [("force", "positions are no longer"), ("pressure", "pressures are no")])
def test_nan_inside_a_frame_stops_the_run(block_body, what, reason):
    stops(Setup(block_body, Poisoned(what, []), clock_for(block_body, FRAMES, 5)), reason, 3)
