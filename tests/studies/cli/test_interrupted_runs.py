"""A run that is interrupted or killed goes on where it was."""

import os
import signal
import subprocess
import sys
import time

import pytest

from studies.store.ledger import Ledger
from studies.store.paths import record_files
from studies.store.record import Status, peek
from studies.sweep.run_studies import run_studies
from studies.sweep.standings import standings
from tests.studies.cli.test_interrupts import REPOSITORY, SAID
from tests.studies.tiny import Silent, tiny_case, tiny_study

pytestmark = [
    pytest.mark.skipif(os.name != "posix", reason="signals and process groups"),
    pytest.mark.usefixtures("heard"),
]
SLOW_STUDY = """
from tests.studies.tiny import tiny_case, tiny_study

STUDY = tiny_study(name="slow", cases=tuple(tiny_case(dt_fraction=0.004 + 1e-5 * k) for k in range(3)))
"""
"""Three cases of about half a second: time enough to be interrupted between the first and the last."""


AT_EVENT = """
import os, signal, sys

moment, count = int(sys.argv.pop(1)), 0

def press(event, arguments):
    global count
    count += 1
    if count == moment:
        os.kill(os.getpid(), signal.SIGINT)

from studies import __main__ as entry

sys.addaudithook(press)
entry.main()
"""
"""The command line, interrupted at an event (import, file opened, process started ...) of a given number."""


def interrupted(tmp_path, number) -> subprocess.Popen:
    """`organbench run` of three slow cases, sent signal `number` after the first is stored; results below tmp_path."""
    file = tmp_path / "slow_study.py"
    file.write_text(SLOW_STUDY)
    words = ["run", str(file), "--results", str(tmp_path / "results"), "--jobs", "1"]
    command = [sys.executable, "-m", "studies", *words]
    process = subprocess.Popen(
        command, cwd=REPOSITORY, text=True, stdout=subprocess.PIPE, stderr=subprocess.PIPE, start_new_session=True
    )
    until = time.monotonic() + 300  # compiling comes first; only a sweep that is stuck needs so long
    while not record_files(tmp_path / "results", "slow") and process.poll() is None and time.monotonic() < until:
        time.sleep(0.02)
    os.killpg(process.pid, number)
    return process


def finish(tmp_path):
    """What was stored by then, byte for byte; the second run does exactly the rest."""
    folder, total = tmp_path / "results" / "slow", 3
    kept = {path.name: path.read_bytes() for path in record_files(tmp_path / "results", "slow")}
    assert 1 <= len(kept) < total
    assert {peek(folder / name).status for name in kept} == {Status.OK}
    study = tiny_study(name="slow", cases=tuple(tiny_case(dt_fraction=0.004 + 1e-5 * k) for k in range(3)))
    assert run_studies(tmp_path / "results", [study], 1, Silent()) == total - len(kept)
    assert kept.items() <= {path.name: path.read_bytes() for path in folder.iterdir()}.items()
    assert [standing.status for standing in standings(Ledger(tmp_path / "results"), study)] == ["ok"] * total


@pytest.mark.campaign
def test_killed_half_way_goes_on_where_it_was(tmp_path):
    process = interrupted(tmp_path, signal.SIGKILL)
    process.communicate(timeout=60)
    assert process.returncode == -signal.SIGKILL
    finish(tmp_path)


@pytest.mark.campaign
def test_ctrl_c_half_way_goes_on_where_it_was(tmp_path):
    process = interrupted(tmp_path, signal.SIGINT)
    _, errors = process.communicate(timeout=60)
    assert process.returncode == 130
    assert errors.strip() == SAID
    finish(tmp_path)


@pytest.mark.slow
@pytest.mark.parametrize("moment", [1, 1_000, 3_000])
def test_from_the_first_word_to_the_last_timing(moment, tiny_file, tmp_path):
    root = tmp_path / "results"
    words = [str(moment), "run", str(tiny_file), "--results", str(root), "--jobs", "1"]
    done = subprocess.run(
        [sys.executable, "-c", AT_EVENT, *words], cwd=REPOSITORY, capture_output=True, text=True, check=False
    )
    assert done.returncode == 130
    assert done.stderr.strip() == SAID
    assert {peek(path).status for path in record_files(root, "tiny")} <= {Status.OK, Status.DIVERGED}
