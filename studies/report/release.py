"""`python -m studies.report.release`: everything that is published, made by this commit on this machine, and published.

It takes hours. Current results are not made again, so the same command continues after an interruption.
"""

import shlex
import subprocess
import sys
from collections.abc import Sequence
from dataclasses import dataclass
from importlib.util import find_spec
from pathlib import Path
from typing import Annotated

import typer

from studies.base.errors import StudyError
from studies.catalog import STUDIES, Study
from studies.report.publish import APART, EXTRAS, KEPT, LEAGUE, PUBLISHED, REFERENCES, SWEEP, is_current
from studies.report.published_code import FILE
from studies.report.summaries import SUMMARIES
from studies.store.ledger import Ledger
from studies.sweep.find_study import find_study
from studies.sweep.plan import expected, plan

JOBS = 2
"""Processes of a study."""
MINUTES = {
    "make study-league": 30.0,
    "python -m studies.exchange.peers.main --sweep": 15.0,
    "python -m studies.lab.verify": 20.0,
    "organbench report --figures": 5.0,
    "make fuzz": 30.0,
    "python -m studies.tools.silicone.main": 10.0,
}
"""Approximate minutes on two otherwise idle cores; the time of a study follows from its cases."""
FEW_MINUTES = 1.0
"""Of any other command."""
CODE = ("massspring", "reference_fem", "studies", "pyproject.toml", "constraints.txt", "Makefile")
"""What makes results; below README.md."""


@dataclass(frozen=True)
class Step:
    """A command, and what it makes of results/published."""

    command: str
    makes: tuple[str, ...] = ()
    """Names there."""
    study: str = ""
    """That it runs, if it does."""

    @property
    def words(self) -> list[str]:
        """For a process, by this interpreter."""
        first, *rest = shlex.split(self.command)
        program = {"organbench": [sys.executable, "-m", "studies"], "python": [sys.executable]}
        return [*program.get(first, [first]), *rest]


def steps(studies: Sequence[Study] = STUDIES) -> list[Step]:
    """All, in their order: studies, other programs, what belongs to no study, publishing, pages."""
    alone = {one.study: one.file for one in SUMMARIES if "/" not in one.file}
    makers = [
        Step(f"organbench run {name}", (name, alone[name]) if name in alone else (name,), name)
        for name in [*(study.name for study in studies), *APART]
    ]
    order = [SWEEP, LEAGUE, *EXTRAS]  # settings of the league come from the sweep
    commands = dict.fromkeys(EXTRAS[name].command for name in order)
    makers += [Step(c, tuple(name for name, extra in EXTRAS.items() if extra.command == c)) for c in commands]
    return [
        *makers,
        Step("organbench publish", (REFERENCES, KEPT, FILE, "machine.json")),
        Step(f"organbench publish {' '.join(APART)}"),
        Step("python -m studies.report.methods_page"),
        Step("python -m studies.cli.commands_page"),
        Step("organbench publish --check"),
    ]


def seconds_of(step: Step, ledger: Ledger) -> float:
    """How long a step takes from here on [s], about; 0 for one whose results are all current."""
    if step.study:
        return expected(plan(ledger, find_study(step.study)), JOBS)
    if step.makes and all(name in EXTRAS and name != LEAGUE and is_current(ledger.root, name) for name in step.makes):
        return 0.0
    return 60.0 * MINUTES.get(step.command, FEW_MINUTES)


def schedule(all_steps: Sequence[Step], seconds: Sequence[float]) -> list[str]:
    """The plan, a line for each step."""
    lines = []
    for number, (step, cost) in enumerate(zip(all_steps, seconds, strict=True), 1):
        how_long = f"about {max(1.0, cost / 60.0):.0f} min" if cost else "current, nothing to do"
        products = f" ({', '.join(step.makes)})" if step.makes else ""
        lines.append(f"{number:2}  {step.command}{products}: {how_long}")
    hours = sum(seconds) / 3600.0
    return [
        *lines,
        f"about {hours:.1f} h in all; references that are not published are solved with their studies; "
        "where nothing is stored, times are estimates and may be wrong by a factor of three",
    ]


def check_complete(published: Path, all_steps: Sequence[Step]) -> None:
    """Raises StudyError for something in the published folder that no step makes."""
    names = {name for step in all_steps for name in step.makes}
    orphans = [path.name for path in sorted(published.glob("*")) if path.name not in names]
    if orphans:
        raise StudyError(f"no step makes {published / orphans[0]}; add it to EXTRAS (studies/report/publish.py)")


def check_commit(home: Path) -> str:
    """The commit that makes everything. Raises StudyError where there is none, and where the code differs from it."""
    commit = _git(home, "rev-parse", "HEAD")
    changed = _git(home, "status", "--porcelain", "--", *CODE).splitlines()
    if changed:
        raise StudyError(f"{changed[0].split()[-1]} is not as it was committed; commit it: one commit makes everything")
    return commit


def _git(home: Path, *words: str) -> str:
    result = subprocess.run(["git", *words], cwd=home, capture_output=True, text=True)
    if result.returncode != 0:
        raise StudyError(f"git {words[0]} fails here ({result.stderr.strip()}); publish from a clone of the repository")
    return result.stdout.strip()


def main(
    dry: Annotated[bool, typer.Option("--dry-run", help="only print the plan")] = False,
    results: Annotated[Path, typer.Option(help="folder of the results")] = Path("results"),
) -> None:
    """Makes what is missing or stale, publishes it, and checks that all is current."""
    all_steps, ledger = steps(), Ledger(results)
    check_complete(PUBLISHED, all_steps)
    seconds = [seconds_of(step, ledger) for step in all_steps]
    print("\n".join(schedule(all_steps, seconds)), flush=True)
    if dry:
        return
    print(f"commit {check_commit(Path('.'))}", flush=True)
    if find_spec("ngsolve") is None:
        raise StudyError("NGSolve, a second opinion of the reference, is missing; install organbench[crosscheck]")
    for number, step in enumerate(all_steps, 1):
        ledger.look_again()
        if not seconds_of(step, ledger):
            continue
        print(f"{number} of {len(all_steps)}: {step.command}", flush=True)
        result = subprocess.run(step.words)
        if result.returncode != 0:
            raise StudyError(
                f"`{step.command}` ended with exit code {result.returncode}, so nothing after it was done; repair what "
                "it says and start again: what is done stays"
            )


if __name__ == "__main__":
    try:
        typer.run(main)
    except StudyError as problem:
        print(f"publish: {problem}", file=sys.stderr)
        sys.exit(2)
