"""The cost of the constraint is the difference of frames that begin in the same state."""

from dataclasses import replace

import numpy as np

from massspring import Clock, Free, ImplicitVolume, Trajectory, simulate
from studies.bench.solver import squeezed_setup, without_ns
from studies.scene.library.ball_squeeze import RADIUS

positions: dict[str, list[np.ndarray]] = {}


class Kept(ImplicitVolume):
    def advance(self, state, boundary):
        positions["on"].append(state.x.copy())
        return super().advance(state, boundary)


class Loose(Free):
    def advance(self, state, boundary):
        positions["off"].append(state.x.copy())
        return super().advance(state, boundary)


def test_both_begin_each_frame_where_the_run_is():
    positions.update(on=[], off=[])
    setup = squeezed_setup(Kept())
    clock = Clock(setup.clock.dt, 6, setup.clock.steps)
    press = Trajectory((0.0, clock.duration), ((0.0, 0.0, 0.0), (0.0, 0.0, -0.05 * RADIUS)))
    short = replace(setup, clock=clock, obstacles=(replace(setup.obstacles[0], path=press),))
    times = without_ns(short, Loose())
    assert times.shape == (2, 6) and (times > 0).all()
    assert len(positions["on"]) == 6
    for on, off in zip(positions["on"], positions["off"], strict=True):
        assert np.array_equal(on, off)
    # The frames without the constraint leave no trace in the run.
    plain = simulate(replace(short, method=ImplicitVolume()), snapshots=range(1, 6))
    assert np.array_equal(positions["on"][1:], plain.snapshots)
    assert plain.contact_force[-1].any()
