"""Results of an organ from a file belong to what the file holds: it may move, and an edit makes them stale."""

import pytest

from massspring import ImplicitVolume
from studies.base.errors import StudyError
from studies.catalog import Study
from studies.meshing.scene_mesh import mesh_for
from studies.metrics.run import Run
from studies.reference.reference_solves import ReferenceSolve
from studies.runs.case import Case, case_from_json
from studies.runs.current import case_path
from studies.runs.recipes import TetrahedralBody
from studies.scene.scene import Organ, ReferencePlan
from studies.store.entry import MISSING
from studies.store.paths import key_digest
from studies.sweep.run_studies import run_studies
from tests.studies.tiny import Silent, cube, file_scene, why_stale, write_obj


def case_of(path):
    return Case(file_scene(path), TetrahedralBody(), ImplicitVolume(), frames=2)


def written(path, edge=0.1):
    points, triangles, _ = cube(2, edge)
    used = sorted(set(triangles.ravel().tolist()))
    number = {node: k for k, node in enumerate(used)}
    path.parent.mkdir(exist_ok=True)
    return write_obj(path, points[used], [[number[node] for node in row] for row in triangles.tolist()])


def test_a_moved_file_keeps_its_results_and_an_edited_one_does_not(tmp_path):
    root, path = tmp_path / "results", written(tmp_path / "here" / "box.obj")
    case = case_of(path)
    run_studies(root, [Study("own", "Does it fall?", (case,), (), ())], 1, Silent())
    assert why_stale(root, case, "own") is None
    moved = path.rename(tmp_path / "moved.obj")
    same = case_of(moved)
    assert why_stale(root, same, "own") is None
    # The record itself is read without the file, and still names where it was.
    run = Run.load(case_path(root, "own", same))
    assert run.case.scene.organ.parameters["path"] == str(path) and len(run.fields.t) == 2
    written(moved, edge=0.11)
    other = case_of(moved)
    assert why_stale(root, other, "own") == MISSING and key_digest(other.key) != key_digest(same.key)


def test_paths_of_references_follow_the_content_too(tmp_path):
    plan = ReferencePlan()
    solves = []
    for name, edge in (("a", 0.1), ("b", 0.1), ("c", 0.11)):
        scene = file_scene(written(tmp_path / name / "box.obj", edge), reference=plan)
        solves.append(ReferenceSolve(scene))
    here, there, other = solves
    assert here.path(tmp_path) == there.path(tmp_path) != other.path(tmp_path)
    assert key_digest(here.key) == key_digest(there.key) != key_digest(other.key) and here.key != there.key


def test_a_scene_is_meshed_from_the_file_that_it_was_made_for(tmp_path):
    path = written(tmp_path / "box.obj")
    scene = file_scene(path)
    assert case_from_json(case_of(path).key) == case_of(path)
    assert mesh_for(scene, 0, filled=False).volume == pytest.approx(1e-3)
    written(path, edge=0.11)
    with pytest.raises(StudyError, match=r"box\.obj has changed since the scene was made"):
        mesh_for(scene, 0)
    assert mesh_for(file_scene(path), 0, filled=False).volume == pytest.approx(1.331e-3)
    path.unlink()
    with pytest.raises(StudyError, match="there is no mesh file"):
        mesh_for(scene, 0)
    assert "sha256" not in Organ("file", {"path": str(path), "unit": "m"}).parameters
