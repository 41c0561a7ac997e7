"""The reference of a scene as a job: when it is current, its status, and the record of a path that breaks off."""

import json
import shutil
from dataclasses import replace

import numpy as np
import pytest

from reference_fem import SolveError
from studies.base.errors import StudyError
from studies.reference import solve as module
from studies.reference.load import load_reference
from studies.reference.reference_solves import ReferenceSolve, reference_solves, settings_varied
from studies.reference.solve import solve
from studies.scene.as_json import scene_from_dict, scene_to_json
from studies.scene.library import SCENES
from studies.scene.library.ball_clamped import BALL_CLAMPED
from studies.scene.scene import ReferencePlan
from studies.store.ledger import Ledger
from studies.store.record import Status, read_record
from studies.sweep import job as jobs_module
from studies.sweep.job import reference_jobs
from studies.sweep.load import load_runs
from tests.studies.octant import SCENE
from tests.studies.tiny import tiny_case, tiny_study


def is_current(root, scene):
    (job,) = reference_jobs(root, [scene])
    return Ledger(root).why(job) is None


def test_current_until_the_load_the_plan_or_the_code_changes(solved, monkeypatch):
    assert is_current(solved, SCENE)
    assert load_reference(solved, replace(SCENE, reference=None)) is None
    assert is_current(solved, replace(SCENE, damping=1.0, frames=7, title="another", quantities=("volume",)))
    for changes in (
        {"gravity": (0.0, 0.0, -9.81)},
        {"checkpoints": (1.0, 3.9)},
        {"name": "other"},
        {"reference": ReferencePlan("octant", (0.5, 0.4))},
        {"reference": replace(SCENE.reference, variants=("kappa",))},
    ):
        other = replace(SCENE, **changes)
        assert not is_current(solved, other) and ReferenceSolve(other).key != ReferenceSolve(SCENE).key
    monkeypatch.setattr(jobs_module, "fingerprint_of", lambda scene: "other")
    assert not is_current(solved, SCENE)


@pytest.mark.parametrize("changes", [{"base": 100}, {"at_contact": 1}, {"tolerance": 0.01}, {"most": 2e4}])
def test_another_plan_of_nested_meshes_is_another_reference(changes):
    other = replace(BALL_CLAMPED, reference=ReferencePlan(**changes))
    assert ReferenceSolve(other).key != ReferenceSolve(BALL_CLAMPED).key


@pytest.mark.parametrize("scene", SCENES, ids=lambda scene: scene.name)
def test_a_scene_read_back_from_a_record_has_the_same_reference(scene):
    """JSON turns the number 350 into 350.0; the solution is the same."""
    back = scene_from_dict(json.loads(scene_to_json(scene)))
    assert [one.key for one in reference_solves(back)] == [one.key for one in reference_solves(scene)]
    assert back.reference == scene.reference


def test_settings_are_varied_only_where_they_matter():
    assert settings_varied(SCENE) == ["steps", "contact", "kappa"]
    assert settings_varied(replace(SCENE, obstacles=(), probed=BALL_CLAMPED.probed)) == ["steps", "kappa"]
    assert settings_varied(replace(SCENE, reference=replace(SCENE.reference, variants=()))) == []
    assert len(reference_solves(SCENE)) == 1
    assert reference_solves(replace(SCENE, reference=None)) == []


def test_a_reference_holds_its_meshes_and_the_settings_made_better(reference):
    """Fine to coarse; all of them at both checkpoints, compared at the vertices of the coarsest."""
    assert [len(reference.meshes), list(reference.variants)] == [3, ["steps", "contact", "kappa"]]
    unknowns, sizes = ([getattr(one, name) for one in reference.meshes] for name in ("unknowns", "size"))
    assert sorted(unknowns, reverse=True) == unknowns and sorted(sizes) == sizes
    assert unknowns[0] == reference.record.attributes["unknowns"]
    assert {one.unknowns for one in reference.variants.values()} == {unknowns[-1]}
    for one in (*reference.meshes, *reference.variants.values()):
        assert one.u.shape == reference.at.points.shape and np.isfinite(one.force).all()
    np.testing.assert_array_equal(reference.meshes[0].force, reference.force)
    assert reference.at.symmetric and len(reference.at.points) < len(reference.field("nodes"))


FOLDS = "the mesh folds; refine it"


def breaks(monkeypatch, number, reached):
    """Makes a path break off after so many checkpoints: 0 of them for the first one, and so on."""
    true_path, begun = module.equilibrium_path, []

    def path(problem, times, settings):
        begun.append(times)
        if len(begun) <= number:
            return true_path(problem, times, settings)
        converged = true_path(problem, times[:reached], settings) if reached else []
        raise SolveError(FOLDS, converged=converged)

    monkeypatch.setattr(module, "equilibrium_path", path)


def test_a_path_that_breaks_off_is_stored_and_not_believed(tmp_path, monkeypatch):
    """On the second of three meshes: the solution on the first one is stored."""
    breaks(monkeypatch, number=1, reached=1)
    record = read_record(solve(tmp_path, ReferenceSolve(SCENE)))
    assert record.status == Status.NOT_CONVERGED
    assert record.message == f"on mesh 0.4: {FOLDS}" and record.attributes["steps_done"] == 1
    force = record.fields["contact_force"].values
    assert np.isfinite(force[0]).all()
    assert np.isnan(force[1]).all()
    assert record.fields["sample_unknowns"].values.tolist() == [record.fields["sample_unknowns"].values[0]]
    with pytest.raises(StudyError, match=f"not-converged: on mesh 0.4: {FOLDS}"):
        load_reference(tmp_path, SCENE)


def test_a_better_setting_that_breaks_off_is_named(tmp_path, monkeypatch):
    plan = ReferencePlan("octant", (0.9, 0.5), variants=("kappa",))
    breaks(monkeypatch, number=2, reached=0)
    record = read_record(solve(tmp_path, ReferenceSolve(replace(SCENE, reference=plan))))
    assert (record.status, record.message) == (Status.NOT_CONVERGED, f"on mesh 0.9 with other kappa: {FOLDS}")


def test_runs_are_loaded_without_a_reference_that_failed(solved, tmp_path, mesh_cache):
    from studies.runs.run import run_case

    root = shutil.copytree(solved, tmp_path / "results")
    study = tiny_study(cases=(tiny_case(scene=SCENE),))
    run_case(root, study.name, study.cases[0])
    runs, remarks = load_runs(root, study)
    assert remarks == []
    assert runs[0].reference.force[-1] > 0 and 0.0 < runs[0].reference.shape_error < 0.005
    (job,) = reference_jobs(root, [SCENE])
    job.store_failure(FOLDS)
    runs, remarks = load_runs(root, study)
    assert runs[0].reference is None
    assert len(remarks) == 1
    assert FOLDS in remarks[0]
    job.path.unlink()
    assert "no results file" in load_runs(root, study)[1][0]


@pytest.mark.parametrize(
    ("changes", "sentence"),
    [
        ({"mesh": "octant", "levels": (0.5,)}, "an octant or of a motion needs two or more levels"),
        ({"mesh": "octant"}, "needs two or more levels, or it has no error bar"),
        ({"levels": (300,), "dt": 0.1}, "needs two or more levels"),
        ({"levels": (250, 360)}, "nested reference meshes have no levels; give base, tolerance or most"),
        ({"mesh": "hollow"}, "a 'solid' or 'octant' mesh, not 'hollow'"),
        ({"base": 3}, "base = 3, .*give at least 4"),
        ({"at_contact": -1}, "at_contact = -1"),
        ({"tolerance": 0.0}, "tolerance = 0.0 and most"),
        ({"tolerance": float("nan")}, "tolerance = nan"),
        ({"most": 999.0}, "most = 999; give at least 4, 0, more than 0 and 1000"),
        ({"most": float("nan")}, "most = nan"),
    ],
)
def test_a_plan_that_makes_no_reference_is_refused(changes, sentence):
    with pytest.raises(StudyError, match=sentence):
        ReferencePlan(**changes)


def test_a_quick_look_has_fewer_unknowns_and_no_better_settings():
    plan = ReferencePlan(base=100, at_contact=0)
    quick = plan.smaller()
    assert quick.nested and (quick.base, quick.at_contact, quick.variants) == (100, 0, ())
    assert quick.most == 12e3 and quick.tolerance == 1.0 and replace(plan, most=5e3).smaller().most == 5e3
    octant = ReferencePlan("octant", (0.5, 0.4, 0.3)).smaller()
    assert not octant.nested and (octant.levels, octant.variants) == ((0.5, 0.4), ())
    moving = ReferencePlan(levels=(200, 300, 400), dt=0.1).smaller()
    assert not moving.nested and (moving.levels, moving.dt) == ((200, 300), 0.1)
