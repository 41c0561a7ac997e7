"""`organbench demo`: a first insight in a minute."""

import time
from pathlib import Path

from studies.base.errors import StudyError
from studies.catalog.demo import DEMO, WORDS
from studies.cli.terminal import Results, say, warn
from studies.metrics.metrics import force_end, volume_worst
from studies.metrics.run import Run
from studies.report.page.write import write_page
from studies.report.results import refresh
from studies.runs.run import run_case
from studies.store.ledger import Ledger
from studies.store.record import read_record
from studies.sweep.compiling.main import bring_up_to_date
from studies.sweep.job import CaseJob, case_jobs, do, reference_jobs
from studies.sweep.load import load_runs


def demo(results: Results = Path("organbench-demo")) -> None:
    """Squeeze a ball with three bodies, next to the reference: three numbers each, and a page to look at."""
    begin = time.perf_counter()
    ledger = Ledger(results)
    bring_up_to_date(whole=False)
    for job in reference_jobs(results, DEMO.scenes):
        do(job)
    speeds = []
    for job, words in zip(case_jobs(results, DEMO), WORDS, strict=True):
        say(f"{words}: {job.work.body.nodes} surface nodes")
        speeds.append(run_timed(job))
    ledger.look_again()
    runs, problems = load_runs(results, DEMO)
    warn(problems)
    for run, words, speed in zip(runs, WORDS, speeds, strict=True):
        say(line(run, words, speed))
    warn(refresh(ledger, DEMO)[1])
    page, _ = write_page(results, [DEMO])
    say(f"{page}: the moving bodies and a chart ({time.perf_counter() - begin:.0f} s in all)")


def run_timed(job: CaseJob) -> float:
    """Runs a case; simulated over computing time, without mesh and compiling."""
    times: list[float] = []
    case = job.work
    run_case(job.root, DEMO.name, case, lambda frame: times.append(time.perf_counter()))
    frames = case.frames or case.scene.frames
    if len(times) < 2:
        raise StudyError(f"{case.name} did not run: {read_record(job.path()).message}")
    return case.scene.duration * (len(times) - 1) / frames / (times[-1] - times[0])


def line(run: Run, words: str, speed: float) -> str:
    """Volume, force and speed of a run."""
    reference = run.reference
    if reference is None:
        raise StudyError(f"the scene '{run.case.scene.name}' has no reference: `organbench status demo` says why")
    uncertainty = 100 * reference.total_uncertainty["force_end"]
    numbers = f"volume {volume_worst(run):.2g} % off, force {force_end(run):+.1f} ± {uncertainty:.1f} %"
    return f"{words}: {numbers}, {speed:.1f} times real time"
