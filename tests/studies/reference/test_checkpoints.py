"""Load paths half-way: read back bit for bit, and never a program, whoever wrote the file."""

import hashlib
import io
import pickle
from dataclasses import fields

import numpy as np
import pytest

from reference_fem import Checkpoint, Equilibrium, SolveError, equilibrium_path
from reference_fem.system.checks import check_resumed
from reference_fem.system.state import State
from studies.reference import checkpoints
from studies.reference import solve as module
from studies.reference.checkpoints import IGNORED
from studies.reference.reference_solves import ReferenceSolve
from studies.reference.solve import solve
from studies.store.ledger import Ledger
from studies.sweep.standings import solve_standing
from tests.reference_fem.statics.test_resume import TIMES, pressed_and_filled
from tests.studies.octant import LEVELS, SCENE

NONE = np.zeros((0, 0, 0))
START = State(0.0, 0.0, np.zeros(3), NONE, NONE)


class Evil:
    """What unpickling it does: an empty file at `marker`."""

    def __init__(self, marker):
        self.marker = marker

    def __reduce__(self):
        return open, (str(self.marker), "w")


def with_digest(content):
    return hashlib.sha256(content).hexdigest().encode() + content


@pytest.fixture(scope="module")
def stopped():
    """In contact, gripped and filled, after two of four steps."""
    found = []
    equilibrium_path(pressed_and_filled(), TIMES[:2], on_checkpoint=found.append)
    return found[-1]


def test_a_path_comes_back_bit_for_bit(stopped, tmp_path):
    checkpoints.keep(tmp_path / "a.h5", "this code", stopped)
    back = checkpoints.kept(tmp_path / "a.h5", "this code")
    assert len(back.path) == len(stopped.path) == 2
    for one, other in zip(back.path, stopped.path, strict=True):
        for field in fields(Equilibrium):
            mine, true = np.asarray(getattr(one, field.name)), np.asarray(getattr(other, field.name))
            assert (mine.shape, mine.dtype, mine.tobytes()) == (true.shape, true.dtype, true.tobytes()), field.name
    for name, true in stopped.state.to_arrays().items():
        mine = back.state.to_arrays()[name]
        assert (mine.shape, mine.dtype, mine.tobytes()) == (true.shape, true.dtype, true.tobytes()), name


def test_a_pickle_is_never_loaded(tmp_path):
    """A file as of version 0.2, from a stranger: the digest fits, and nothing of it runs."""
    marker, reference_solve = tmp_path / "marker", ReferenceSolve(SCENE, LEVELS[0])
    pickle.loads(pickle.dumps(Evil(marker)))
    marker.unlink()  # the payload does what it is for
    file = checkpoints.steps_path(reference_solve.path(tmp_path))
    file.parent.mkdir(parents=True)
    file.write_bytes(with_digest(pickle.dumps((reference_solve.stamp, Evil(marker)))))
    with pytest.warns(UserWarning, match=IGNORED):
        assert solve_standing(Ledger(tmp_path), reference_solve).state == "missing"
    assert not marker.exists()


def test_status_of_a_strangers_folder_runs_nothing_and_warns(organbench, tmp_path):
    from studies.scene.library import BALL_SQUEEZE

    marker = tmp_path / "marker"
    reference_solve = ReferenceSolve(BALL_SQUEEZE, BALL_SQUEEZE.reference.levels[0])
    file = checkpoints.steps_path(reference_solve.path(tmp_path))
    file.parent.mkdir(parents=True)
    file.write_bytes(with_digest(pickle.dumps((reference_solve.stamp, Evil(marker)))))
    code, _, err = organbench("status", "volume_loss", "--results", tmp_path)
    assert code == 0 and IGNORED in err and "Traceback" not in err
    assert not marker.exists()


def test_an_array_of_objects_is_never_loaded(tmp_path):
    """NumPy stores them as pickles."""
    content, marker = io.BytesIO(), tmp_path / "marker"
    arrays = checkpoints.arrays_of("this code", Checkpoint([], START))
    np.savez(content, **arrays | {"path_t": np.array([Evil(marker)], dtype=object)})
    checkpoints.steps_path(tmp_path / "a.h5").write_bytes(with_digest(content.getvalue()))
    with pytest.warns(UserWarning, match=IGNORED):
        assert checkpoints.kept(tmp_path / "a.h5", "this code") is None
    assert not marker.exists()


def test_a_device_is_not_read(tmp_path):
    checkpoints.steps_path(tmp_path / "a.h5").symlink_to("/dev/zero")
    assert checkpoints.kept(tmp_path / "a.h5", "this code") is None


def lacking(arrays):
    del arrays["state_x"]


def shapeless(arrays):
    arrays["path_t"] = np.array(1.0)


def uneven(arrays):
    arrays["path_t"] = np.zeros(2)


@pytest.mark.parametrize("change", [lacking, shapeless, uneven])
def test_arrays_that_do_not_fit_are_ignored(tmp_path, change):
    arrays = checkpoints.arrays_of("this code", Checkpoint([], START))
    change(arrays)
    checkpoints.steps_path(tmp_path / "a.h5").write_bytes(checkpoints.sealed(arrays))
    with pytest.warns(UserWarning, match=IGNORED):
        assert checkpoints.kept(tmp_path / "a.h5", "this code") is None


def test_a_small_file_does_not_fill_the_memory(tmp_path):
    content, arrays = io.BytesIO(), checkpoints.arrays_of("this code", Checkpoint([], START))
    np.savez_compressed(content, **arrays | {"state_x": np.zeros(10**6)})
    assert len(content.getvalue()) < 20_000
    checkpoints.steps_path(tmp_path / "a.h5").write_bytes(with_digest(content.getvalue()))
    with pytest.warns(UserWarning, match=IGNORED):
        assert checkpoints.kept(tmp_path / "a.h5", "this code") is None


@pytest.mark.parametrize("name", ["x", "multiplier", "grip_anchor", "hold_stuck"])
def test_a_state_of_another_length_is_refused(stopped, name):
    """Compiled loops would read behind its end."""
    arrays = stopped.state.to_arrays()
    check_resumed(stopped.state, State.from_arrays(arrays))
    arrays[name] = arrays[name][:0]
    with pytest.raises(SolveError, match=f"has {name} of shape"):
        check_resumed(stopped.state, State.from_arrays(arrays))


def test_steps_of_other_code_are_not_gone_on_from(tmp_path, monkeypatch):
    reference_solve, asked = ReferenceSolve(SCENE, LEVELS[0]), []
    checkpoints.keep(reference_solve.path(tmp_path), "other code", Checkpoint([], START))

    def watched(problem, times, settings, on_checkpoint, resume):
        asked.append(resume)
        raise SolveError("enough")

    monkeypatch.setattr(module, "equilibrium_path", watched)
    solve(tmp_path, reference_solve)
    checkpoints.steps_path(reference_solve.path(tmp_path)).write_bytes(b"cut off")
    solve(tmp_path, reference_solve)
    assert asked == [None, None]


def test_steps_that_have_changed_are_not_gone_on_from(tmp_path):
    """A bit among their numbers would be in every later step."""
    record = tmp_path / "a.h5"
    checkpoints.keep(record, "this code", Checkpoint([], START))
    assert checkpoints.kept(record, "this code") is not None
    file = checkpoints.steps_path(record)
    whole = file.read_bytes()
    for place in range(0, len(whole), 5):
        file.write_bytes(whole[:place] + bytes([whole[place] ^ 1]) + whole[place + 1 :])
        assert checkpoints.kept(record, "this code") is None
