"""The command line: reads words, calls the library, prints. Bad input ends in one sentence and exit code 2."""

import io
import sys
import warnings
from pathlib import Path
from typing import Annotated

import typer
from rich.console import Console
from rich.markup import escape
from rich.table import Table

from massspring import METHODS
from studies.base import interrupts
from studies.base.atomic import sweep_parts
from studies.base.lookup import choose
from studies.catalog import STUDIES, Study
from studies.cli.cost import cost
from studies.cli.endings import errors, flushed, say, told
from studies.cli.mesh import check, mesh
from studies.cli.progress import TerminalProgress
from studies.cli.publish import publish
from studies.cli.safe_dt import safe_dt
from studies.cli.show import describe
from studies.cli.verify import verify
from studies.geometry.mesher.jobs import cache_folder
from studies.geometry.organs import SHAPES
from studies.metrics.metrics import METRICS
from studies.metrics.table import study_table
from studies.reference.solve import STUDY as REFERENCES
from studies.report import results as reports
from studies.report.references import reference_listing
from studies.runs.run import replay as replay_run
from studies.scenes import SCENES
from studies.store.links import link_study
from studies.store.paths import study_folder
from studies.store.staleness import MISSING
from studies.sweep.find_study import find_studies, find_study
from studies.sweep.run_studies import failed, load_runs, run_studies, standings, warnings_of

app = typer.Typer(
    no_args_is_help=True,
    add_completion=False,
    pretty_exceptions_enable=False,
    help="How accurate, how fast and how stable are volume-preserving mass-spring organs, against finite elements.",
)
console = Console(soft_wrap=True)
Results = Annotated[Path, typer.Option("--results", envvar="ORGANBENCH_RESULTS", help="folder of the results")]
StudyName = Annotated[str, typer.Argument(help="a study (see `organbench list`), or a FILE.py that defines STUDY")]
SMOKE = "smoke"
MAIN_STUDIES = ", ".join(study.name for study in STUDIES if study.main)


def main() -> None:
    """Entry point: exit code 0 done, 2 bad input or output that cannot be written, 130 interrupted, 143 ended."""
    warnings.showwarning = lambda message, *_: say(f"warning: {message}")  # type: ignore[assignment]
    if isinstance(sys.stdout, io.TextIOWrapper):
        sys.stdout.reconfigure(errors="replace")  # a terminal that has no "±" shows "?"
    try:
        code = _exit_code()
    except KeyboardInterrupt:  # between two lines of it
        code = interrupts.exit_code()
    if code in (interrupts.CODE, interrupts.exit_code()):
        interrupts.close_ears()
        what = "interrupted" if code == interrupts.CODE else "ended by SIGTERM"
        say(f"organbench: {what}; what is finished is stored, the same command goes on from there")
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
            say(f"organbench: {told(error)}")
            code = 2
    return interrupts.exit_code() if interrupts.pressed() else code


@app.command("list")
def list_all() -> None:
    """Studies, scenes, organs, methods and metrics, a line each."""
    groups = {
        "studies": [(s.name, s.question.strip().split("\n")[0]) for s in STUDIES],
        "scenes": [(s.name, s.title) for s in SCENES],
        "organs": [(name, (make.__doc__ or "").strip().split("\n")[0]) for name, make in SHAPES.items()],
        "methods": [(m.name, (m.__doc__ or "").strip().split("\n")[0]) for m in METHODS],
        "metrics": [(m.name, m.description) for m in METRICS],
    }
    for title, rows in groups.items():
        table = Table(title=title, title_justify="left", show_header=False, box=None)
        for row in rows:
            table.add_row(*map(escape, row))
        console.print(table)


@app.command()
def run(
    studies: Annotated[
        list[str] | None, typer.Argument(help=f"studies or a FILE.py that defines STUDY; without: {MAIN_STUDIES}")
    ] = None,
    results: Results = Path("results"),
    smoke: Annotated[bool, typer.Option(help="small meshes, few frames; kept apart in results/smoke")] = False,
    only: Annotated[str, typer.Option(help="failed, stale, or both with a comma: nothing else runs")] = "",
    jobs: Annotated[int, typer.Option(min=1, help="processes for the physics; timing always runs alone")] = 2,
) -> None:
    """Runs what is missing or stale, then draws the charts. Interrupt it when you like: it goes on where it was."""
    wanted = _filter(only)
    root = results / SMOKE if smoke else results
    for found in find_studies(studies or []):
        study = found.smoke() if smoke else found
        with TerminalProgress(console) as progress:
            count = run_studies(root, [study], jobs, progress, wanted)
        for folder in (study_folder(root, REFERENCES), root / "cache", cache_folder()):
            sweep_parts(folder)
        for sentence in link_study(root, study.name):
            errors.print(f"warning: {sentence}", markup=False)
        said = warnings_of(root, study) if count else []
        if said:
            more = f" (and {len(said) - 1} more cases warn; `organbench show` prints them)" if len(said) > 1 else ""
            errors.print(f"warning: {said[0]}{more}", markup=False, highlight=False)
        _draw(root, study)
        done = f"{study.name}: {count} pieces ran, charts in {study_folder(root, study.name)}"
        console.print(done, markup=False, highlight=False)


def _filter(only: str):
    if not only:
        return None
    rules = {"failed": failed, "stale": lambda task: task.why_stale() not in (None, MISSING)}
    chosen = [choose(word.strip(), rules, "filter") for word in only.split(",")]
    return lambda task: any(rule(task) for rule in chosen)


def _draw(root: Path, study: Study) -> list[Path]:
    paths, remarks = reports.refresh(root, study)
    for sentence in remarks:
        errors.print(f"warning: {sentence}", markup=False, highlight=False)
    return paths


@app.command()
def status(study: Annotated[str, typer.Argument()] = "", results: Results = Path("results")) -> None:
    """How many cases are ok, failed, stale or missing, and why; and how the references stand, mesh by mesh."""
    chosen = [find_study(study)] if study else list(STUDIES)
    for entry in chosen:
        found = standings(results, entry)
        counts: dict[str, int] = {}
        for standing in found:
            counts[standing.status] = counts.get(standing.status, 0) + 1
        console.print(f"{entry.name}: " + ", ".join(f"{n} {word}" for word, n in counts.items()), highlight=False)
        if study:
            for standing in found:
                if standing.status != "ok":
                    console.print(f"  {standing.status:13} {standing.task.label}: {standing.message}", markup=False)
    listing = reference_listing(results, {scene.name: scene for entry in chosen for scene in entry.scenes}.values())
    if len(listing):
        console.print("references:", highlight=False)
        console.print(listing.to_string(index=False, na_rep=""), markup=False, highlight=False)


@app.command()
def show(path: Path) -> None:
    """What is in a results file: tree, units, status, key numbers."""
    console.print(describe(path))


@app.command()
def table(
    study: StudyName,
    results: Results = Path("results"),
    csv: Annotated[Path | None, typer.Option(help="write it there instead of printing it")] = None,
    metrics: Annotated[str, typer.Option(help="names with commas, instead of the study's own")] = "",
) -> None:
    """One row per case, with the metrics of the study."""
    entry = find_study(study)
    runs, remarks = load_runs(results, entry)
    for sentence in remarks:
        errors.print(f"warning: {sentence}", markup=False, highlight=False)
    frame = study_table(runs, [name.strip() for name in metrics.split(",")] if metrics else entry.columns)
    if csv is not None:
        console.print(str(reports.write_table(csv, frame)), markup=False, highlight=False)
        return
    console.print(frame.to_string(index=False, float_format=lambda v: f"{v:.4g}"), markup=False, highlight=False)


@app.command()
def plot(study: StudyName, results: Results = Path("results")) -> None:
    """Draws the charts and the table of a study from what is stored; names them."""
    for chart in _draw(results, find_study(study)):
        console.print(str(chart), markup=False, highlight=False)


@app.command()
def report(
    results: Results = Path("results"),
    figures: Annotated[bool, typer.Option(help="also the pictures of organs and of the squeezed ball")] = False,
) -> None:
    """All charts and tables, and the summary; names what it wrote."""
    written, remarks = reports.report(results, STUDIES)
    if figures:
        written += reports.draw_figures(results)
    for sentence in remarks:
        errors.print(f"warning: {sentence}", markup=False, highlight=False)
    for path in written:
        console.print(str(path), markup=False, highlight=False)


@app.command()
def replay(path: Path) -> None:
    """Runs exactly that case again, and says whether it came out the same (exit code 1: it did not)."""
    stored, new, difference = replay_run(path)
    if difference is None:
        console.print(f"{stored.name}: the same, bit for bit ({new.status})", highlight=False)
        return
    console.print(f"{stored.name}: {difference}", highlight=False)
    if stored.fingerprint != new.fingerprint:
        console.print("the code has changed since it was stored")
    if stored.machine != new.machine:
        console.print("it was stored on another machine")
    raise typer.Exit(1)


app.command()(verify)
app.command()(publish)
app.command()(cost)
app.command()(mesh)
app.command()(check)
app.command("safe-dt")(safe_dt)
