"""The frozen set agrees with the code; an entry by file is judged from its positions alone, and what does not fit the
set is refused in a sentence."""

import json
from dataclasses import replace

import numpy as np
import pytest

from studies.base.errors import StudyError
from studies.exchange.league import FILE, LEAGUE, SET, EntryFile, frozen
from studies.exchange.meshes import given_mesh
from studies.lab.population.draw import member
from studies.reference.published import physics, published
from studies.report.league import COST, COUNT, league_rows
from studies.scene.library import BALL_SQUEEZE, SCENES
from studies.store.record import read_record

NODES = 150
OPEN = {name: one for name, one in frozen().items() if not one.held_back}
HELD = {name: one for name, one in frozen().items() if one.held_back}


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
            "mesh_sha256": OPEN["ball_squeeze"].meshes["straight-150"],
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


def test_an_entry_is_judged_and_becomes_a_row_until_another_one_replaces_it(organbench, entry, tmp_path):
    for version, replaces in (("1.2", False), ("2", True)):
        words = ("judge", "ball_squeeze", entry(version=version), "--results", tmp_path / "results")
        code, out, err = organbench(*words)
        assert code == 0 and "volume_worst" in out
        assert ("it replaces an entry named mine on the same mesh" in err) == replaces
    (file,) = (tmp_path / "results" / "league" / "entries").glob("*.h5")
    header = EntryFile.model_validate_json(str(read_record(file).attributes[LEAGUE]))
    assert (header.engine, header.version, header.command, header.ours) == ("mine", "2", "mine ball_squeeze", False)
    (row,), problems = league_rows(tmp_path / "results")
    assert not problems and row["engine"] == "mine" and row["scene"] == "ball_squeeze"
    assert row["volume_worst [%]"] == pytest.approx(10.0)
    assert row[COST] == pytest.approx(0.25) and row[COUNT] == pytest.approx(800 / BALL_SQUEEZE.duration)
    assert row["reference"].startswith("2027.1 ")


@pytest.mark.parametrize("end", ["skipped", "failed"])
def test_an_entry_without_a_result_is_a_row_with_its_reason(organbench, entry, tmp_path, end):
    path = entry(result="", **{end: "no planes"})
    code, out, _ = organbench("judge", "ball_squeeze", path, "--results", tmp_path / "results")
    assert code == 0 and f"mine: {end}, no planes" in out
    (row,), _ = league_rows(tmp_path / "results")
    assert (row["status"], row["message"]) == (end, "no planes") and np.isnan(row["volume_worst [%]"])


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
    "no result and no reason": ({"result": ""}, "mine.json needs one of result, skipped and failed"),
    "a result and a reason": ({"skipped": "no planes"}, "mine.json needs one of result, skipped and failed"),
    "an odd name": ({"engine": "a/b"}, "'a/b' cannot name an entry; use letters, digits, '.', '_' and '-'"),
    "no file": ({"result": "yours.npz"}, "there is no file"),
}


@pytest.mark.parametrize("what", REFUSED)
def test_what_does_not_fit_the_set_is_refused(refused, entry, tmp_path, what):
    changes, message = REFUSED[what]
    assert message in refused("judge", "ball_squeeze", entry(**changes), "--results", tmp_path / "none")
    assert not (tmp_path / "none").exists()


def test_scenes_that_are_held_back_or_not_in_the_set_are_refused(refused, entry):
    for name in HELD:
        sentence = refused("judge", name, entry(scene=name))
        assert f"{name} of {SET} is held back: nobody can enter it before its data is published" in sentence
    sentence = refused("judge", "spleen_sag", entry(scene="spleen_sag"))
    assert f"spleen_sag is not in {SET}, which has ball_squeeze" in sentence


def test_another_rest_mesh_is_refused_though_its_hash_is_right(refused, entry, mesh, tmp_path):
    path = entry()
    t = np.array([0.0, *BALL_SQUEEZE.checkpoints])
    np.savez(tmp_path / "mine.npz", t=t, positions=[1.01 * mesh.points] * len(t))
    assert "from those of straight.vtu" in refused("judge", "ball_squeeze", path)


def test_what_is_no_entry_and_options_that_it_answers_are_refused(refused, entry, tmp_path):
    assert "leave out --name, --force and --seconds" in refused("judge", "ball_squeeze", entry(), "--seconds", "1")
    for content, message in (("[1", "a.json cannot be read as an entry"), ("[]", "a.json holds no JSON object")):
        (tmp_path / "a.json").write_text(content)
        assert message in refused("judge", "ball_squeeze", tmp_path / "a.json")


def test_the_set_holds_hashes_of_five_open_and_three_held_back_scenes():
    """Of what is held back neither a seed nor a load; no two scenes share a reference or physics."""
    names = {scene.name for scene in SCENES}
    assert len(OPEN) == 5 and len(HELD) == 3 and set(OPEN) <= names and not set(HELD) & names
    hashes = json.loads(FILE.read_text())["held back"].values()
    assert all(set(one) == {"reference", "physics", "meshes"} for one in hashes)
    for kind in ("reference", "physics"):
        assert len({getattr(one, kind) for one in frozen().values()}) == len(frozen())
    for one in frozen().values():
        assert {key.split("-")[0] for key in one.meshes} == {"straight", "curved"}
        digests = [one.reference, one.physics, *one.meshes.values()]
        assert all(len(bytes.fromhex(digest)) == 32 for digest in digests) and len({*digests}) == len(digests)


@pytest.mark.parametrize("scene", [one for one in SCENES if one.name in OPEN], ids=lambda one: one.name)
def test_open_scenes_are_judged_by_the_references_that_the_set_names(scene):
    reference = published(scene)
    assert reference is not None and reference.sha256 == OPEN[scene.name].reference
    assert physics(scene) == OPEN[scene.name].physics


def test_no_member_with_a_small_seed_is_held_back():
    """The usual seeds give none of them."""
    drawn = [member(organ, seed, 0) for organ in ("liver", "kidney") for seed in (*range(4), 2026, 2027)]
    assert not {one.physics for one in HELD.values()} & {physics(scene) for scene in drawn}


@pytest.mark.parametrize("kind", ["straight", "curved"])
def test_this_machine_makes_the_mesh_of_the_set(mesh_cache, kind):
    assert given_mesh(BALL_SQUEEZE, NODES, kind).digest == OPEN["ball_squeeze"].meshes[f"{kind}-150"]


def test_a_digest_ignores_rounding_and_nothing_else(mesh):
    organ = mesh.mesh
    noise = 1e-15 * np.random.default_rng(1).normal(size=organ.points.shape)
    assert replace(mesh, mesh=replace(organ, points=organ.points + noise)).digest == mesh.digest
    for wrong in (2e-7, -2e-7):
        moved = organ.points.copy()
        moved[7, 1] += wrong
        assert replace(mesh, mesh=replace(organ, points=moved)).digest != mesh.digest
    swapped = organ.tetrahedra.copy()
    swapped[[0, 1]] = swapped[[1, 0]]
    assert replace(mesh, mesh=replace(organ, tetrahedra=swapped)).digest != mesh.digest


def test_a_damaged_set_is_refused(tmp_path):
    file = tmp_path / "OB.json"
    file.write_text(json.dumps({"open": {"ball_squeeze": {"reference": "0"}}}))
    with pytest.raises(StudyError, match=r"the frozen set OB.json cannot be read \('physics'\)"):
        frozen(file)
