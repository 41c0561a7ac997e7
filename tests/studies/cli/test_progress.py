"""Progress on the terminal."""

import io
import time

import pytest
from rich.console import Console

from studies.cli import progress as shown
from studies.cli import terminal
from studies.cli.progress import QUIET_SECONDS, TerminalProgress, words
from studies.sweep.plan import PHYSICS, Planned


@pytest.mark.parametrize(("seconds", "text"), [(0.2, "1 s"), (80, "80 s"), (200, "3 min"), (6000, "1 h 40 min")])
def test_times_in_words(seconds, text):
    assert words(seconds) == text


def log() -> Console:
    return Console(file=io.StringIO(), width=80)


def lines(console) -> list[str]:
    return console.file.getvalue().splitlines()


def test_the_time_left_shrinks_with_every_piece():
    planned = [Planned(PHYSICS, "case", name, "missing", 60.0) for name in "abcd"]
    with TerminalProgress(log(), planned, jobs=2) as progress:
        progress.begin(PHYSICS, 4)
        assert progress.left() == "about 2 min left"
        for name in "abc":
            progress.advance(PHYSICS, name)
        assert progress.left() == "about 60 s left"
        progress.advance(PHYSICS, "d")
    assert lines(progress.console) == ["physics 4/4: d"]


def test_a_log_has_one_line_on_compiling_and_then_rests():
    console = log()
    with TerminalProgress(console) as progress:
        for name in ("free_frame", "free_frame", "other"):
            progress.compiling(name)
    assert lines(console) == ["compiling free_frame (kept for the next time)"]
    assert QUIET_SECONDS > 1


def test_a_log_hears_of_a_long_piece(monkeypatch):
    monkeypatch.setattr(terminal, "QUIET_SECONDS", 0.01)
    monkeypatch.setattr(shown, "QUIET_SECONDS", 0.0)
    console = log()
    with TerminalProgress(console) as progress:
        progress.begin(PHYSICS, 3)
        time.sleep(0.2)
    assert "physics 0/3 done, 1 s" in lines(console)
