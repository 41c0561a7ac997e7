"""How well every stored run kept its volumes: one table over all studies, written by `organbench report`."""

from collections.abc import Sequence
from pathlib import Path

import numpy as np
import pandas as pd

from studies.base.atomic import is_there
from studies.base.errors import StudyError
from studies.catalog.study import Study
from studies.metrics.metric import COMPARABLE
from studies.runs.case import Case
from studies.runs.current import case_path
from studies.store.record import read_record

PROMISED = 1e-4
"""Worst |V_r/V0_r − 1| of any kept volume, after any frame, at the default step [1]."""
DEFAULT_FRACTION = 0.5


def promised(case: Case) -> bool:
    """Whether the promise covers a case: a method that keeps volumes, at the default step or below, from rest."""
    keeps = case.method.volume_tol is not None
    return keeps and case.scene.start is None and case.dt == "auto" and case.dt_fraction <= DEFAULT_FRACTION


def worst_volume(volume: np.ndarray, target: np.ndarray) -> float:
    """max |V_r/V0_r − 1| over frames and volumes, both (F, m) [1]."""
    return float(np.max(np.abs(volume / target - 1)))


def kept_volumes(root: Path, studies: Sequence[Study]) -> pd.DataFrame:
    """One row per stored run that the promise covers, the worst first; runs that broke off are left out."""
    rows: dict[str, dict[str, object]] = {}
    for study in studies:
        for case in filter(promised, study.cases):
            path = case_path(root, study.name, case)
            try:
                record = read_record(path, ("volume", "volume_target")) if is_there(path) else None
            except StudyError:  # a run that failed has no volumes
                record = None
            if record is None or record.status not in COMPARABLE:
                continue
            worst = worst_volume(record.fields["volume"].values, record.fields["volume_target"].values)
            rows[case.replaced(recorded=()).key] = {
                "scene": case.scene.name,
                "body": case.body.series,
                "nodes": case.body.nodes,
                "method": case.method_words,
                "volumes": record.attributes["volumes"],
                "dt/dt_c": record.attributes["dt"] / record.attributes["dt_limit"],
                "worst |V/V0 - 1| [1]": worst,
                "at most 1e-4": "yes" if worst <= PROMISED else "NO",
            }
    table = pd.DataFrame(list(rows.values()))
    return table if table.empty else table.sort_values("worst |V/V0 - 1| [1]", ascending=False)
