"""The command line: reads words, calls the library, prints. Bad input ends in one sentence and exit code 2."""

import io
import sys
import warnings
from typing import Annotated

import typer

import studies
from studies.base import interrupts
from studies.cli.endings import complain, flushed, message
from studies.cli.group import Entry, lazy_group
from studies.cli.terminal import say

COMMANDS = {
    name: Entry(f"studies.cli.commands.{module}", function, line)
    for name, module, function, line in (
        ("list", "results.list_names", "list_names", "Studies, scenes, organs, methods and metrics, a line each."),
        ("run", "running.run", "run", "Runs what is missing or stale, then draws the charts."),
        ("worker", "running.worker", "worker", "Does pieces of studies for `organbench run --on` elsewhere."),
        ("status", "running.status", "status", "How many cases are ok, failed, stale or missing, and why."),
        ("show", "results.show", "show", "What is in a results file: status, numbers, fields with units."),
        ("table", "results.table", "table", "One row per case, with the metrics of the study."),
        ("plot", "results.plot", "plot", "Draws the charts and the table of a study from what is stored."),
        ("report", "results.report", "report", "All charts and tables, and the summaries; names what it wrote."),
        ("replay", "running.replay", "replay", "Runs exactly that case again, and says whether it is the same."),
        ("restamp", "running.restamp", "restamp", "Keeps stored results after a change of code that moves no number."),
        ("compare", "results.compare", "compare", "Every number that two results folders share, and which moved."),
        ("view", "results.view", "view", "Writes cases and their reference to one file for ParaView."),
        ("export", "exchange.export", "export", "Writes a scene for another program, with how to hand results in."),
        ("judge", "exchange.judge", "judge", "Judges what another program computed, as our own runs are."),
        ("publish", "results.publish", "publish", "Copies tables and charts to results/published, and the summaries."),
        ("advise", "answers.advise", "advise", "The cheapest recipe that is accurate enough for a scene."),
        ("calibrate", "answers.calibrate", "calibrate", "Fits few numbers of a body, judged in other scenes."),
        ("verify", "answers.verify", "verify", "Holds the reference against closed forms and published numbers."),
        ("stress", "answers.stress", "stress", "Tries to break every method at random; each end has a name."),
        ("cost", "running.cost", "cost", "Microseconds per stage of a step, and what the scene leaves out."),
        ("mesh", "meshes.mesh", "mesh", "Makes a mesh: of a synthetic organ, or from a file."),
        ("check", "meshes.check", "check", "Tells what is wrong with a mesh and what mends it."),
        ("place", "meshes.place", "place", "Places hold and probe on a scan, and writes a study."),
        ("archive", "house.archive", "archive", "Packs records, tables, charts and code into one zip file."),
        ("prune", "house.prune", "prune", "Lists stored files that nothing needs, and removes them."),
        ("doctor", "house.doctor", "doctor", "What is missing on this machine, and what mends it."),
        ("safe-dt", "running.safe_dt", "safe_dt", "The stability limit of a scene, predicted and verified by runs."),
    )
}
app = typer.Typer(cls=lazy_group(COMMANDS), no_args_is_help=True, pretty_exceptions_enable=False)


def show_version(asked: bool) -> None:
    """Prints the version and ends."""
    if asked:
        say(f"organbench {studies.__version__}")
        raise typer.Exit


@app.callback()
def organbench(
    version: Annotated[
        bool, typer.Option("--version", callback=show_version, is_eager=True, help="Show the version and end.")
    ] = False,
) -> None:
    """How accurate, how fast and how stable are volume-preserving mass-spring organs, against finite elements.

    A FILE.py is a program, whichever command gets it: run only files you trust (SECURITY.md)."""


def main() -> None:
    """Entry point: exit code 0 done, 2 bad input or output that cannot be written, 130 interrupted, 143 ended."""
    warnings.showwarning = lambda message, *_: complain(f"warning: {message}")  # type: ignore[assignment]
    if isinstance(sys.stdout, io.TextIOWrapper):
        sys.stdout.reconfigure(errors="replace")  # a terminal that has no "±" shows "?"
    try:
        code = _exit_code()
    except KeyboardInterrupt:  # between two lines of it
        code = interrupts.exit_code()
    if code in (interrupts.CODE, interrupts.exit_code()):
        interrupts.close_ears()
        what = "interrupted" if code == interrupts.CODE else "ended by SIGTERM"
        complain(f"organbench: {what}; what is finished is stored, the same command goes on from there")
    sys.exit(flushed(code))


def _exit_code() -> str | int | None:
    """Runs the command. Whatever came of it, once a signal came it counts as interrupted."""
    code: str | int | None = 0
    try:
        app()
    except SystemExit as stop:  # typer ends with it always, and turns KeyboardInterrupt into interrupts.CODE
        code = stop.code
    except Exception as error:
        if not interrupts.pressed():
            complain(f"organbench: {message(error)}")
            code = 2
    return interrupts.exit_code() if interrupts.pressed() else code
