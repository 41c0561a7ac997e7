"""The plain step that `make bench` measures against does the same physics."""

from dataclasses import replace

import numpy as np
import pytest

from massspring import ImplicitVolume, simulate
from massspring.kernels.forces.volume import enclosed_volume
from studies.bench.plain import plain_run
from studies.bench.solver import squeezed_setup


@pytest.mark.parametrize(("precision", "tolerance"), [("float64", 1e-11), ("float32", 1e-4)])
def test_without_contact_it_moves_like_the_method(precision, tolerance):
    """Positions after 40 steps of a ball that falls about its held bottom; relative to how far it has moved."""
    setup = squeezed_setup(ImplicitVolume())
    clock = replace(setup.clock, frames=2)
    setup = replace(setup, obstacles=(), clock=clock, gravity=(1.0, 0.0, -9.81), precision=precision)
    x = plain_run(setup)[1]
    expected = simulate(setup, snapshots=[2]).snapshots[0]
    moved = np.abs(expected - setup.body.rest).max()
    assert moved > 1e-4 * setup.body.size
    assert np.abs(x - expected).max() < tolerance * moved


def test_under_a_plane_it_keeps_the_volume_to_what_clamping_leaves():
    setup = squeezed_setup(ImplicitVolume())
    x = plain_run(setup)[1]
    volume = enclosed_volume(x, setup.body.triangles)
    assert abs(volume / setup.body.volume - 1) < 2e-3
    assert x[:, 2].max() < setup.obstacles[0].anchor[2] * (1 - 0.29)
