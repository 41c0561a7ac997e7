"""An entry by file is judged from its positions alone; what does not fit the set is refused in a sentence."""

import json

import numpy as np
import pytest

from studies.exchange.league.entry_file import LEAGUE, EntryFile
from studies.exchange.league.frozen import SET, frozen
from studies.exchange.meshes import given_mesh
from studies.report.league.rows import COST, COUNT, league_rows
from studies.scene.library import BALL_SQUEEZE
from studies.store.record import read_record

NODES = 150


@pytest.fixture(scope="module")
def mesh(mesh_cache):
    return given_mesh(BALL_SQUEEZE, NODES, "straight")


@pytest.fixture
def entry(mesh, tmp_path):
    """Writes an entry, all positions squeezed with the planes, with changes; the path of its JSON file."""
    t = np.array([0.0, *BALL_SQUEEZE.checkpoints])
    factors = 1.0 - 0.1 * t / t[-1]
    np.savez(tmp_path / "mine.npz", t=t, positions=[mesh.points * [1, 1, f] for f in factors], force=t)

    def write(**changes):
        data = {
            "set": SET,
            "scene": "ball_squeeze",
            "engine": "mine",
            "version": "1.2",
            "mesh": "straight",
            "nodes": NODES,
            "mesh_sha256": frozen()["ball_squeeze"].meshes["straight-150"],
            "result": "mine.npz",
            "seconds": 0.25,
            "evaluations": 800,
            "settings": {"step": 0.005},
            "environment": {"python": "3.11"},
            "command": "mine ball_squeeze",
        }
        path = tmp_path / "mine.json"
        path.write_text(json.dumps(data | changes))
        return path

    return write


def test_an_entry_is_judged_and_becomes_a_row(organbench, entry, tmp_path):
    code, out, _ = organbench("judge", "ball_squeeze", entry(), "--results", tmp_path / "results")
    assert code == 0 and "volume_worst" in out
    (file,) = (tmp_path / "results" / "league" / "entries").glob("*.h5")
    header = EntryFile.model_validate_json(str(read_record(file).attributes[LEAGUE]))
    assert (header.engine, header.version, header.command, header.ours) == ("mine", "1.2", "mine ball_squeeze", False)
    (row,), problems = league_rows(tmp_path / "results")
    assert not problems and row["engine"] == "mine" and row["scene"] == "ball_squeeze"
    assert row["volume_worst [%]"] == pytest.approx(10.0)
    assert row[COST] == pytest.approx(0.25) and row[COUNT] == pytest.approx(800 / BALL_SQUEEZE.duration)
    assert row["reference"].startswith("2027.1 ")


def test_an_entry_that_replaces_another_one_says_so(organbench, entry, tmp_path):
    for version, replaces in (("1", False), ("2", True)):
        code, _, err = organbench("judge", "ball_squeeze", entry(version=version), "--results", tmp_path / "results")
        assert code == 0 and ("it replaces an entry named mine on the same mesh" in err) == replaces


REFUSED = {
    "another set": ({"set": "OB-2026.1"}, f"the entry is of set OB-2026.1; this version judges {SET}"),
    "another scene": ({"scene": "liver_press"}, "the entry is of liver_press, not of ball_squeeze"),
    "a foreign mesh": (
        {"mesh_sha256": 64 * "0"},
        f"mesh_sha256 of the entry is not that of straight-150 of ball_squeeze in {SET}; compute on the exported mesh",
    ),
    "another size": ({"nodes": 151}, "the mesh of the entry (straight-151) is not one of"),
    "a metric": ({"force_end": -0.1}, "mine.json hands in force_end: metrics are computed here; leave them out"),
    "metrics": ({"metrics": {"force_end": 0}}, "mine.json hands in metrics: metrics are computed here"),
    "an unknown key": ({"colour": "red"}, "mine.json: colour: extra inputs are not permitted"),
    "a wrong type": ({"seconds": "fast"}, "mine.json: seconds: input should be a valid number"),
    "a result elsewhere": ({"result": "../mine.npz"}, "must lie next to its JSON file; give its file name"),
    "an empty result": ({"result": ""}, "the result '' of the entry must lie next to its JSON file"),
    "an odd name": ({"engine": "a/b"}, "'a/b' cannot name an entry; use letters, digits, '.', '_' and '-'"),
    "no result": ({"result": "yours.npz"}, "there is no file"),
}


@pytest.mark.parametrize("what", REFUSED)
def test_what_does_not_fit_the_set_is_refused(refused, entry, tmp_path, what):
    changes, message = REFUSED[what]
    assert message in refused("judge", "ball_squeeze", entry(**changes), "--results", tmp_path / "none")
    assert not (tmp_path / "none").exists()


@pytest.mark.parametrize("name", [name for name, one in frozen().items() if one.held_back])
def test_a_scene_that_is_held_back_is_refused(refused, entry, name):
    sentence = refused("judge", name, entry(scene=name))
    assert f"{name} of {SET} is held back: nobody can enter it before its data is published" in sentence


def test_a_scene_outside_of_the_set_is_refused(refused, entry):
    assert f"spleen_sag is not in {SET}, which has ball_squeeze" in refused(
        "judge", "spleen_sag", entry(scene="spleen_sag")
    )


def test_another_rest_mesh_is_refused_though_its_hash_is_right(refused, entry, mesh, tmp_path):
    path = entry()
    t = np.array([0.0, *BALL_SQUEEZE.checkpoints])
    np.savez(tmp_path / "mine.npz", t=t, positions=[1.01 * mesh.points] * len(t))
    assert "from those of straight.vtu" in refused("judge", "ball_squeeze", path)


def test_options_that_the_file_answers_are_refused(refused, entry):
    assert "leave out --name, --force and --seconds" in refused("judge", "ball_squeeze", entry(), "--seconds", "1")


def test_a_file_that_is_no_entry_is_refused(refused, tmp_path):
    (tmp_path / "a.json").write_text("[1")
    assert "a.json cannot be read as an entry" in refused("judge", "ball_squeeze", tmp_path / "a.json")
    (tmp_path / "a.json").write_text("[]")
    assert "a.json holds no JSON object" in refused("judge", "ball_squeeze", tmp_path / "a.json")
