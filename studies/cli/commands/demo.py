"""`organbench demo`: a first insight in a minute."""

import time
import warnings
from pathlib import Path

from studies.base.errors import StudyError
from studies.catalog.demo import DEMO, WORDS
from studies.cli.terminal import Results, say, warn
from studies.metrics.cells import value_cell
from studies.metrics.metrics import force_end, volume_worst
from studies.metrics.run import Run
from studies.metrics.table import metric
from studies.metrics.timing.alone import alone
from studies.metrics.timing.cases import frames_of, write_timing
from studies.metrics.timing.protocol import interleave, pinned
from studies.report.page.write import write_page
from studies.report.results import refresh
from studies.runs.prepare import prepare
from studies.store.ledger import Ledger
from studies.store.machine import this_machine
from studies.store.record import read_record
from studies.sweep.compiling.main import bring_up_to_date
from studies.sweep.job import CaseJob, case_jobs, do, reference_jobs
from studies.sweep.load import load_runs

REPEATS = 2


def demo(results: Results = Path("organbench-demo")) -> None:
    """Squeeze a ball with three bodies, next to the reference: three numbers each, and a page to look at."""
    begin = time.perf_counter()
    ledger = Ledger(results)
    bring_up_to_date(whole=False)
    for job in reference_jobs(results, DEMO.scenes):
        do(job)
    for job, words in zip(case_jobs(results, DEMO), WORDS, strict=True):
        say(f"{words}: {job.work.body.nodes} surface nodes")
        do(job)
        ledger.look_again()
        if not ledger.can_be_timed(job):
            raise StudyError(f"{job.work.name} did not run: {read_record(job.path).message}")
        time_frames(job)
    ledger.look_again()
    runs, problems = load_runs(results, DEMO)
    warn(problems)
    for run, words in zip(runs, WORDS, strict=True):
        say(line(run, words))
    warn(refresh(ledger, DEMO)[1])
    page, _ = write_page(results, [DEMO])
    say(f"processor: {this_machine().cpu}")
    say(f"{page}: the moving bodies and two charts ({time.perf_counter() - begin:.0f} s in all)")


def time_frames(job: CaseJob) -> None:
    """Stores the frame times of a case, of fewer repeats than a study takes; warns if other programs disturbed them."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", UserWarning)  # the run has stored the warnings of its preparation
        setup = prepare(job.work).setup
    with alone(job.root), pinned(threads=1) as core:
        (timing,) = interleave({job.work.name: lambda: frames_of(setup)}, REPEATS, warmups=0, core=core).values()
    write_timing(job.root, DEMO.name, job.work, timing)
    if timing.disturbed:
        warn([f"{timing.disturbed}: the speed may be too low; close other programs and try again"])


def line(run: Run, words: str) -> str:
    reference = run.reference
    if reference is None:
        raise StudyError(f"the scene '{run.case.scene.name}' has no reference: `organbench show demo` says why")
    uncertainty = 100 * reference.total_uncertainty["force_end"]
    numbers = f"volume {volume_worst(run):.2g} % off, force {force_end(run):+.1f} ± {uncertainty:.1f} %"
    speed = metric("real_time")
    times = f"{value_cell(speed(run), speed.uncertainty(run))} times real time"
    return f"{words}: {numbers}, {times} ({value_cell(metric('real_time_cpu')(run))} by processor time)"
