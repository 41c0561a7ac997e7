"""Results of several machines in one folder."""

from dataclasses import replace

from studies.runs.current import case_path
from studies.store.ledger import Ledger
from studies.store.record import read_record, write_record
from studies.sweep.standings import machines_of, mixture, standings
from tests.studies.tiny import tiny_study


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
