"""`organbench run`: what runs and what is timed again, how it ends, and what does not go together."""

from dataclasses import replace

import pytest

from studies.metrics.timing import cases as timed
from studies.metrics.timing.cases import timing_file
from studies.runs.current import case_path
from studies.scene.scene import ReferencePlan
from studies.store.archived import CRATE
from studies.store.ledger import Ledger
from studies.store.record import Status, read_record, write_record
from studies.sweep.executor import Silent
from studies.sweep.frame_times import measure_again
from studies.sweep.job import jobs_of
from studies.sweep.local import Local
from studies.sweep.plan import AGAIN, TIMING, plan_again
from tests.studies.tiny import SQUEEZE, content, diverging_case, tiny_case, tiny_study

FILE = """from tests.studies.tiny import tiny_study

STUDY = tiny_study({})
"""
WITH_REFERENCE = """from dataclasses import replace
from studies.scene.scene import ReferencePlan
from tests.studies.tiny import SQUEEZE, tiny_case, tiny_study

SCENE = replace(SQUEEZE, checkpoints=(1.0, 4.0), reference=ReferencePlan("octant", (0.9, 0.5), variants=()))
STUDY = tiny_study(cases=(tiny_case(scene=SCENE),){})
"""
OWN = "from massspring import Sphere\nfrom studies.catalog import Chart\nfrom tests.studies.tiny import *\n"
OWN += "SUNK = Sphere((0, 0, 0.02), 0.01)\n"
KEPT = tiny_case(timed=True)


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


WRONG = {
    "equal frames of 4 s ends at the checkpoints (0.333, 4.0) s; round these": (
        "cases=(tiny_case(scene=replace(SQUEEZE, checkpoints=(0.333, 4.0))),)"
    ),
    "obstacle 0 starts 40 mm inside": "cases=(tiny_case(scene=replace(SQUEEZE, obstacles=(SUNK,))),)",
    "unknown metric 'volume_wort'": "columns=('volume_wort',)",
    "'../elsewhere' cannot name a study": "name='../elsewhere'",
    "there is no function 'nowhere.at_all:draw'": "charts=(Chart('a.png', 'nowhere.at_all:draw'),)",
    "no function 'studies.plots.laws:drow'": "charts=(Chart('a.png', 'studies.plots.laws:drow'),)",
    "is not a function; give one of": "charts=(Chart('a.png', 'studies.plots.volume_history:__name__'),)",
}


@pytest.mark.parametrize("words", WRONG)
def test_what_cannot_be_meant_is_one_sentence_before_any_mesh(refused, file_of, tmp_path, monkeypatch, words):
    monkeypatch.setattr(Local, "map", lambda *words, **more: pytest.fail("it began to run"))
    path = file_of(f"{OWN}STUDY = tiny_study({WRONG[words]})\n")
    for options in (("--dry-run",), ()):
        assert words in refused("run", path, "--results", tmp_path / "results", *options)
    assert not (tmp_path / "results").exists()


def test_a_study_that_expects_failures_is_not_held_up(organbench, file_of, tmp_path):
    """A population draws its scenes at random: one that cannot start is a failed case of it."""
    scene = next(iter(WRONG.values()))
    path = file_of(f"{OWN}STUDY = tiny_study({scene}, expects=('failed',))\n")
    code, out, err = organbench("run", path, "--results", tmp_path / "results", "--dry-run")
    assert (code, err) == (0, "") and "1 case would run" in out


def test_a_dry_run_with_a_missing_mesh_file_is_refused(refused, file_of, tmp_path):
    path = file_of(f"{OWN}STUDY = tiny_study(cases=(tiny_case(scene=file_scene('none.stl')),))\n")
    assert "there is no mesh file none.stl" in refused("run", path, "--dry-run", "--results", tmp_path / "results")


def changed(before, after):
    """Names of records and frame times that are new or others."""
    return {path.name for path in after if path.suffix == ".h5" and before.get(path) != after[path]} - {"tiny.h5"}


@pytest.fixture
def quick(monkeypatch):
    """One repeat each."""
    monkeypatch.setattr(timed, "REPEATS", 1)


def test_all_times_are_new_and_no_run_is(organbench, tiny_file, results, quick):
    before = content(results / "tiny")
    code, out, _ = organbench("run", tiny_file, "--results", results, "--again", "timing")
    after = content(results / "tiny")
    timings = {timing_file(results, "tiny", case) for case in tiny_study().cases[:2]}
    assert code == 0 and "tiny: 2 stored cases were timed again" in out
    assert changed(before, after) == {path.name for path in timings}
    assert {read_record(path).fields["frame_ns"].values.shape[0] for path in timings} == {1}


def test_a_dry_run_says_what_and_how_long_and_times_nothing(organbench, tiny_file, results):
    before = content(results / "tiny")
    code, out, _ = organbench("run", tiny_file, "--results", results, "--again", "timing", "--dry-run")
    assert code == 0 and "tiny: 2 timings would run" in out and f"2 timings ({AGAIN}): about" in out
    assert content(results / "tiny") == before
    assert [(piece.stage, piece.label) for piece in plan_again(Ledger(results), tiny_study())] == [
        (TIMING, case.name) for case in tiny_study().cases[:2]
    ]


def test_what_is_stale_broke_off_or_is_missing_is_not_timed(organbench, tiny_file, results):
    path = case_path(results, "tiny", KEPT)
    write_record(path, replace(read_record(path), fingerprint="0"))
    other = tiny_study().cases[1]
    assert [piece.label for piece in plan_again(Ledger(results), tiny_study())] == [other.name]
    path = case_path(results, "tiny", other)
    write_record(path, replace(read_record(path), status=Status.DIVERGED))
    assert plan_again(Ledger(results), tiny_study()) == [] and diverging_case() in tiny_study().cases
    before = content(results / "tiny")
    code, out, _ = organbench("run", tiny_file, "--results", results, "--again", "timing")
    assert code == 0 and "no stored case of this code can be timed" in out
    assert content(results / "tiny") == before


def test_old_times_stay_where_the_new_ones_are_not_whole(results, monkeypatch):
    """An interruption in the second case: the first is new, the second as before, and nothing half is left."""
    monkeypatch.setattr(timed, "REPEATS", 1)
    before, written = content(results / "tiny"), []
    write = timed.write_timing

    def second_fails(root, study, case, timing, seconds):
        if written:
            raise KeyboardInterrupt
        written.append(timing_file(root, study, case).name)
        write(root, study, case, timing, seconds)

    monkeypatch.setattr(timed, "write_timing", second_fails)
    with pytest.raises(KeyboardInterrupt):
        measure_again(Ledger(results), tiny_study(), Silent(), lambda name: None)
    assert changed(before, content(results / "tiny")) == set(written) and len(written) == 1


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (("--again", "timings"), "unknown value of --again 'timings'; did you mean 'timing'"),
        (("--again", "timing", "--only", "failed"), "leave out --only"),
        (("--again", "timing", "--on", "local:2"), "leave out --on"),
    ],
    ids=lambda value: " ".join(value) if isinstance(value, tuple) else "",
)
def test_what_does_not_go_together_is_one_sentence(refused, tiny_file, results, words, message):
    before = content(results / "tiny")
    assert message in refused("run", tiny_file, "--results", results, *words)
    assert content(results / "tiny") == before


def test_an_archive_stays_as_it_is(refused, tiny_file, results):
    (results / CRATE).write_text("{}")
    assert "is an unpacked archive" in refused("run", tiny_file, "--results", results, "--again", "timing")
