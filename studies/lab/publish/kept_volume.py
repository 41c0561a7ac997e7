"""The table of volume errors of all stored runs that the promise covers."""

from collections.abc import Sequence
from pathlib import Path

import numpy as np
import pandas as pd

from studies import Case, Record, Status, Study, load_runs

FINISHED = Status.OK, Status.TUNNELLED, Status.FOLDED, Status.INVERTED, Status.SHAKEN, Status.DRIFTED
PROMISED = 1e-4
"""Worst |V_r/V0_r − 1| of any kept volume, after any frame, at the default step [1]."""
DEFAULT_FRACTION = 0.5
WORST = "worst |V/V0 - 1| [1]"


def promised(case: Case) -> bool:
    """Whether the promise covers a case: a method that keeps volumes, at the default step or below, from rest."""
    keeps = case.method.volume_tol is not None
    return keeps and case.scene.start is None and case.dt == "auto" and case.dt_fraction <= DEFAULT_FRACTION


def worst_volume(record: Record) -> float:
    """max |V_r/V0_r − 1| over frames and volumes [1]."""
    volume, target = (record.fields[name].values for name in ("volume", "volume_target"))  # (F, m)
    return float(np.max(np.abs(volume / target - 1)))


def kept_volumes(results: Path, studies: Sequence[Study]) -> pd.DataFrame:
    """One row per stored run, the worst first; runs that broke off are left out."""
    rows = dict[str, dict[str, object]]()
    for study in studies:
        for run in load_runs(results, study)[0]:
            if not promised(run.case) or run.record.status not in FINISHED:
                continue
            case, attributes, worst = run.case, run.record.attributes, worst_volume(run.record)
            rows[case.replaced(recorded=()).key] = {
                "scene": case.scene.name,
                "body": case.body.series,
                "nodes": case.body.nodes,
                "method": case.method_words,
                "volumes": attributes["volumes"],
                "dt/dt_c": attributes["dt"] / attributes["dt_limit"],
                WORST: worst,
                "at most 1e-4": "yes" if worst <= PROMISED else "NO",
            }
    table = pd.DataFrame(list(rows.values()))
    return table if table.empty else table.sort_values(WORST, ascending=False)
