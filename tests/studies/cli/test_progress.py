"""Progress on the terminal."""

import io
import time
from functools import partial

import pytest
from rich.console import Console

from studies.base.doing import doing
from studies.base.processes import run_each
from studies.cli import progress as shown
from studies.cli import terminal
from studies.cli.progress import QUIET_SECONDS, TerminalProgress, words
from studies.sweep.local import begin
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
            progress.hear(name)
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


def say_it(what: str) -> None:
    doing(what)


def test_a_log_says_what_is_waited_for_here_and_in_other_processes(monkeypatch):
    monkeypatch.setattr(terminal, "QUIET_SECONDS", 0.01)
    monkeypatch.setattr(shown, "QUIET_SECONDS", 0.0)
    console, here, there = log(), "frame times of liver", "reference of liver: mesh 3 of 5, 40,000 unknowns"
    with TerminalProgress(console) as progress:
        progress.begin(PHYSICS, 1)
        doing(here)
        time.sleep(0.1)
        list(run_each([there], 1, say_it, partial(begin, ()), {}, progress.hear))
        time.sleep(0.1)
        progress.advance(PHYSICS, "liver")
        time.sleep(0.1)
    said = [line.partition(" s: ")[2] for line in lines(console) if " done, " in line]
    assert [text for k, text in enumerate(said) if k == 0 or text != said[k - 1]] in (
        [here, there, ""],
        ["", here, there, ""],
    )
    doing("nothing waits any more")
    assert len(lines(console)) == len(said) + 1


def test_a_command_that_takes_long_says_what_it_does(monkeypatch, capsys):
    monkeypatch.setattr(terminal, "QUIET_SECONDS", 0.01)
    with terminal.busy("reading [the] records"):
        doing("liver-550")
        time.sleep(0.1)
    assert "reading [the] records: liver-550, 0 s" in capsys.readouterr().err.splitlines()
