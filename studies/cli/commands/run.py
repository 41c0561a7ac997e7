"""`organbench run`: studies brought up to date."""

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path
from typing import Annotated

import typer

from studies.base.atomic import sweep_parts
from studies.base.counting import amounts
from studies.base.errors import StudyError
from studies.base.lookup import lookup
from studies.catalog import STUDIES, Study
from studies.catalog.checks import check_study
from studies.catalog.of_scene import BODIES
from studies.cli import terminal
from studies.cli.options import case_named
from studies.cli.progress import TerminalProgress, dry_run
from studies.cli.terminal import PROGRAM, SMOKE, Results, Smoke, console, say, warn
from studies.geometry.mesher.jobs import cache_folder
from studies.metrics.interval import sentences
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
from studies.sweep.find_study import ON, find_studies
from studies.sweep.frame_times import measure_again
from studies.sweep.job import Job, jobs_of
from studies.sweep.load import load_runs
from studies.sweep.plan import TIMING, Planned, plan, plan_again
from studies.sweep.run_studies import Failures, run_studies
from studies.sweep.standings import causes, failed, standings, summary, unexpected, warnings_of

JOBS = 2
"""Processes by default."""
WARNED = 3
"""Warnings that are printed; `organbench show` has all."""
AGAIN = "timing: re-measure stored cases on this machine; run nothing else"
MAIN_STUDIES = ", ".join(study.name for study in STUDIES if study.main)
GIVEN = f"studies, or a FILE.py with STUDY or SCENE ({PROGRAM}); default: {MAIN_STUDIES}"
Rule = Callable[[Ledger, Job], bool]
RULES: dict[str, Rule] = {
    "failed": failed,
    "stale": lambda ledger, job: ledger.why(job) not in (None, MISSING),
}
"""What --only chooses."""


def run(
    studies: Annotated[
        list[str] | None, typer.Argument(metavar="STUDY", help=GIVEN, autocompletion=terminal.studies)
    ] = None,
    results: Results = Path("results"),
    smoke: Smoke = False,
    case: Annotated[str, typer.Option(help="only the case with this name or part of a name; draws no charts")] = "",
    only: Annotated[str, typer.Option(help="run only cases that are failed, stale, or both (failed,stale)")] = "",
    jobs: Annotated[
        int | None, typer.Option(min=1, help="processes for the physics; timings always run alone  \\[default: 2]")
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
        lookup(again, [TIMING], "value of --again")
        if on or only:
            option = "--on" if on else "--only"
            raise StudyError(f"--again {again} measures all stored cases on this machine; leave out {option}")
    rules = [lookup(word.strip(), RULES, "filter") for word in only.split(",")] if only else []
    ledger, failures, well = Ledger(results / SMOKE if smoke else results), Failures(), True
    if organs:
        studies = [f"{name}{ON}{organs}" for name in studies or [BODIES]]
    chosen = [study.smoke() if smoke else study for study in find_studies(studies or [])]
    if case:
        chosen = [replace(study, cases=(case_named(study, case),)) for study in chosen]

    def work(study: Study) -> Work:
        return Work(ledger, study, rules, drawn=not case)

    todo = [] if again else [one for one in map(work, chosen) if one.planned]
    for one in todo:
        one.check(dry)
    if todo and report and not (on or dry):
        from studies.sweep.compiling import main as compiling  # with both solvers, which take a second to load

        compiling.bring_up_to_date(whole=False)
    with executor_for(on, jobs or JOBS, ledger.root, say) as executor:
        for one in map(work, chosen):  # planned anew: the study before it may have solved its references
            if again:
                one.time_again(dry)
            elif dry:
                dry_run(console, one.study.name, one.planned, jobs or JOBS)
            else:
                well = one.bring_up_to_date(executor, failures) and well
    if report and not dry:
        written, remarks = write_report(ledger, list({study.name: study for study in (*STUDIES, *chosen)}.values()))
        warn(remarks)
        for path in written:
            say(path)
    if failures.causes:
        warn([failures.sentence(f"organbench run {' '.join(studies or [])}".rstrip() + " --only failed")])
    if failures.causes or not well:
        raise typer.Exit(1)


@dataclass(frozen=True)
class Work:
    """A study to bring up to date."""

    ledger: Ledger
    study: Study
    rules: list[Rule]
    """What runs; without rules all that is not current."""
    drawn: bool
    """Whether its charts are drawn, too."""

    @cached_property
    def selection(self) -> Callable[[Job], bool] | None:
        """The jobs that one of the rules allows; None without rules."""
        if not self.rules:
            return None
        jobs = jobs_of(self.ledger.root, [self.study])
        chosen = {job.path.absolute() for job in jobs if any(rule(self.ledger, job) for rule in self.rules)}
        return lambda job: job.path.absolute() in chosen

    @cached_property
    def planned(self) -> list[Planned]:
        """What would run."""
        return plan(self.ledger, self.study, self.selection)

    @property
    def folder(self) -> Path:
        """Where its records, charts and tables are."""
        return study_folder(self.ledger.root, self.study.name)

    def check(self, dry: bool) -> None:
        """Warns of what is odd. Raises StudyError for what cannot be meant; in a dry run also for a mesh file that is
        missing, where the study expects no failure."""
        warnings = check_study(self.study, drawn=self.drawn)
        for scene in self.study.scenes if dry and not self.study.accepts(Status.FAILED) else ():
            path = str(scene.organ.parameters.get("path", "")) if scene.organ.shape == "file" else ""
            if path and not Path(path).is_file():
                raise StudyError(
                    f"the cases of scene '{scene.name}' will fail: there is no mesh file {path}; check the name"
                )
        warn(warnings)

    def bring_up_to_date(self, executor: Executor, failures: Failures) -> bool:
        """Runs what must run, prints how it ended, and returns whether as the study expects."""
        ledger, study, root = self.ledger, self.study, self.ledger.root
        with TerminalProgress(console, self.planned, executor.processes if self.planned else 1) as progress:
            count = run_studies(root, [study], executor, progress, self.selection, progress.hear, failures, ledger)
        for folder in (study_folder(root, REFERENCES), root / "cache", cache_folder()):
            sweep_parts(folder)
        warn(link_study(ledger, study.name))
        warnings = warnings_of(ledger, study) if count else []
        more = len(warnings) - WARNED
        warn([*warnings[:WARNED], *([f"and {more} more; `organbench show` prints them"] if more > 0 else [])])
        if self.drawn:
            warn(refresh(ledger, study)[1])
        what = "charts" if self.drawn else "records"
        say(f"{study.name}: {amounts(progress.done) or 'nothing'} ran, {what} in {self.folder}")
        ended = [one for one in standings(ledger, study) if self.selection is None or self.selection(one.job)]
        odd = unexpected(study, ended)
        say(f"{study.name}: {summary(ended)}")
        for sentence in causes(odd):
            say(f"  {sentence}")
        if study.name not in {each.name for each in STUDIES}:
            quadratic = tuple(case for case in study.cases if case.body.kind == "quadratic")
            for sentence in sentences(load_runs(root, replace(study, cases=quadratic))[0]):
                say(sentence)
        return not odd

    def time_again(self, dry: bool) -> None:
        """Times the stored cases, or says which; nothing of the study runs."""
        planned, name = plan_again(self.ledger, self.study), self.study.name
        if not planned:
            say(f"{name}: no stored case of this code can be timed; run `organbench run` first")
            return
        if dry:
            dry_run(console, name, planned, 1)
            return
        with TerminalProgress(console, planned) as progress:
            count = measure_again(self.ledger, self.study, progress, progress.hear)
        if self.drawn:
            warn(refresh(self.ledger, self.study)[1])
        say(f"{name}: {count} stored cases were timed again, {'charts' if self.drawn else 'times'} in {self.folder}")
