"""First runs are estimated: unknowns and seconds predicted without a mesh, against published numbers."""

import csv
import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from studies.reference.published import fingerprint_of, published, record_of
from studies.reference.reference_solves import ReferenceSolve, reference_solves
from studies.runs.case import Case
from studies.runs.current import case_path
from studies.runs.recipes import recipe_from_dict
from studies.runs.user_code import methods_by_name
from studies.scene.library import JUDGED, SCENES
from studies.scene.scene import Organ
from studies.store.ledger import Ledger
from studies.store.machine import machine_id
from studies.store.record import read_record, write_record
from studies.sweep.estimate import (
    MESH,
    SECONDS_PER_UNKNOWN,
    case_seconds,
    run_seconds,
    solve_seconds,
    timing_seconds,
    unknowns,
)
from studies.sweep.job import jobs_of
from studies.sweep.plan import plan, rates
from tests.studies.tiny import SQUEEZE, tiny_case, tiny_study

PUBLISHED = Path(__file__).parents[3] / "results" / "published"


def rows_of(path):
    with path.open(encoding="utf-8") as file:
        return list(csv.DictReader(file))


def test_unknowns_are_predicted_from_the_plan():
    """Of the finest mesh of an octant, within 5 %; of nested meshes no more than the plan allows."""
    octants = {scene.name: scene for scene in JUDGED if scene.symmetric}
    ratios = {}
    for name, scene in octants.items():
        entry = published(scene)
        assert entry is not None, name
        ratios[name] = unknowns(ReferenceSolve(scene)) / record_of(scene, entry).attributes["unknowns"]
    assert len(ratios) == 2 and all(0.95 < ratio < 1.05 for ratio in ratios.values()), ratios
    nested = [scene for scene in JUDGED if scene.reference.nested]
    assert len(nested) > 5
    assert all(unknowns(ReferenceSolve(scene)) == scene.reference.most for scene in nested)


def published_runs():
    """(case, seconds of its steps) of every timed row of the table of accuracy whose method has its usual settings."""
    scenes = {scene.name: scene for scene in SCENES}
    for row in rows_of(PUBLISHED / "accuracy" / "accuracy.csv"):
        if row["scene"] not in scenes or not row["step_time [µs]"] or " " in row["method"]:
            continue
        body = recipe_from_dict({"kind": "tetrahedral"} | json.loads(row["recipe"]).get("body", {}))
        method = methods_by_name()[row["method"]]()
        case = Case(scenes[row["scene"]], body, method, dt_fraction=float(row["dt/dt_c"]))
        yield case, float(row["step_time [µs]"]) * 1e-3 * case.scene.duration / float(row["dt [ms]"])


def test_seconds_of_runs_are_those_that_were_published():
    """Half of them within a factor of 1.6, nine in ten within 4, all together within a third."""
    measured, predicted = np.array([(seconds, run_seconds(case)) for case, seconds in published_runs()]).T
    off = np.abs(np.log(predicted / measured))
    assert len(off) > 100 and np.median(off) < np.log(1.6) and np.quantile(off, 0.9) < np.log(4.0)
    assert predicted.sum() == pytest.approx(measured.sum(), rel=1 / 3)


def test_a_reference_costs_by_its_unknowns_and_a_motion_by_its_steps():
    still, moving = SCENES[3], SCENES[2]
    (solve,) = reference_solves(still)
    assert solve_seconds(solve) == pytest.approx(SECONDS_PER_UNKNOWN * unknowns(solve))
    slower = replace(moving, duration=2 * moving.duration)
    assert solve_seconds(ReferenceSolve(slower)) == pytest.approx(2 * solve_seconds(ReferenceSolve(moving)))


def test_rates_are_those_of_this_machine(results):
    study = tiny_study()
    jobs = jobs_of(results, [study])
    measured = rates(Ledger(results), jobs)["case"]
    stored = [read_record(job.path).attributes["seconds"] for job in jobs]
    assert measured == pytest.approx(sum(stored) / sum(case_seconds(job.work) for job in jobs))
    path = case_path(results, "tiny", tiny_case())
    path.unlink()
    (piece, *_) = plan(Ledger(results), study)
    assert piece.here and piece.guess > 0
    for job in jobs[1:]:
        write_record(job.path, replace(read_record(job.path), machine="0" * len(machine_id())))
    assert rates(Ledger(results), jobs) == {}, "what another machine stored says nothing of this one"


def test_the_rate_of_references_is_that_of_all_that_this_machine_has_solved(tmp_path):
    job = jobs_of(tmp_path, [tiny_study(cases=(tiny_case(scene=SCENES[0]),))])[0]
    path = job.store_failure("no mesh")
    assert rates(Ledger(tmp_path), []) == {}, "what failed at once has no rate"
    solved = read_record(path)
    solved = replace(solved, fingerprint="code", attributes={**solved.attributes, "unknowns": 1000, "seconds": 4.0})
    write_record(path, solved)
    assert rates(Ledger(tmp_path), []) == {"reference": pytest.approx(4.0 / (1000 * SECONDS_PER_UNKNOWN))}
    write_record(path, replace(solved, machine="0" * len(machine_id())))
    assert rates(Ledger(tmp_path), []) == {}, "another machine solved it"
    write_record(path, replace(solved, fingerprint=fingerprint_of(SCENES[0])))
    assert rates(Ledger(tmp_path), []) == {}, "it is published, and was copied"


def test_an_organ_that_cannot_be_read_fails_at_once():
    case = tiny_case(scene=replace(SQUEEZE, organ=Organ("file", {"path": "nowhere.stl", "unit": "m"})))
    assert (case_seconds(case), timing_seconds(case)) == (MESH, 0.0)
