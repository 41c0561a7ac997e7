"""How the jobs of a study stand: counted, with a sentence for each cause, and against what the study expects."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from massspring import Free
from studies.base.errors import StudyError
from studies.catalog import STUDIES, Study
from studies.reference.reference_solves import ReferenceSolve
from studies.runs.current import case_path
from studies.runs.status import folding
from studies.scene.scene import ReferencePlan
from studies.store.ledger import Ledger
from studies.store.record import Status, read_record, write_record
from studies.sweep.job import CaseJob, ReferenceJob
from studies.sweep.standings import CAUSES, Standing, causes, machines_of, mixture, standings, summary, unexpected
from tests.studies.tiny import SQUEEZE, tiny_case, tiny_study

ROOT = Path(__file__).parents[3]
LEAST = "min_j [1]"


def standing(status, message, number=0) -> Standing:
    work = tiny_case(frames=number + 1)
    return Standing(CaseJob(Path(__file__), "tiny", work), status, message)


def test_causes_that_differ_in_numbers_are_one_sentence():
    same = [standing("failed", f"obstacle 0 starts {k}.5e-3 m inside the body", k) for k in range(3)]
    (sentence,) = causes(same)
    assert sentence == f"failed: obstacle 0 starts 0.5e-3 m inside the body ({same[0].job.label}, and 2 more)"
    many = [standing("failed", "abcdefghijkl"[k]) for k in range(CAUSES + 2)]
    assert len(causes(many)) == CAUSES + 1 and causes(many)[-1].startswith("and 2 more causes")
    assert summary([*same, standing("not-converged", "")]) == "4 cases: 3 failed, 1 not converged"


def test_a_method_that_does_not_apply_and_what_has_not_ended_are_no_failure():
    study = tiny_study(expects=())
    fine = [standing(status, "") for status in ("ok", "skipped", "stale", "missing")]
    bad = [standing(status, "") for status in Status if status not in ("ok", "skipped")]
    assert unexpected(study, [*fine, *bad]) == bad
    scene = replace(SQUEEZE, reference=ReferencePlan("octant", (0.9, 0.5), variants=()))
    reference = Standing(ReferenceJob(Path(__file__), "tiny", ReferenceSolve(scene)), "not-converged", "")
    assert unexpected(replace(study, expects=tuple(Status)), [reference]) == [reference]


def published_statuses(study: Study) -> set[str]:
    """The statuses in the published table of the study, and those that its least J would have today."""
    path = ROOT / "results/published" / study.name / f"{study.name}.csv"
    if not path.is_file():
        return set()
    table = pd.read_csv(path)
    least = table.loc[table["status"] == "ok"].get(LEAST, pd.Series(dtype=float))
    judged = set() if study.name == "stress" else {folding(np.array([each]), shaped=False)[0] for each in least}
    return {*table["status"], *judged}


def test_the_catalogue_expects_what_it_has_published():
    """No published case ends as its study does not expect, and what a study expects does happen: 60 cases of the
    stability map diverged, recoveries ended inverted or shaken, hanging spleens in accuracy, organs and literature
    inverted. The table of work_precision has no least J, but cases of accuracy that fold."""
    published = {study.name: published_statuses(study) for study in STUDIES}
    assert all(study.accepts(status) for study in STUDIES for status in published[study.name])
    expected = {study.name: set(study.expects) for study in STUDIES if study.expects}
    assert expected.keys() == {study.name for study in STUDIES} - {"frame_rate"}
    assert expected.pop("work_precision") == {"folded"}
    for name, statuses in expected.items():
        assert statuses == published[name] - {"ok", "skipped"}


def test_an_unknown_status_cannot_be_expected():
    with pytest.raises(StudyError, match="unknown status that a study expects 'divergd'; did you mean 'diverged'"):
        tiny_study(expects=("divergd",))
    with pytest.raises(StudyError, match="expects is 'diverged'; give a tuple"):
        tiny_study(expects="diverged")
    assert tiny_study(cases=(tiny_case(method=Free()),)).accepts("diverged")


def stored_by(results, case, **changes):
    """Makes the record of a case one of another machine."""
    path = case_path(results, "tiny", case)
    record = read_record(path)
    write_record(path, replace(record, **{"attributes": record.attributes, **changes}))
    return record.machine


def test_status_says_how_many_kinds_of_machines_a_study_mixes(results, tiny_file, organbench):
    study = tiny_study()
    assert mixture(machines_of(standings(Ledger(results), study))) is None, "all are of this one"
    here = stored_by(results, study.cases[0], machine="00000000")
    assert machines_of(standings(Ledger(results), study)) == {here: 2, "00000000": 1}
    shown = organbench("show", tiny_file, "--results", results)[1]
    sentence = (
        f"made on 2 kinds of processors, whose results differ by rounding: 2 of machine {here}, 1 of machine 00000000"
    )
    assert f"  {sentence}\n" in shown


def test_stale_results_do_not_count(results):
    study = tiny_study()
    stored_by(results, study.cases[0], machine="00000000", fingerprint="0")
    assert mixture(machines_of(standings(Ledger(results), study))) is None
