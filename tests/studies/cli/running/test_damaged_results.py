"""Results that are damaged or of something else: named, and no other case is lost."""

import re
from pathlib import Path

import h5py
import numpy as np
import pytest

from studies.metrics.timing.cases import timing_file
from studies.runs.current import case_path
from studies.store.paths import record_files
from tests.studies.tiny import tiny_case


def damage(kind, good: bytes, path: Path):
    if kind == "foreign":
        with h5py.File(path, "w") as file:
            file["x"] = np.arange(3)
    elif kind == "old schema":
        path.write_bytes(good)
        with h5py.File(path, "r+") as file:
            file.attrs["schema"] = 0
    else:
        path.write_bytes({"cut off": good[: len(good) // 2], "text": b"volume 1.0\n", "empty": b""}[kind])
    return path


@pytest.mark.parametrize("kind", ["cut off", "foreign", "text", "empty", "old schema"])
@pytest.mark.parametrize("command", ["show", "replay"])
def test_a_file_that_is_no_result(refused, finished_sweep, tmp_path, kind, command):
    good = case_path(finished_sweep, "tiny", tiny_case()).read_bytes()
    path = damage(kind, good, tmp_path / "odd.h5")
    assert str(path) in refused(command, path)


def test_a_cut_off_file_hides_no_other(organbench, tiny_file, results):
    path = case_path(results, "tiny", tiny_case())
    path.write_bytes(path.read_bytes()[:3000])
    code, out, err = organbench("table", tiny_file, "--results", results)
    assert code == 0
    assert len(err.splitlines()) == 1
    assert path.name in err
    assert "free" in out


def test_a_study_of_damaged_files_alone_is_refused(refused, tiny_file, results):
    for path in record_files(results, "tiny"):
        path.write_bytes(b"damaged")
    sentence = refused("table", tiny_file, "--results", results)
    assert f"all stored records of {tiny_file} are damaged (3); `organbench run" in sentence


@pytest.mark.parametrize("name", ["tiny.csv", "tiny.h5"])
def test_only_results_files_are_to_be_deleted(refused, tmp_path, name):
    (tmp_path / name).write_text("a,b\n")
    assert ("delete it" in refused("show", tmp_path / name)) == name.endswith(".h5")


@pytest.mark.parametrize("fault", ["the key", "a field", "a number", "the timing"])
def test_one_damaged_file_costs_one_case(organbench, tiny_file, results, fault):
    path = case_path(results, "tiny", tiny_case())
    whole = path.read_bytes()
    if fault == "the key":
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
