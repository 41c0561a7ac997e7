"""What haptic updates and frames cost: whole steps, wherever a window begins."""

import numpy as np
import pytest

from studies.bench_slide import windows

DT = 1.5e-3


def test_a_window_holds_as_many_whole_steps_as_it_needs():
    step_ns = np.array([[1.0, 2.0, 4.0, 8.0, 16.0]])
    assert windows(step_ns, DT, 2e-3).tolist() == [[3.0, 6.0, 12.0, 24.0]]
    assert windows(step_ns, DT, DT).tolist() == step_ns.tolist()
    assert windows(step_ns, DT, 4 * DT).tolist() == [[15.0, 30.0]]


def test_repeats_stay_apart():
    rng = np.random.default_rng(1)
    step_ns = rng.uniform(1, 2, (3, 40))
    found = windows(step_ns, DT, 10 * DT)
    assert found.shape == (3, 31)
    assert found[2, 30] == pytest.approx(step_ns[2, 30:].sum(), rel=1e-12)
