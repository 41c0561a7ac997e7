"""Metrics of a made-up run whose numbers are exact."""

import numpy as np
import pytest

from studies.metrics.metrics import lumen_pressure_error
from studies.metrics.table import metric
from studies.metrics.timing.protocol import FrameTiming
from tests.studies.made_up_run import EDGE, run


def test_the_spread_of_a_time_is_half_its_range_over_the_repeats():
    times = 1e6 * np.array([[4.0, 4.0, 4.0, 4.0], [5.0, 5.0, 5.0, 5.0], [7.0, 7.0, 7.0, 7.0]])
    spread = metric("frame_time").spread
    assert spread is not None
    assert spread(run(timing=FrameTiming(times))) == pytest.approx(1.5, rel=1e-12)
    assert np.isnan(spread(run(timing=FrameTiming(times[:1]))))


def test_the_pressure_of_a_lumen_is_that_of_its_own_column():
    """The tissue, column 0, has another one. The reference ends at 20 Pa."""
    volume = np.full((4, 2), EDGE**3 / 2)
    values = {"volume": volume, "volume_target": volume, "pressure": np.tile([50.0, 22.0], (4, 1))}
    attributes = {"volumes": 2, "lumen_column": 1}
    assert lumen_pressure_error(run(values=values, attributes=attributes)) == pytest.approx(10.0, rel=1e-12)
    assert np.isnan(lumen_pressure_error(run()))
