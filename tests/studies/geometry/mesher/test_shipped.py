"""Meshes that come with the package."""

import numpy as np
import pytest

from studies.geometry import ball
from studies.geometry.mesher import jobs
from studies.geometry.mesher.shipped import FOLDER, INDEX, OWN, index, key_of, shipped
from studies.lab.meshes import differences, publish

RECIPE = {"kind": "organ", "name": "cube", "nodes": 8, "fill": False}
ARRAYS = {"points": np.random.default_rng(0).random((8, 3)), "triangles": np.arange(12).reshape(4, 3)}


@pytest.fixture(autouse=True)
def with_shipped(own_meshes, monkeypatch):
    monkeypatch.delenv(OWN)


@pytest.fixture
def folder(tmp_path):
    """A set of one mesh."""
    index.cache_clear()
    publish({key_of(RECIPE): (RECIPE, ARRAYS)}, tmp_path)
    yield tmp_path
    index.cache_clear()


def test_a_shipped_mesh_is_the_one_that_was_made(folder, monkeypatch):
    found = shipped(RECIPE, folder)
    assert found is not None and {name: values.dtype for name, values in found.items()} == {
        name: values.dtype for name, values in ARRAYS.items()
    }
    assert not differences({"": (RECIPE, ARRAYS)}, folder)
    assert differences({"": (RECIPE, ARRAYS | {"points": ARRAYS["points"] + 1e-16})}, folder)
    assert shipped(RECIPE | {"nodes": 9}, folder) is None
    monkeypatch.setenv(OWN, "1")
    assert shipped(RECIPE, folder) is None


def spoil(path):
    content = bytearray(path.read_bytes())
    content[len(content) // 2] ^= 1
    path.write_bytes(content)


FAULTS = {
    "is damaged; it is made instead": lambda folder: spoil(next(folder.glob("*.npz"))),
    "cannot be read .No such file or directory.; it is made": lambda folder: next(folder.glob("*.npz")).unlink(),
    "the list of shipped meshes cannot be read .Expecting": lambda folder: (folder / INDEX).write_text("{"),
    "the list of shipped meshes cannot be read .*No such file": lambda folder: (folder / INDEX).unlink(),
}


@pytest.mark.parametrize("sentence", FAULTS)
def test_a_missing_or_damaged_one_is_told_of_and_made(folder, sentence):
    FAULTS[sentence](folder)
    index.cache_clear()
    with pytest.warns(UserWarning, match=sentence):
        assert shipped(RECIPE, folder) is None


def test_the_first_mesh_of_a_user_needs_no_mesher(monkeypatch):
    """It comes with the package."""
    monkeypatch.setattr(jobs, "run_worker", lambda *_: pytest.fail("the mesher ran"))
    mesh = ball(150)
    assert key_of(mesh.recipe) in index(FOLDER) and mesh.outer_count == 150
    assert mesh.volume == pytest.approx(4.0 / 3.0 * np.pi * 0.05**3, rel=0.05)
