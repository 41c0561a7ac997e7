"""The pieces of a reference: when they are current, how they stand, what a crash or a path that breaks off leaves."""

import json
import shutil
from dataclasses import replace

import numpy as np
import pandas as pd
import pytest

from reference_fem import SolveError
from studies.base.errors import StudyError
from studies.reference import solve as module
from studies.reference.load import load_reference
from studies.reference.reference_solves import ReferenceSolve, reference_solves
from studies.reference.solve import solve
from studies.report.references import refresh_uncertainty
from studies.scene.as_json import scene_from_dict, scene_to_json
from studies.scene.library import SCENES, ReferencePlan
from studies.scene.library.ball_clamped import BALL_CLAMPED
from studies.store.ledger import Ledger
from studies.store.record import Status, read_record
from studies.sweep import job as jobs_module
from studies.sweep.load import References, load_runs
from studies.sweep.standings import solve_standing
from tests.studies.octant import LEVELS, SCENE
from tests.studies.tiny import tiny_case, tiny_study


def is_current(root, reference_solve):
    return Ledger(root).why(jobs_module.ReferenceJob(root, "", reference_solve)) is None


def test_current_until_the_load_or_the_code_changes(solved, monkeypatch):
    reference_solve = ReferenceSolve(SCENE, LEVELS[0])
    assert is_current(solved, reference_solve)
    renamed_metric = replace(SCENE, damping=1.0, frames=7, title="another", quantities=("volume",))
    other_family = replace(renamed_metric, reference=ReferencePlan("octant", (0.5, 0.1), variants=()))
    assert is_current(solved, ReferenceSolve(other_family, LEVELS[0]))
    assert ReferenceSolve(replace(SCENE, gravity=(0.0, 0.0, -9.81)), 0.5).key != reference_solve.key
    assert ReferenceSolve(SCENE, 0.5, "kappa").key != reference_solve.key
    assert not is_current(solved, ReferenceSolve(replace(SCENE, checkpoints=(1.0, 3.9)), LEVELS[0]))
    monkeypatch.setattr(jobs_module, "reference_fingerprint", lambda: "other")
    assert not is_current(solved, reference_solve)


def test_a_mesh_is_the_same_in_every_plan_that_halves_it_as_often():
    each = replace(BALL_CLAMPED, reference=ReferencePlan("solid", (150, 230, 350), at_outlines=(1, 2, 3)))
    alike = replace(BALL_CLAMPED, reference=ReferencePlan("solid", (230, 400), at_outlines=2))
    assert ReferenceSolve(each, 230).key == ReferenceSolve(alike, 230).key
    assert ReferenceSolve(each, 150).key != ReferenceSolve(replace(each, reference=alike.reference), 150).key
    smoke = each.reference.coarsest(2)
    assert (smoke.levels, smoke.at_outlines, smoke.at_contact) == ((150, 230), (1, 2), 0)


@pytest.mark.parametrize("scene", SCENES, ids=lambda scene: scene.name)
def test_a_scene_read_back_from_a_record_has_the_same_pieces(scene):
    """JSON turns the level 350 into 350.0; the solution is the same."""
    back = scene_from_dict(json.loads(scene_to_json(scene)))
    assert [piece.key for piece in reference_solves(back)] == [piece.key for piece in reference_solves(scene)]


@pytest.mark.parametrize("times", [(1, 2), (1, 2, 3, 4), (0, -1, 2), -1])
def test_a_plan_says_for_each_of_its_meshes_how_often_to_halve(times):
    with pytest.raises(StudyError, match="one for each mesh"):
        ReferencePlan("solid", (150, 230, 350), at_outlines=times)
    with pytest.raises(StudyError, match="one for each mesh"):
        ReferencePlan("solid", (150, 230, 350), at_contact=times)


def test_settings_are_varied_only_where_they_matter():
    assert [reference_solve.variant for reference_solve in reference_solves(SCENE)] == [
        "",
        "",
        "",
        "steps",
        "contact",
        "kappa",
    ]
    assert {reference_solve.level for reference_solve in reference_solves(SCENE) if reference_solve.variant} == {
        LEVELS[0]
    }
    untouched = replace(SCENE, obstacles=(), probed=BALL_CLAMPED.probed)
    assert [reference_solve.variant for reference_solve in reference_solves(untouched)] == [
        "",
        "",
        "",
        "steps",
        "kappa",
    ]
    assert reference_solves(replace(SCENE, reference=None)) == []


def listed(root):
    return [solve_standing(Ledger(root), reference_solve) for reference_solve in reference_solves(SCENE)]


def states(root):
    return [row.state for row in listed(root)]


def test_listing_says_how_every_piece_stands(solved, tmp_path, monkeypatch):
    root = shutil.copytree(solved, tmp_path / "results")
    ReferenceSolve(SCENE, LEVELS[1]).path(root).unlink()
    damaged = ReferenceSolve(SCENE, LEVELS[0], "kappa").path(root)
    damaged.write_bytes(damaged.read_bytes()[:500])
    whole = listed(solved)
    assert states(solved) == ["ok"] * 6
    assert [row.steps for row in whole] == [2] * 6
    assert all(row.seconds > 0 for row in whole)
    assert sorted(unknowns := [row.unknowns for row in whole[:3]]) == unknowns
    assert states(root) == ["ok", "missing", "ok", "ok", "ok", "unreadable"]
    assert [row.unknowns for row in listed(root) if row.state in ("missing", "unreadable")] == [None, None]
    monkeypatch.setattr(jobs_module, "reference_fingerprint", lambda: "other")
    assert states(solved) == ["stale"] * 6


def test_error_bars_are_written_once_and_again_when_a_reference_changes(solved, tmp_path, found):
    root = shutil.copytree(solved, tmp_path / "results")
    table, chart = refresh_uncertainty(
        References(Ledger(root)), [SCENE, SCENE, replace(SCENE, name="bare", reference=None)]
    )
    rows = pd.read_csv(table)
    assert rows["quantity"].tolist() == list(found.total_uncertainty)
    shares = rows[["mesh [%]", "steps [%]", "contact [%]", "kappa [%]"]].to_numpy()
    np.testing.assert_allclose(np.linalg.norm(shares, axis=1), rows["uncertainty [%]"], rtol=1e-5)
    assert rows["uncertainty [%]"][0] == pytest.approx(100 * found.total_uncertainty["force"], rel=1e-5)
    assert chart.read_bytes()[:4] == b"\x89PNG"
    chart.write_bytes(b"old")
    refresh_uncertainty(References(Ledger(root)), [SCENE])
    assert chart.read_bytes() == b"old"
    solve(root, ReferenceSolve(SCENE, LEVELS[0]))
    refresh_uncertainty(References(Ledger(root)), [SCENE])
    assert chart.read_bytes()[:4] == b"\x89PNG"
    assert refresh_uncertainty(References(Ledger(tmp_path / "empty")), [SCENE]) == []


class Killed(BaseException):
    """What a process that dies leaves behind: nothing is caught, nothing tidied."""


def test_a_crash_half_way_costs_no_finished_step(solved, tmp_path, monkeypatch):
    """The second load step dies; the next run starts at the first one's end and finds the same."""
    reference_solve, true_path, starts = ReferenceSolve(SCENE, LEVELS[0]), module.equilibrium_path, []

    def dies(problem, times, settings, on_checkpoint, resume):
        def then_die(checkpoint):
            on_checkpoint(checkpoint)
            raise Killed

        return true_path(problem, times, settings, on_checkpoint=then_die, resume=resume)

    def watched(problem, times, settings, on_checkpoint, resume):
        starts.append(len(resume.path) if resume else 0)
        return true_path(problem, times, settings, on_checkpoint=on_checkpoint, resume=resume)

    monkeypatch.setattr(module, "equilibrium_path", dies)
    with pytest.raises(Killed):
        solve(tmp_path, reference_solve)
    assert states(tmp_path) == ["half-way", *["missing"] * 5]
    assert listed(tmp_path)[0].steps == 1
    monkeypatch.setattr(module, "equilibrium_path", watched)
    again, whole = read_record(solve(tmp_path, reference_solve)), read_record(reference_solve.path(solved))
    assert starts == [1]
    assert again.status == Status.OK
    for name in ("displacement", "contact_force", "pressure"):
        known = whole.fields[name].values
        # The factorisation may order its sums by the first matrix it sees: rounding, not Newton's tolerance of 1e-6.
        np.testing.assert_allclose(again.fields[name].values, known, rtol=0, atol=1e-9 * np.abs(known).max())
    assert states(tmp_path)[0] == "ok"
    assert not list(tmp_path.rglob("*.steps"))


def broken(problem, times, settings, **_):
    raise SolveError("no equilibrium found between t = 1 s and t = 4 s: the mesh folds; refine it", converged=[])


def test_a_path_that_breaks_off_is_stored_and_not_believed(solved, tmp_path, monkeypatch):
    root = shutil.copytree(solved, tmp_path / "results")
    true_path = module.equilibrium_path

    def half(problem, times, settings, **_):
        raise SolveError("the mesh folds; refine it", converged=true_path(problem, times[:1], settings))

    monkeypatch.setattr(module, "equilibrium_path", half)
    record = read_record(solve(root, ReferenceSolve(SCENE, LEVELS[1])))
    assert record.status == Status.NOT_CONVERGED
    assert "mesh folds" in record.message
    force = record.fields["contact_force"].values
    assert np.isfinite(force[0]).all()
    assert np.isnan(force[1]).all()
    with pytest.raises(StudyError, match="not-converged: the mesh folds; refine it"):
        load_reference(root, SCENE)


def test_runs_are_loaded_without_a_reference_that_failed(solved, tmp_path, monkeypatch, mesh_cache):
    from studies.runs.run import run_case

    root = shutil.copytree(solved, tmp_path / "results")
    study = tiny_study(cases=(tiny_case(scene=SCENE),))
    run_case(root, study.name, study.cases[0])
    runs, remarks = load_runs(root, study)
    assert remarks == []
    assert runs[0].reference.force[-1] > 0
    monkeypatch.setattr(module, "equilibrium_path", broken)
    solve(root, ReferenceSolve(SCENE, LEVELS[1]))
    runs, remarks = load_runs(root, study)
    assert runs[0].reference is None
    assert len(remarks) == 1
    assert "not-converged" in remarks[0]
    ReferenceSolve(SCENE, LEVELS[0]).path(root).unlink()
    assert "no results file" in load_runs(root, study)[1][0]


def test_no_plan_no_reference(tmp_path):
    assert load_reference(tmp_path, replace(SCENE, reference=None)) is None
    with pytest.raises(StudyError, match="two levels"):
        ReferencePlan("octant", (0.5,))
