"""Results that are damaged or of something else: named, and no other case is lost."""

import re

import h5py
import pytest

from studies.metrics.timing.cases import timing_file
from studies.runs.current import case_path
from studies.store.paths import record_files
from tests.studies.tiny import tiny_case


@pytest.mark.parametrize("command", ["show", "replay"])
def test_a_file_that_is_no_result(refused, finished_sweep, tmp_path, command):
    path = tmp_path / "odd.h5"
    path.write_bytes(case_path(finished_sweep, "tiny", tiny_case()).read_bytes()[:3000])
    assert str(path) in refused(command, path)


def test_a_study_of_damaged_files_alone_is_refused(refused, tiny_file, results):
    for path in record_files(results, "tiny"):
        path.write_bytes(b"damaged")
    sentence = refused("table", tiny_file, "--results", results)
    assert f"all stored records of {tiny_file} are damaged (3); `organbench run" in sentence


@pytest.mark.parametrize("fault", ["cut off", "the key", "a field", "a number", "the timing"])
def test_one_damaged_file_costs_one_case(organbench, tiny_file, results, fault):
    path = case_path(results, "tiny", tiny_case())
    whole = path.read_bytes()
    if fault == "cut off":
        path.write_bytes(whole[:3000])
    elif fault == "the key":
        place = whole.index(b'"dt_fraction"')
        path.write_bytes(whole[:place] + b"#" + whole[place + 1 :])
    elif fault == "the timing":
        path = timing_file(results, "tiny", tiny_case(timed=True))
        path.write_bytes(path.read_bytes()[:-1])
    else:
        with h5py.File(path, "r+") as file:
            if fault == "a field":
                del file["volume"]
            else:
                file["volume"][-1, 0] *= 1.5
    code, out, err = organbench("table", tiny_file, "--results", results)
    assert code == 0 and path.name in err and len(err.splitlines()) == 1
    rows = [line for line in out.splitlines() if line.startswith(("  free ", "  implicit_volume "))]
    assert len(rows) == (3 if fault == "the timing" else 2)
    code, out, _ = organbench("show", tiny_file, "--results", results)
    assert code == 0 and (fault == "the timing" or {"1 ok", "1 stale"} < set(re.findall(r"\d \w+", out)))
    assert ("its file is damaged" in out) == (fault != "the timing")
