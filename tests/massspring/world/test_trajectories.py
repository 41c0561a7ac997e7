"""Paths and ramps."""

import numpy as np
import pytest

from massspring.world.trajectories import Paths, Trajectory


def drawn(rng: np.random.Generator, keys: int) -> Trajectory:
    """A path with so many random keys."""
    times = np.sort(rng.random(keys)).tolist()
    return Trajectory(tuple(times), tuple(tuple(key) for key in rng.standard_normal((keys, 3)).tolist()))


@pytest.mark.parametrize("keys", [1, 2, 5])
def test_paths_interpolate_as_numpy_does(keys):
    rng = np.random.default_rng(keys)
    paths = [drawn(rng, keys), Trajectory(), drawn(rng, keys + 1)]
    times = np.r_[rng.uniform(-0.2, 1.2, 50), paths[0].times, 0.0]  # beyond the ends, at keys, in no order
    axes = [np.transpose(path.displacements) for path in paths]
    wanted = [
        np.stack([np.interp(times, path.times, axis) for axis in each], 1)
        for path, each in zip(paths, axes, strict=True)
    ]
    np.testing.assert_array_equal(Paths(paths)(times), np.stack(wanted, axis=1))
    np.testing.assert_array_equal(paths[0](float(times[7])), wanted[0][7])


def test_functions_and_types_of_their_own_are_followed_beside_paths():
    class Shaken(Trajectory):
        def __call__(self, t):
            return super().__call__(t) + np.sin(np.asarray(t))[..., None]

    def away(t):
        return np.stack([t, 2.0 * t, 0.0 * t], axis=-1)

    straight = drawn(np.random.default_rng(0), 3)
    shaken, times = Shaken(straight.times, straight.displacements), np.linspace(-0.2, 1.2, 20)
    wanted = np.stack([straight(times), straight(times) + np.sin(times)[:, None], away(times)], axis=1)
    np.testing.assert_array_equal(Paths([straight, shaken, away])(times), wanted)
