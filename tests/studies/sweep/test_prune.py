"""What may go, goes by the name of its rule; a current result never does."""

import os
import shutil
import time
from dataclasses import replace

import pytest

from studies.metrics.timing.cases import timing_file
from studies.runs.current import case_path
from studies.store.ledger import Ledger
from studies.store.links import link_study
from studies.store.record import Status, read_record, write_record
from studies.sweep.prune import DAY, Rule, prunable, remove
from studies.sweep.standings import standings
from tests.studies.octant import SCENE
from tests.studies.tiny import content, diverging_case, tiny_case, tiny_study

TIMED = tiny_case(timed=True)


def rules_by_name(root, study=None, rules=tuple(Rule), **options):
    """Name of a file -> the rule that lets it go."""
    return {one.path.name: one.rule for one in prunable(Ledger(root), [study or tiny_study()], rules, **options)}


def spoil(root):
    """One file for each rule; their names by rule. The last case of the study is superseded then."""
    stale, gone, lost = (case_path(root, "tiny", case) for case in tiny_study().cases)
    write_record(stale, replace(read_record(stale), fingerprint="0" * 64))
    write_record(gone, replace(read_record(gone), status=Status.TIMED_OUT))
    timing = timing_file(root, "tiny", TIMED)
    orphan = timing.with_name(f"nothing-01234567.timing.{timing.name.split('.')[-2]}.h5")
    orphan.write_bytes(timing.read_bytes())
    part = stale.with_name("a.h5.00000000-1-1.part")
    part.write_bytes(b"half")
    os.utime(part, (time.time() - 7200,) * 2)
    return {
        Rule.STALE: {stale.name, timing.name},
        Rule.FAILED: {gone.name, timing_file(root, "tiny", tiny_study().cases[1]).name},
        Rule.SUPERSEDED: {lost.name},
        Rule.ORPHANS: {orphan.name, part.name},
    }


def test_of_a_finished_study_nothing_may_go(results):
    """Also what diverged: that is a result."""
    link_study(Ledger(results), "tiny")
    assert rules_by_name(results, references=True) == {}


@pytest.mark.parametrize("rule", Rule)
def test_a_rule_names_its_files_and_no_others(results, rule):
    expected = spoil(results)
    study = tiny_study(cases=tiny_study().cases[:2])
    assert rules_by_name(results, study) == {name: rule for rule, names in expected.items() for name in names}
    before, kept = content(results / "tiny"), expected[rule]
    gone = remove(prunable(Ledger(results), [study], [rule]))
    assert {one.path.name for one in gone} == kept
    after = content(results / "tiny")
    assert {path.name for path in set(before) - set(after)} == kept and after.items() <= before.items()


def test_frame_times_of_other_code_go_alone(results):
    timing = timing_file(results, "tiny", TIMED)
    write_record(timing, replace(read_record(timing), fingerprint="0" * 64))
    assert rules_by_name(results) == {timing.name: Rule.STALE}


def test_frame_times_of_another_machine_stay(results):
    timing = timing_file(results, "tiny", TIMED)
    timing.rename(timing.with_name(timing.name.replace(timing.name.split(".")[-2], "89abcdef")))
    assert rules_by_name(results) == {}


def test_young_files_are_spared(results):
    spoil(results)
    assert rules_by_name(results, older=1.0) == {}
    part = next((results / "tiny").glob("*.part"))
    os.utime(part, (time.time() - 3 * DAY,) * 2)
    assert rules_by_name(results, older=2.0) == {part.name: Rule.ORPHANS}


def test_what_is_written_anew_meanwhile_stays(results):
    stale = case_path(results, "tiny", diverging_case())
    record = read_record(stale)
    write_record(stale, replace(record, fingerprint="0" * 64))
    listed = prunable(Ledger(results), [tiny_study()], [Rule.STALE])
    write_record(stale, record)
    assert remove(listed) == [] and stale.is_file()
    assert {standing.status for standing in standings(Ledger(results), tiny_study())} == {"ok", "diverged"}


def test_references_stay_without_the_option(solved, tmp_path):
    root = shutil.copytree(solved, tmp_path / "results")
    study = tiny_study(cases=(tiny_case(scene=SCENE),))
    assert rules_by_name(root, study, references=True) == {}
    path = next((root / "reference").glob("*.h5"))
    write_record(path, replace(read_record(path), fingerprint="0" * 64))
    coarse = replace(SCENE, reference=SCENE.reference.smaller())
    assert rules_by_name(root, study) == {}
    assert rules_by_name(root, study, references=True) == {path.name: Rule.STALE}
    fewer = rules_by_name(root, tiny_study(cases=(tiny_case(scene=coarse),)), references=True)
    assert fewer == {path.name: Rule.SUPERSEDED}
    elsewhere = replace(SCENE, name="elsewhere")
    assert rules_by_name(root, tiny_study(cases=(tiny_case(scene=elsewhere),)), references=True) == {}


def test_the_command_lists_and_removes_only_with_yes(organbench, refused, results, tiny_file):
    expected = spoil(results)
    before = content(results / "tiny")
    code, out, err = organbench("prune", tiny_file, "--results", results)
    assert (code, err) == (0, "") and "Repeat with --rule RULE --yes to delete" in out
    assert all(name in out for rule in (Rule.STALE, Rule.FAILED, Rule.ORPHANS) for name in expected[rule])
    assert content(results / "tiny") == before
    assert "name the rules" in refused("prune", tiny_file, "--yes", "--results", results)
    assert "did you mean 'stale'" in refused("prune", tiny_file, "--rule", "stall", "--results", results)
    assert "name the studies" in refused("prune", "--results", results)
    assert "name the studies" in refused("prune", tiny_file, "--all", "--results", results)
    code, out, _ = organbench("prune", tiny_file, "--rule", "orphans", "--yes", "--results", results)
    assert code == 0 and "removed 2 files" in out
    assert {p.name for p in set(before) - set(content(results / "tiny"))} == expected[Rule.ORPHANS]
    code, out, _ = organbench("prune", tiny_file, "--rule", "superseded", "--yes", "--results", results)
    assert (code, out) == (0, "nothing to remove\n")


def test_an_archive_is_not_pruned(refused, results, tiny_file):
    (results / "ro-crate-metadata.json").write_text("{}")
    assert "is an unpacked archive" in refused("prune", tiny_file, "--results", results)
