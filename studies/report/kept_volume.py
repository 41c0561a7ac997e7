"""How well every stored run kept its volumes: one table over all studies, written by `organbench report`."""

from collections.abc import Sequence
from functools import partial
from pathlib import Path

import numpy as np
import pandas as pd

from massspring.sources import source_fingerprint
from studies.base.errors import StudyError
from studies.catalog.study import Study
from studies.metrics.metric import COMPARABLE
from studies.runs.case import Case
from studies.runs.digest import case_digest
from studies.store.index.room import Room
from studies.store.record import read_record
from studies.sweep.stored.known import Known

PROMISED = 1e-4
"""Worst |V_r/V0_r − 1| of any kept volume, after any frame, at the default step [1]."""
DEFAULT_FRACTION = 0.5
WORST = "worst |V/V0 - 1| [1]"
ROOM = "kept volumes"


def promised(case: Case) -> bool:
    """Whether the promise covers a case: a method that keeps volumes, at the default step or below, from rest."""
    keeps = case.method.volume_tol is not None
    return keeps and case.scene.start is None and case.dt == "auto" and case.dt_fraction <= DEFAULT_FRACTION


def worst_volume(volume: np.ndarray, target: np.ndarray) -> float:
    """max |V_r/V0_r − 1| over frames and volumes, both (F, m) [1]."""
    return float(np.max(np.abs(volume / target - 1)))


def kept_volumes(root: Path, studies: Sequence[Study]) -> pd.DataFrame:
    """One row per stored run that the promise covers, the worst first; runs that broke off are left out."""
    known, rows = Known(root), dict[str, dict[str, object]]()
    code = source_fingerprint("studies.report.kept_volume")
    for study in studies:
        folder = known.folder(study.name)
        room = Room(folder, ROOM)
        for case in filter(promised, study.cases):
            entry = known.of_case(study.name, case)
            if entry is None or entry.status not in COMPARABLE:
                continue
            try:
                row = room.get(entry.file, code, partial(_row, case, folder.folder / entry.file))
            except StudyError:  # since the index read it: the table of the study tells of it
                folder.forget([entry.file])
                continue
            rows[case_digest(case.replaced(recorded=()))] = row
        room.keep()
    table = pd.DataFrame(list(rows.values()))
    return table if table.empty else table.sort_values(WORST, ascending=False)


def _row(case: Case, path: Path) -> dict[str, object]:
    record = read_record(path, ("volume", "volume_target"))
    worst = worst_volume(record.fields["volume"].values, record.fields["volume_target"].values)
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
