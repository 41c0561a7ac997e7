"""Meshes are made in a process of their own, once, and the same every time."""

import logging
import subprocess
import sys
import time

import numpy as np
import pytest

from studies.base.errors import StudyError
from studies.geometry import ball, organ
from studies.geometry.mesher import jobs, process
from studies.geometry.mesher.jobs import mesh_from, recipe_hash
from tests.campaigns import campaign

RECIPE = {"kind": "organ", "name": "ball", "organ": "ball", "nodes": 150, "parameters": {}, "regions": {}, "fill": True}


@pytest.fixture
def own_cache(tmp_path, monkeypatch):
    """A cache of this test's own, for meshes that new processes make: all others come from copies of one process."""
    monkeypatch.setenv("ORGANBENCH_CACHE", str(tmp_path / "cache"))
    monkeypatch.setattr(process, "subprocess", subprocess)
    return tmp_path / "cache"


def same(one, other):
    return all((getattr(one, key) == getattr(other, key)).all() for key in ("points", "triangles", "tetrahedra"))


def test_same_recipe_gives_the_same_mesh_bit_for_bit_and_is_made_once(bodies, own_cache, monkeypatch):
    mesh = bodies["liver"][150]
    again = mesh_from(mesh.recipe)
    assert again is not mesh and same(again, mesh)
    assert len(list(own_cache.glob("*.npz"))) == 1 and not list(own_cache.glob("*.part"))
    monkeypatch.setattr(jobs, "run_worker", lambda *_: pytest.fail("meshed again"))
    assert same(mesh_from(mesh.recipe), mesh)


@pytest.mark.parametrize(("name", "nodes"), [("ball", 100), campaign("stomach", 300)])
def test_a_surface_made_before_is_filled_as_if_made_now(own_cache, monkeypatch, name, nodes):
    """A solid organ and a hollow one: the cached surface is filled, and the mesh is the same to the bit."""
    alone = organ(name, nodes)
    monkeypatch.setenv("ORGANBENCH_CACHE", str(own_cache / "other"))
    surface, run_worker, inputs = organ(name, nodes, fill=False), jobs.run_worker, []

    def recorded(recipe, arrays, limit):
        inputs.append(sorted(arrays))
        return run_worker(recipe, arrays, limit)

    monkeypatch.setattr(jobs, "run_worker", recorded)
    filled = organ(name, nodes)
    assert inputs == [["points", "triangles"]] and same(filled, alone)
    assert (filled.points[: filled.outer_count] == surface.points).all()


def test_a_warning_names_a_damaged_cache_file_that_is_made_again(own_cache):
    first = ball(100)
    (path,) = own_cache.glob("*.npz")
    whole = path.read_bytes()
    middle = len(whole) // 2
    flipped = whole[:middle] + bytes([whole[middle] ^ 255]) + whole[middle + 1 :]
    for broken in (whole[:1000], flipped):
        path.write_bytes(broken)
        with pytest.warns(UserWarning, match="is damaged .* made again"):
            assert same(ball(100), first)
        assert path.read_bytes() != broken


def test_every_part_of_the_recipe_counts(monkeypatch):
    cap = {"kind": "HalfSpace", "point": [0, 0, 0.03], "normal": [0, 0, -1]}
    changes = [{}, {"nodes": 151}, {"parameters": {"radius": 0.04}}, {"regions": {"top": cap}}, {"fill": False}]
    names = [recipe_hash(RECIPE | change, {}) for change in changes]
    points = np.zeros((4, 3))
    names += [recipe_hash(RECIPE, {"points": points}), recipe_hash(RECIPE, {"points": points + 1e-16})]
    monkeypatch.setattr(jobs, "code_hash", lambda kind: "other code")
    names.append(recipe_hash(RECIPE, {}))
    assert len(set(names)) == len(names)


def test_the_code_of_a_mesh_is_what_its_kind_needs():
    """Organs do not depend on the code of scans; every shape counts, and what moves a surface onto it."""
    assert len({jobs.code_hash(kind) for kind in ("organ", "scan", "curved")}) == 3
    assert jobs.code_hash("organ") == jobs.code_hash("ball_octant")


def test_a_mesher_that_hangs_is_stopped(own_cache):
    with pytest.raises(StudyError, match=r"ball: the mesher was stopped after 0\.05 s of processor time"):
        mesh_from(RECIPE, limit=0.05)
    assert not list(own_cache.glob("*"))


def test_the_limit_counts_work_and_not_waiting_and_each_stage_is_logged(own_cache, monkeypatch, caplog):
    """A process that sleeps uses no processor time; by the clock it may take PATIENCE times as long."""
    monkeypatch.setattr(process, "PATIENCE", 4.0)
    sleeper = [sys.executable, "-c", "import time; print('asleep', flush=True); time.sleep(60)"]
    start = time.monotonic()
    with caplog.at_level(logging.INFO, logger="organbench.mesher"):
        code, stage, _ = process.followed(sleeper, "body", 0.5)
    assert [record.getMessage() for record in caplog.records] == ["body: asleep"]
    assert code in process.STOPPED and stage == "asleep" and 1.5 < time.monotonic() - start < 20


def test_a_mesher_that_dies_is_reported(own_cache):
    with pytest.raises(StudyError, match=r"ball: the mesher ended with code 1 \(KeyError: 'nonsense'\)"):
        mesh_from(RECIPE | {"kind": "nonsense"})


def test_a_cache_that_cannot_be_written_gets_a_sentence(tmp_path, monkeypatch):
    blocked = tmp_path / "file"
    blocked.write_text("not a folder")
    monkeypatch.setenv("ORGANBENCH_CACHE", str(blocked / "meshes"))
    with pytest.raises(StudyError, match="set ORGANBENCH_CACHE to a folder that can be written"):
        ball(150)


def test_the_default_cache_lies_under_results_where_there_are_any_and_else_is_the_users(tmp_path, monkeypatch):
    monkeypatch.delenv("ORGANBENCH_CACHE")
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "user"))
    monkeypatch.chdir(tmp_path)
    assert jobs.cache_folder() == tmp_path / "user" / "organbench" / "meshes"
    (tmp_path / "results").mkdir()
    assert jobs.cache_folder() == tmp_path / "results" / "cache" / "meshes"


def test_a_long_name_of_a_file_fits_into_the_cache():
    assert len(jobs.cache_path(RECIPE | {"name": "é" * 240}, {}).name.encode()) < 120
