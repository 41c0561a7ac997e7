"""The benchmarks of asv run: each set-up of the steps is built, a small one is simulated, a small path is solved."""

from dataclasses import replace

import pytest

from massspring import Clock, simulate
from studies.lab.bench import reference, steps


@pytest.mark.lab
def test_the_set_ups_run(monkeypatch):
    monkeypatch.setattr(steps, "LARGE", 550)
    for setup in (build() for build in steps.SETUPS.values()):
        short = replace(setup, clock=Clock(setup.clock.frame, 1, setup.clock.steps))
        assert simulate(short).outcome == "finished"
    path = reference.contact_path(2, 1)
    assert path["unknowns"] == 3 * 125 + 27 and 0 < path["iteration"] < path["wall"]
