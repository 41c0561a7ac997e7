"""Ctrl-C at any moment: exit code 130, one sentence, and what is finished stays."""

import os
import signal
import subprocess
import sys
import time
from operator import methodcaller
from pathlib import Path

import pytest

from studies.base import interrupts
from studies.base.errors import StudyError
from studies.base.processes import run_each
from studies.cli import app as cli
from studies.geometry.mesher import process
from studies.store.ledger import Ledger
from studies.store.paths import record_files
from studies.store.record import Status, peek
from studies.sweep.run_studies import run_studies
from studies.sweep.standings import standings
from tests.studies.tiny import Silent, tiny_case, tiny_study

pytestmark = [
    pytest.mark.skipif(os.name != "posix", reason="signals and process groups"),
    pytest.mark.usefixtures("heard"),
]
REPOSITORY = Path(__file__).parents[3]
SAID = "organbench: interrupted; finished work is stored; run the same command to continue"


def press():
    os.kill(os.getpid(), signal.SIGINT)


@pytest.fixture
def heard():
    """Restores Ctrl-C's signal, which a shell's background job and its children ignore."""
    before = signal.signal(signal.SIGINT, signal.default_int_handler)
    yield
    signal.signal(signal.SIGINT, before)


class PressedInWorker:
    """A task whose process gets the signal before the main process does."""

    label = "pressed"

    def perform(self):
        press()


def test_a_worker_that_dies_of_it_first_is_an_interruption():
    with pytest.raises(KeyboardInterrupt):
        list(run_each([PressedInWorker()], 1, methodcaller("perform")))


def test_held_back_it_waits_and_is_not_lost():
    reached = False
    with pytest.raises(KeyboardInterrupt), interrupts.held_back():
        press()
        reached = True
    assert reached


@pytest.mark.parametrize(("ready", "code"), [("", 0), ("interrupts.die_quietly(); ", -signal.SIGINT)])
def test_a_process_that_starts_meanwhile_waits_until_it_is_ready(ready, code):
    program = f"import os, signal; from studies.base import interrupts; os.kill(os.getpid(), signal.SIGINT); {ready}"
    with interrupts.held_back():
        done = subprocess.run([sys.executable, "-c", program], cwd=REPOSITORY, capture_output=True, check=False)
    assert (done.returncode, done.stderr) == (code, b"")


PARENT = """
import multiprocessing, os, time
from concurrent.futures import ProcessPoolExecutor

from studies.base.interrupts import die_quietly

if __name__ == "__main__":
    pool = ProcessPoolExecutor(2, mp_context=multiprocessing.get_context("spawn"), initializer=die_quietly)
    busy, number = pool.submit(time.sleep, 600), pool.submit(os.getpid)
    number.result()
    print(*[worker.pid for worker in multiprocessing.active_children()], flush=True)
    busy.result()
"""
MESHER = (
    "import os, time; from studies.base import interrupts; interrupts.end_after(lambda: os.read(0, 1)); time.sleep(600)"
)


def alive(number):
    try:
        return Path(f"/proc/{number}/stat").read_text().rpartition(")")[2].split()[0] not in "ZX"
    except (FileNotFoundError, ProcessLookupError):
        return False


def ended(numbers, seconds=30):
    until = time.monotonic() + seconds
    while any(map(alive, numbers)) and time.monotonic() < until:
        time.sleep(0.05)
    return not any(map(alive, numbers))


@pytest.mark.skipif(not Path("/proc/self/stat").exists(), reason="no list of processes in /proc")
def test_workers_end_when_the_main_process_is_killed(tmp_path):
    """kill -9, as by a system out of memory: one worker computes, the other waits for work."""
    script = tmp_path / "parent.py"
    script.write_text(PARENT)
    environment = os.environ | {"PYTHONPATH": str(REPOSITORY)}
    main = subprocess.Popen([sys.executable, str(script)], stdout=subprocess.PIPE, text=True, env=environment)
    assert main.stdout is not None
    workers = [int(word) for word in main.stdout.readline().split()]
    assert len(workers) == 2 and all(map(alive, workers))
    main.kill()
    main.wait()
    assert ended(workers)


@pytest.mark.skipif(not Path("/proc/self/stat").exists(), reason="no list of processes in /proc")
def test_a_process_whose_parent_is_gone_before_it_listens_ends_too():
    """The mesher's way: a pipe that only the parent holds open, closed here before the process has begun."""
    with process.pipe_to_here() as reading:
        worker = subprocess.Popen([sys.executable, "-c", MESHER], cwd=REPOSITORY, stdin=reading)
        assert worker.poll() is None
    assert worker.wait(timeout=60) == 1


class Swallowing:
    """Python prints an exception inside a destructor and goes on."""

    def __del__(self):
        press()


def finished():
    pass


def left():
    raise SystemExit(0)


def refused():
    raise StudyError("the mesher ended with code -2")


def broken():
    raise RuntimeError("what a library makes of it")


@pytest.mark.filterwarnings("ignore::pytest.PytestUnraisableExceptionWarning")
@pytest.mark.parametrize("end", [finished, left, refused, broken, press, interrupts.stop_if_pressed])
def test_once_pressed_the_interrupt_is_the_only_message(end, organbench, monkeypatch):
    def app():
        Swallowing()
        end()

    monkeypatch.setattr(cli, "app", app)
    before = {number: signal.getsignal(number) for number in interrupts.SIGNALS}
    try:
        with interrupts.listening():
            code, out, err = organbench("run")
            assert signal.getsignal(signal.SIGINT) is signal.SIG_IGN
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)
    assert (code, out, err.strip()) == (130, "", SAID)


def test_sigterm_is_a_sentence_and_its_own_code(organbench, monkeypatch):
    monkeypatch.setattr(cli, "app", lambda: os.kill(os.getpid(), signal.SIGTERM))
    before = {number: signal.getsignal(number) for number in interrupts.SIGNALS}
    try:
        with interrupts.listening():
            code, out, err = organbench("run")
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)
    assert (code, out) == (143, "")
    assert err.strip() == SAID.replace("interrupted", "ended by SIGTERM")


def test_without_it_all_stays_as_it_was(organbench, monkeypatch):
    monkeypatch.setattr(cli, "app", broken)
    before = signal.getsignal(signal.SIGINT)
    with interrupts.listening(), pytest.raises(RuntimeError):
        organbench("run")
    assert signal.getsignal(signal.SIGINT) is before


def test_a_job_in_the_background_goes_on_ignoring_it():
    before = signal.signal(signal.SIGINT, signal.SIG_IGN)
    try:
        with interrupts.listening():
            press()
    finally:
        signal.signal(signal.SIGINT, before)
    assert not interrupts.pressed()


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
@pytest.mark.parametrize(("number", "code"), [(signal.SIGKILL, -signal.SIGKILL), (signal.SIGINT, 130)])
def test_killed_or_interrupted_half_way_it_goes_on_where_it_was(tmp_path, number, code):
    process = interrupted(tmp_path, number)
    _, errors = process.communicate(timeout=60)
    assert process.returncode == code
    assert number == signal.SIGKILL or errors.strip() == SAID
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
