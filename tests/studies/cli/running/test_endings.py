"""`organbench run` ends with what happened: counts, a sentence for each cause, and an exit code for what is amiss."""

from dataclasses import replace
from pathlib import Path

import pandas as pd
import pytest

from massspring import Free
from studies.base.errors import StudyError
from studies.catalog import STUDIES, Study
from studies.reference.reference_solves import ReferenceSolve
from studies.runs.current import case_path
from studies.scene.scene import ReferencePlan
from studies.store.record import Status, read_record, write_record
from studies.sweep.job import CaseJob, ReferenceJob, jobs_of
from studies.sweep.standings import CAUSES, Standing, causes, summary, unexpected
from tests.studies.tiny import SQUEEZE, diverging_case, tiny_case, tiny_study

ROOT = Path(__file__).parents[4]
FILE = """from tests.studies.tiny import tiny_study

STUDY = tiny_study({})
"""
WITH_REFERENCE = """from dataclasses import replace
from studies.scene.scene import ReferencePlan
from tests.studies.tiny import SQUEEZE, tiny_case, tiny_study

SCENE = replace(SQUEEZE, checkpoints=(1.0, 4.0), reference=ReferencePlan("octant", (0.9, 0.5), variants=()))
STUDY = tiny_study(cases=(tiny_case(scene=SCENE),){})
"""


@pytest.fixture
def file_of(tmp_path):
    """A study file with this text."""

    def write(text):
        path = tmp_path / "mine.py"
        path.write_text(text)
        return path

    return write


def put(path, **changes):
    write_record(path, replace(read_record(path), **changes))


def test_a_divergence_that_the_study_does_not_expect_is_exit_code_1(organbench, results, file_of):
    path = file_of(FILE.format("expects=()"))
    code, out, err = organbench("run", path, "--results", results)
    assert (code, err) == (1, "")
    name = diverging_case().name
    *_, counts, cause = out.splitlines()
    assert counts == "tiny: 3 cases: 2 ok, 1 diverged" and cause.startswith("  diverged: ") and f"({name})" in cause
    code, out, _ = organbench("run", path, "--results", results, "--case", tiny_case().name)
    assert code == 0 and out.splitlines()[-1] == "tiny: 1 case: 1 ok"
    code, out, _ = organbench("run", path, "--results", results, "--case", name)
    assert code == 1 and f"tiny: 1 case: 1 diverged\n{cause}" in out
    assert organbench("run", file_of(FILE.format("")), "--results", results)[0] == 0


def test_only_what_is_chosen_decides(organbench, results, file_of):
    """The failed case runs again and is ok; the one that diverged was not chosen."""
    put(case_path(results, "tiny", tiny_case()), status=Status.FAILED, message="no room")
    path = file_of(FILE.format("expects=()"))
    code, out, _ = organbench("run", path, "--results", results, "--only", "failed", "--jobs", 1)
    assert code == 0 and "tiny: 1 case ran, charts in" in out and out.splitlines()[-1] == "tiny: 1 case: 1 ok"


@pytest.mark.parametrize(("losses", "code"), [("", 1), (", counts_losses=True", 0)])
def test_a_reference_that_failed_is_exit_code_1(organbench, tmp_path, file_of, losses, code):
    plan = ReferencePlan("octant", (0.9, 0.5), variants=())
    scene = replace(SQUEEZE, checkpoints=(1.0, 4.0), reference=plan)
    for job in jobs_of(tmp_path / "r", [tiny_study(cases=(tiny_case(scene=scene),))]):
        job.store_failure("no equilibrium at 0.5 s" if job.label[:3] == "ref" else "no mesh")
    ended, out, _ = organbench("run", file_of(WITH_REFERENCE.format(losses)), "--results", tmp_path / "r")
    assert ended == code
    assert "tiny: nothing ran" in out and "tiny: 1 case: 1 failed; 1 reference solution: 1 failed" in out
    assert ("  failed: no mesh (tiny_squeeze-" in out) == (code == 1)
    assert ("  failed: no equilibrium at 0.5 s (reference tiny_squeeze)" in out) == (code == 1)


def test_status_and_run_count_alike(organbench, results, file_of):
    path = file_of(FILE.format(""))
    by_run = organbench("run", path, "--results", results)[1].splitlines()[-1]
    assert organbench("show", path, "--results", results)[1].splitlines()[0] == by_run


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
    """The statuses in the published table of the study."""
    table = ROOT / "results/published" / study.name / f"{study.name}.csv"
    return set(pd.read_csv(table)["status"]) if table.is_file() else set()


def test_the_catalogue_expects_what_it_has_published():
    """No published case ends as its study does not expect. What a study expects does happen: 60 cases of the stability
    map diverged, 19 recoveries ended inverted, hanging spleens in accuracy, organs and literature did. Only recoveries,
    whose starts are meant to break a method, may also end in ways that no published case did."""
    published = {study.name: published_statuses(study) for study in STUDIES}
    assert all(study.accepts(status) for study in STUDIES for status in published[study.name])
    expected = {study.name: set(study.expects) for study in STUDIES if study.expects}
    assert expected.keys() == {"stability_map", "stress", "accuracy", "organs", "literature"}
    assert expected.pop("stress") - published["stress"] == {"diverged", "drifted"}
    for name, statuses in expected.items():
        assert statuses == published[name] - {"ok", "skipped"}


def test_an_unknown_status_cannot_be_expected():
    with pytest.raises(StudyError, match="unknown status that a study expects 'divergd'; did you mean 'diverged'"):
        tiny_study(expects=("divergd",))
    with pytest.raises(StudyError, match="expects is 'diverged'; give a tuple"):
        tiny_study(expects="diverged")
    assert tiny_study(cases=(tiny_case(method=Free()),)).accepts("diverged")
