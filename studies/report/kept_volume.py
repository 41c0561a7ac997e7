"""The table of volume errors of all stored runs of all studies, written by `organbench report`."""

from collections.abc import Sequence

import numpy as np
import pandas as pd

from studies.base.errors import StudyError
from studies.catalog.study import Study
from studies.metrics.metric import COMPARABLE
from studies.runs.case import Case
from studies.store.ledger import Ledger
from studies.store.record import read_record
from studies.sweep.job import CaseJob, case_jobs

PROMISED = 1e-4
"""Worst |V_r/V0_r − 1| of any kept volume, after any frame, at the default step [1]."""
DEFAULT_FRACTION = 0.5
WORST = "worst |V/V0 - 1| [1]"


def promised(case: Case) -> bool:
    """Whether the promise covers a case: a method that keeps volumes, at the default step or below, from rest."""
    keeps = case.method.volume_tol is not None
    return keeps and case.scene.start is None and case.dt == "auto" and case.dt_fraction <= DEFAULT_FRACTION


def worst_volume(volume: np.ndarray, target: np.ndarray) -> float:
    """max |V_r/V0_r − 1| over frames and volumes, both (F, m) [1]."""
    return float(np.max(np.abs(volume / target - 1)))


def kept_volumes(ledger: Ledger, studies: Sequence[Study]) -> pd.DataFrame:
    """One row per stored run that the promise covers, the worst first; runs that broke off are left out."""
    rows = dict[str, dict[str, object]]()
    for study in studies:
        jobs: list[CaseJob] = []
        for job in case_jobs(ledger.root, study):
            entry = ledger.entry(job)
            if promised(job.work) and entry is not None and entry.status in COMPARABLE:
                jobs.append(job)
        rows |= {job.work.replaced(recorded=()).key: row for job in jobs if (row := _row(job)) is not None}
    table = pd.DataFrame(list(rows.values()))
    return table if table.empty else table.sort_values(WORST, ascending=False)


def _row(job: CaseJob) -> dict[str, object] | None:
    """None for a file that turns out to be damaged: the table of its study reports it."""
    try:
        record = read_record(job.path, ("volume", "volume_target"))
    except StudyError:
        return None
    case, worst = job.work, worst_volume(record.fields["volume"].values, record.fields["volume_target"].values)
    return {
        "scene": case.scene.name,
        "body": case.body.series,
        "nodes": case.body.nodes,
        "method": case.method_words,
        "volumes": record.attributes["volumes"],
        "dt/dt_c": record.attributes["dt"] / record.attributes["dt_limit"],
        WORST: worst,
        "at most 1e-4": "yes" if worst <= PROMISED else "NO",
    }
