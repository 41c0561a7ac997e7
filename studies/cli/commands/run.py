"""`organbench run`: studies brought up to date."""

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Annotated

import typer

from studies.base.atomic import sweep_parts
from studies.base.counting import amounts
from studies.base.errors import StudyError
from studies.base.lookup import lookup
from studies.catalog import STUDIES, Study
from studies.catalog.checks import check_study
from studies.cli import terminal
from studies.cli.options import case_named
from studies.cli.progress import TerminalProgress, dry_run
from studies.cli.terminal import PROGRAM, SMOKE, Results, Smoke, console, say, warn
from studies.geometry.mesher.jobs import cache_folder
from studies.reference.reference_solves import STUDY as REFERENCES
from studies.report.results import refresh
from studies.report.results import report as write_report
from studies.store.entry import MISSING
from studies.store.ledger import Ledger
from studies.store.links import link_study
from studies.store.paths import study_folder
from studies.store.schema import Status
from studies.sweep.engines.choose import WORDS, executor_for
from studies.sweep.executor import Executor
from studies.sweep.failures import Failures
from studies.sweep.find_study import ON, find_studies
from studies.sweep.frame_times import measure_again
from studies.sweep.job import Job, jobs_of
from studies.sweep.plan import TIMING, plan, plan_again
from studies.sweep.run_studies import run_studies
from studies.sweep.standings import causes, failed, standings, summary, unexpected, warnings_of

JOBS = 2
"""Processes by default."""
AGAIN = "timing: re-measure stored cases on this machine; run nothing else"
MAIN_STUDIES = ", ".join(study.name for study in STUDIES if study.main)
GIVEN = f"studies, or a FILE.py with STUDY or SCENE ({PROGRAM}); default: {MAIN_STUDIES}"
Selection = Callable[[Job], bool] | None
Rule = Callable[[Ledger, Job], bool]


def run(
    studies: Annotated[
        list[str] | None, typer.Argument(metavar="STUDY", help=GIVEN, autocompletion=terminal.studies)
    ] = None,
    results: Results = Path("results"),
    smoke: Smoke = False,
    case: Annotated[str, typer.Option(help="only the case with this name or part of a name; draws no charts")] = "",
    only: Annotated[str, typer.Option(help="run only cases that are failed, stale, or both (failed,stale)")] = "",
    jobs: Annotated[
        int | None, typer.Option(min=1, help="processes for the physics; timings always run alone  [default: 2]")
    ] = None,
    on: Annotated[str, typer.Option(help=f"{WORDS} (docs/cluster.md)")] = "",
    again: Annotated[str, typer.Option(help=AGAIN)] = "",
    organs: Annotated[str, typer.Option(help="run on the surfaces of this folder: FOLDER or FOLDER:mm")] = "",
    dry: Annotated[bool, typer.Option("--dry-run", help="only print what would run, why, and for how long")] = False,
    report: Annotated[bool, typer.Option("--report", help="then do what `organbench report` does")] = False,
) -> None:
    """Run what is missing or stale, then draw the charts. Interrupt it any time: the same command continues it."""
    if on and jobs is not None:
        raise StudyError("give either --jobs or --on: --on local:4 stands for --jobs 4")
    if case and report:
        raise StudyError("give either --case or --report: a report shows whole studies")
    if again:
        _check_again(again, {"--on": on, "--only": only})
    root, rules, failures = results / SMOKE if smoke else results, _rules(only), Failures()
    ledger = Ledger(root)
    if organs:
        from studies.catalog.population import POPULATION  # with the geometry of scans, which takes a while to load

        studies = [f"{name}{ON}{organs}" for name in studies or [POPULATION]]
    chosen, well = [_chosen(study, smoke, case) for study in find_studies(studies or [])], True
    todo = [study for study in chosen if not again and plan(ledger, study, _selection(ledger, study, rules))]
    for study in todo:
        warnings = check_study(study, drawn=not case)
        if dry:
            _check_mesh_files(study)
        warn(warnings)
    if todo and report and not (on or dry):
        _compile()
    with executor_for(on, jobs or JOBS, root, say) as executor:
        for study in chosen:
            if again:
                _time_again(ledger, study, dry, not case)
                continue
            selection = _selection(ledger, study, rules)
            if dry:
                dry_run(console, study.name, plan(ledger, study, selection), jobs or JOBS)
            else:
                well = _bring_up_to_date(ledger, study, executor, selection, not case, failures) and well
    if report and not dry:
        _report(ledger, chosen)
    _exit(well, failures, studies or [])


def _check_mesh_files(study: Study) -> None:
    """Raises StudyError for a mesh file that is missing, in a study that expects no failure."""
    for scene in () if study.accepts(Status.FAILED) else study.scenes:
        path = str(scene.organ.parameters.get("path", "")) if scene.organ.shape == "file" else ""
        if path and not Path(path).is_file():
            raise StudyError(
                f"the cases of scene '{scene.name}' will fail: there is no mesh file {path}; check the name"
            )


def _compile() -> None:
    """Compiles what most studies need, in two processes that share it, before two that would both compile it."""
    from studies.sweep.compiling import main as compiling  # with both solvers, which take a second to load

    compiling.bring_up_to_date(whole=False)


def _report(ledger: Ledger, chosen: list[Study]) -> None:
    """As `organbench report`, with the studies that ran."""
    written, remarks = write_report(ledger, list({study.name: study for study in (*STUDIES, *chosen)}.values()))
    warn(remarks)
    for path in written:
        say(path)


def _exit(well: bool, failures: Failures, names: list[str]) -> None:
    """Ends with exit code 1 where something ended as its study does not expect."""
    if failures.causes:
        warn([failures.sentence(f"organbench run {' '.join(names)}".rstrip() + " --only failed")])
    if failures.causes or not well:
        raise typer.Exit(1)


def _chosen(study: Study, smoke: bool, case: str) -> Study:
    study = study.smoke() if smoke else study
    return replace(study, cases=(case_named(study, case),)) if case else study


def _bring_up_to_date(
    ledger: Ledger, study: Study, executor: Executor, selection: Selection, drawn: bool, failures: Failures
) -> bool:
    """Runs what must run, prints how it ended, and returns whether as the study expects."""
    root, planned = ledger.root, plan(ledger, study, selection)
    with TerminalProgress(console, planned, executor.processes if planned else 1) as progress:
        count = run_studies(root, [study], executor, progress, selection, progress.compiling, failures, ledger)
    for folder in (study_folder(root, REFERENCES), root / "cache", cache_folder()):
        sweep_parts(folder)
    warn(link_study(ledger, study.name))
    warnings = warnings_of(ledger, study) if count else []
    if warnings:
        more = f" (and {len(warnings) - 1} more cases warn; `organbench show` prints them)" if len(warnings) > 1 else ""
        warn([warnings[0] + more])
    if drawn:
        warn(refresh(ledger, study)[1])
    what = "charts" if drawn else "records"
    say(f"{study.name}: {amounts(progress.done) or 'nothing'} ran, {what} in {study_folder(root, study.name)}")
    ended = [standing for standing in standings(ledger, study) if selection is None or selection(standing.job)]
    odd = unexpected(study, ended)
    say(f"{study.name}: {summary(ended)}")
    for sentence in causes(odd):
        say(f"  {sentence}")
    if study.name not in {each.name for each in STUDIES}:
        _say_trust(root, study)
    return not odd


def _say_trust(root: Path, study: Study) -> None:
    """Whether two meshes of a scene without a reference agree."""
    from studies.metrics.trust import verdicts  # with the geometry of surfaces
    from studies.sweep.load import load_runs

    runs, _ = load_runs(root, study)
    for verdict in verdicts(runs):
        answer = "yes" if verdict.trusted else "no: use more nodes"
        say(f"{verdict.scene}: trust its best body: {answer}, because {verdict.why}")


def _check_again(again: str, others: dict[str, object]) -> None:
    """Raises StudyError for anything but timing, and for options that choose or place what runs."""
    lookup(again, [TIMING], "value of --again")
    given = [name for name, value in others.items() if value]
    if given:
        raise StudyError(f"--again {again} measures all stored cases on this machine; leave out {given[0]}")


def _time_again(ledger: Ledger, study: Study, dry: bool, drawn: bool) -> None:
    """Times the stored cases of a study, or says which; nothing of it runs."""
    planned = plan_again(ledger, study)
    if not planned:
        say(f"{study.name}: no stored case of this code can be timed; run `organbench run` first")
        return
    if dry:
        dry_run(console, study.name, planned, 1)
        return
    with TerminalProgress(console, planned) as progress:
        count = measure_again(ledger, study, progress, progress.compiling)
    if drawn:
        warn(refresh(ledger, study)[1])
    say(f"{study.name}: {count} stored cases were timed again, {'charts' if drawn else 'times'} in "
        f"{study_folder(ledger.root, study.name)}")  # fmt: skip


def _rules(only: str) -> list[Rule]:
    rules: dict[str, Rule] = {
        "failed": failed,
        "stale": lambda ledger, job: ledger.why(job) not in (None, MISSING),
    }
    return [lookup(word.strip(), rules, "filter") for word in only.split(",")] if only else []


def _selection(ledger: Ledger, study: Study, rules: list[Rule]) -> Selection:
    """The jobs that one of the rules allows; None without rules: then all that is not current runs."""
    if not rules:
        return None
    jobs = jobs_of(ledger.root, [study])
    chosen = {job.path.absolute() for job in jobs if any(rule(ledger, job) for rule in rules)}
    return lambda job: job.path.absolute() in chosen
