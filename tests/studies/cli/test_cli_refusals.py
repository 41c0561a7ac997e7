"""The command line on bad input: one sentence, exit code 2, and nothing stored is lost."""

import errno
import io
import json
import os
import re
import subprocess
import sys
import tempfile
from dataclasses import replace
from pathlib import Path

import h5py
import numpy as np
import pytest

from studies.cli import app as cli
from studies.cli.commands import list as list_command
from studies.metrics.timing.cases import timing_file
from studies.runs.current import case_path
from studies.store.paths import record_files
from studies.store.record import Status, read_record, write_record
from tests.studies.tiny import content, cube, tiny_case, write_obj

REPOSITORY = Path(__file__).parents[3]


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (("run", "volume_los"), "unknown study 'volume_los'; did you mean 'volume_loss'"),
        (("run", "volume_loss", "frame_rat"), "unknown study 'frame_rat'; did you mean 'frame_rate'"),
        (("run", "volume_loss", "--only", "failing"), "unknown filter 'failing'; did you mean 'failed'"),
        (("show", "stabilty_map"), "did you mean 'stability_map'"),
        (("table", "work-precision"), "did you mean 'work_precision'"),
        (
            ("table", "volume_loss", "--metrics", "volume_wurst"),
            "unknown metric 'volume_wurst'; did you mean 'volume_worst'",
        ),
        (("report", "frames"), "unknown study 'frames'"),
        (("safe-dt", "bal_squeeze"), "unknown scene 'bal_squeeze'; did you mean 'ball_squeeze'"),
        (
            ("safe-dt", "ball_squeeze", "--method", "implicit_vol"),
            "unknown method 'implicit_vol'; did you mean 'implicit_volume'",
        ),
        (("safe-dt", "ball_squeeze", "--body", "solid"), "unknown body 'solid'"),
        (("safe-dt", "ball_squeeze", "--nodes", "-3"), "-3"),
        (("show", "--results", "none"), "there is no folder none: run `organbench run` first"),
        (("show", "nothing.h5"), "there is no results file nothing.h5"),
        (("replay", "nothing.h5"), "there is no results file nothing.h5"),
        (("run", "nothing.py"), "there is no file nothing.py"),
        (("run", "volume_loss", "--case", "ball", "--report"), "give either --case or --report"),
        (("run", "--jobs", "0"), "invalid value for '--jobs': "),
        (("fuzz", "--cases", "-4"), "invalid value for '--cases': "),
        (("mesh", "ball", "--order", "3"), "`organbench mesh --help` lists the options"),
        (("list", "--kind"), "no such option: --kind"),
        (("list", "scene"), "unknown kind of name 'scene'; did you mean 'scenes'"),
        (("tabel",), "unknown command 'tabel'; did you mean 'table'"),
        (("table",), "missing argument 'study'; `organbench table --help` lists the options"),
        (("table", "volume_loss"), "nothing of volume_loss is stored in"),
    ],
    ids=lambda value: " ".join(value) if isinstance(value, tuple) else "",
)
def test_unknown_words_get_the_nearest_match(refused, tmp_path, monkeypatch, words, message):
    monkeypatch.setenv("ORGANBENCH_RESULTS", str(tmp_path))
    assert message in refused(*words)
    assert list(tmp_path.iterdir()) == []


def test_an_unforeseen_error_is_one_sentence_that_names_the_file_of_its_traceback(refused, monkeypatch, tmp_path):
    def unforeseen(*words, **options):
        raise TypeError("two words\nand a second line")

    monkeypatch.setattr(list_command, "Table", unforeseen)
    with pytest.raises(TypeError):
        refused("list")  # of developers, whose variable is set
    monkeypatch.setattr(cli, "TRACEBACK", "ORGANBENCH_NOT_SET")
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path))
    sentence = refused("list")
    assert sentence.startswith("organbench: failed unexpectedly: TypeError: two words; the traceback is in ")
    (file,) = tmp_path.iterdir()
    assert str(file) in sentence and "and a second line" in file.read_text() and "in unforeseen" in file.read_text()


def test_a_traceback_that_cannot_be_written_is_printed(organbench, monkeypatch, tmp_path):
    monkeypatch.setattr(list_command, "Table", lambda *words, **options: 1 / 0)
    monkeypatch.setattr(cli, "TRACEBACK", "ORGANBENCH_NOT_SET")
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path / "none"))
    code, _, err = organbench("list")
    assert code == 2 and err.startswith("Traceback")
    assert err.splitlines()[-1].startswith("organbench: failed unexpectedly: ZeroDivisionError: division by zero; ")


def test_a_file_in_the_place_of_the_results_folder(refused, tmp_path):
    (tmp_path / "afile").write_text("")
    for words in (("show",), ("table", "volume_loss"), ("report", "volume_loss"), ("advise", "ball_squeeze")):
        assert "is a file" in refused(*words, "--results", tmp_path / "afile")
    assert "is a file" in refused("run", "volume_loss", "--dry-run", "--results", os.devnull)


def test_a_study_of_which_nothing_is_stored_is_not_drawn(refused, tmp_path):
    sentence = refused("report", "volume_loss", "--results", tmp_path / "none")
    assert "nothing of volume_loss is stored" in sentence and "run `organbench run volume_loss` first" in sentence
    assert not (tmp_path / "none").exists()


def test_a_terminal_without_the_letters_shows_question_marks(organbench, monkeypatch):
    shown = io.BytesIO()
    monkeypatch.setattr(sys, "stdout", io.TextIOWrapper(shown, encoding="ascii"))
    code, _, err = organbench("list")
    assert (code, err) == (0, "")
    assert b"volume_loss" in shown.getvalue() and b"?" in shown.getvalue()


@pytest.mark.skipif(not os.path.exists("/dev/full"), reason="needs a device that is always full")
def test_output_that_is_not_taken(organbench, monkeypatch):
    with open("/dev/full", "w", encoding="utf-8") as full:
        monkeypatch.setattr(sys, "stdout", full)
        code, _, err = organbench("list")
    assert code == 2
    assert err == ("organbench: the output could not be written (No space left on device); stored results are kept\n")


def test_a_folder_that_may_not_be_entered(refused, tiny_file, results, monkeypatch):
    """The superuser may enter every folder, so the test replaces `os.stat`."""
    real_stat = os.stat

    def stat(path, *words, **more):
        if str(path).startswith(str(results / "tiny")):
            raise PermissionError(errno.EACCES, "Permission denied", str(path))
        return real_stat(path, *words, **more)

    monkeypatch.setattr(os, "stat", stat)
    for command in ("show", "run", "table"):
        assert "cannot be looked at (Permission denied): change the permissions of its folder" in refused(
            command, tiny_file, "--results", results
        )


def test_a_key_that_is_no_case_cannot_be_replayed(refused, results):
    path = case_path(results, "tiny", tiny_case())
    record = read_record(path)
    data = json.loads(record.key)
    data["body"]["noodles"] = 100
    write_record(path, replace(record, key=json.dumps(data)))
    assert "not a stored case" in refused("replay", path)


@pytest.mark.parametrize("command", [("run",), ("table", "--csv", "TARGET")])
def test_results_that_cannot_be_written(refused, tiny_file, finished_sweep, tmp_path, command):
    """A folder below a file cannot be written, not even by the superuser."""
    (tmp_path / "file").write_text("no folder")
    root = finished_sweep if command[0] == "table" else tmp_path / "file" / "below"
    target = [str(tmp_path / "file" / "t.csv") if word == "TARGET" else word for word in command[1:]]
    before = content(finished_sweep / "tiny")
    sentence = refused(command[0], tiny_file, *target, "--results", root)
    assert "can be written to" in sentence
    assert content(finished_sweep / "tiny") == before


def test_bad_meshes_fail_and_the_study_goes_on(organbench, tmp_path):
    """Open, in millimetres, not there: two failed records, one warning, and the good case among them."""
    points, triangles, _ = cube(2)
    outer = np.unique(triangles)
    box = points[outer], np.searchsorted(outer, triangles)
    write_obj(tmp_path / "good.obj", *box)
    write_obj(tmp_path / "open.obj", box[0], box[1][1:])
    write_obj(tmp_path / "large.obj", 1000 * box[0], box[1])
    file = tmp_path / "meshes.py"
    names = [str(tmp_path / f"{name}.obj") for name in ("good", "open", "large", "missing")]
    file.write_text(
        "from dataclasses import replace\nfrom studies import SurfaceBody\nfrom tests.studies.tiny import *\n"
        f"NAMES = {names!r}\n"
        "SCENES = [replace(file_scene(name), name=f'file_{k}') for k, name in enumerate(NAMES)]\n"
        "STUDY = tiny_study(cases=tuple(tiny_case(scene=s, body=SurfaceBody()) for s in SCENES))\n"
    )
    results = tmp_path / "results"
    code, out, err = organbench("run", file, "--results", results, "--jobs", 1)
    assert code == 1
    assert "tiny: 4 cases ran" in out and "tiny: 4 cases: 2 ok, 2 failed\n" in out
    assert "  failed: open.obj: the surface is open" in out and "missing.obj; check the name (file_3-" in out
    assert "large.obj: the bounding box is 100 x 100 x 100 m; if the file is in millimetres, say unit='mm'" in err
    assert "Traceback" not in err
    records = [read_record(path) for path in record_files(results, "tiny")]
    assert [record.status for record in records] == [Status.OK, Status.FAILED, Status.OK, Status.FAILED]
    assert "open.obj: the surface is open" in records[1].message
    assert "missing.obj" in records[3].message
    code, out, _ = organbench("show", file, "--results", results)
    assert "2 ok, 2 failed" in out or "2 failed, 2 ok" in out


@pytest.mark.slow
def test_from_the_shell(tmp_path):
    """The real process: exit code, and nothing but the sentence."""
    for words, code in ((["run", "volume_los"], 2), (["list"], 0)):
        done = subprocess.run(
            [sys.executable, "-m", "studies", *words], cwd=REPOSITORY, capture_output=True, text=True, timeout=120
        )
        assert done.returncode == code
        assert len(done.stderr.splitlines()) == (1 if code else 0)


def test_lines_that_the_output_does_not_take_at_the_end_are_bad_input(monkeypatch, capsys):
    """Short output waits in the buffer until the program ends."""

    class Full(io.StringIO):
        def flush(self):
            raise OSError(errno.ENOSPC, "No space left on device")

        def fileno(self):
            return os.open(os.devnull, os.O_WRONLY)

    monkeypatch.setattr(sys, "stdout", Full())
    assert cli.flushed(0) == 2 and "could not be written" in capsys.readouterr().err
    assert cli.flushed(1) == 1


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
