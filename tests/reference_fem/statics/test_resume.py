"""Load steps as checkpoints: a path that goes on from a stored one is the path that was never interrupted."""

import numpy as np
import pytest

from reference_fem import (
    Cavity,
    Checkpoint,
    NeoHookean,
    PrescribedDisplacement,
    Problem,
    RigidPlane,
    RigidSphere,
    SolveError,
    equilibrium_path,
)
from reference_fem.system.checks import check_resumed
from reference_fem.system.state import State
from tests.reference_fem.bodies import block
from tests.reference_fem.statics.test_cavity import hollow_cube, in_the_middle

TIMES = (0.3, 0.6, 0.8, 1.0)


def pressed_and_filled():
    """A hollow cube under its weight, full and gripped by a plate that turns sideways, poked by a ball."""
    plate = RigidPlane((0.0, 0.0, 1.0), (0.0, 0.0, -1.0), lambda t: (0.1 * t**2, 0.0, -0.1 * t), "no_slip")
    ball = RigidSphere((1.3, 0.5, 0.5), 0.3, lambda t: (-0.05 * t, 0.0, 0.0))
    return Problem(
        hollow_cube(),
        NeoHookean(1.0, 1000.0),
        [PrescribedDisplacement(lambda x: x[2] < 1e-9)],
        [plate, ball],
        gravity=(0.0, 0.0, -1.0),
        density=0.05,
        cavities=[Cavity(in_the_middle)],
    )


@pytest.fixture(scope="module")
def kept():
    """A checkpoint after each step of the uninterrupted path."""
    checkpoints = []
    equilibrium_path(pressed_and_filled(), TIMES, on_checkpoint=checkpoints.append)
    return checkpoints


def stored(checkpoint, folder):
    """Through a file of plain arrays."""
    np.savez(folder / "step.npz", **checkpoint.state.to_arrays())
    with np.load(folder / "step.npz") as arrays:
        return Checkpoint(checkpoint.path, State.from_arrays(arrays))


@pytest.mark.parametrize("stop", [1, 2])
def test_a_resumed_path_is_the_uninterrupted_one(kept, stop, tmp_path):
    """After the second and third of four steps: in contact, gripped, with lumen pressure."""
    whole = kept[-1].path
    again = equilibrium_path(pressed_and_filled(), TIMES, resume=stored(kept[stop], tmp_path))
    assert len(again) == len(whole)
    assert whole[-1].obstacle_force[0, 0] > 0.0  # the grip carries a shear
    for resumed, once in zip(again, whole, strict=True):
        for name in ("u", "p", "obstacle_force", "held_force", "cavity_pressure", "cavity_volume"):
            # factors ordered for another first matrix differ by round-off, and contact multiplies it by its penalty
            np.testing.assert_allclose(getattr(resumed, name), getattr(once, name), rtol=0.0, atol=2e-11)
        assert resumed.newton_iterations == once.newton_iterations


def test_going_on_from_another_mesh_is_refused(kept):
    other = Problem(block(), NeoHookean(1.0, 1000.0), [PrescribedDisplacement(lambda x: x[2] < 1e-9)])
    with pytest.raises(SolveError, match="it is of another mesh"):
        equilibrium_path(other, TIMES, resume=kept[0])


def test_a_stored_step_with_a_part_missing_is_refused(kept):
    arrays = kept[0].state.to_arrays()
    del arrays["pressure"], arrays["hold_anchor"]
    with pytest.raises(SolveError, match="lacks pressure, hold_anchor"):
        State.from_arrays(arrays)


@pytest.mark.parametrize("name", ["x", "multiplier", "grip_anchor", "hold_stuck"])
def test_a_state_of_another_length_is_refused(kept, name):
    """Compiled loops would read behind its end."""
    arrays = kept[1].state.to_arrays()
    check_resumed(kept[1].state, State.from_arrays(arrays))
    arrays[name] = arrays[name][:0]
    with pytest.raises(SolveError, match=f"has {name} of shape"):
        check_resumed(kept[1].state, State.from_arrays(arrays))
