"""`organbench replay`: does a stored run come out the same?"""

from pathlib import Path

import typer

from studies.cli.terminal import say
from studies.runs.run import replay as replay_run


def replay(path: Path) -> None:
    """Runs exactly that case again, and says whether it came out the same (exit code 1: it did not)."""
    stored, new, difference = replay_run(path)
    if difference is None:
        say(f"{stored.name}: the same, bit for bit ({new.status})")
        return
    say(f"{stored.name}: {difference}")
    if stored.fingerprint != new.fingerprint:
        say("the code has changed since it was stored")
    if stored.machine != new.machine:
        say("it was stored on another machine")
    raise typer.Exit(1)
