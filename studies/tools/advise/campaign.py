"""What is stored of the campaign: its runs below the results folder, and the table that is published."""

from collections.abc import Iterable
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import pandas as pd

import studies
from studies.base.atomic import is_there
from studies.base.errors import StudyError
from studies.catalog.accuracy import ACCURACY
from studies.catalog.of_scene import study_of
from studies.catalog.study import Study
from studies.metrics.judged import DISPLACEMENT, DISTANCE, FORCE, VOLUME, Judged, Measured, judged, over_meshes
from studies.metrics.metric import Metric
from studies.metrics.table import DISTURBED, PROCESSOR
from studies.runs.case import Case
from studies.runs.current import case_path
from studies.runs.recipe_text import case_of_recipe, recipe_text
from studies.scene.scene import Scene
from studies.store.machine import machine_id, machine_of
from studies.store.record import Status
from studies.sweep.load import load_runs

PUBLISHED = "published"
"""Folder below the results with tables that come with the repository."""
COST, PROCESSOR_COST = "real_time [s/s]", "real_time_cpu [s/s]"
Row = dict[Any, Any]
PACKAGE = Path(studies.__file__).parent


@dataclass(frozen=True)
class Stored:
    """The results of some scenes."""

    cases: dict[str, list[Judged]]
    """Name of a scene -> its cases that ended well and whose errors are known."""
    where: str
    """Folder or table it was read from."""
    study: str = ACCURACY.name


def stored(results: Path, scenes: Iterable[Scene]) -> Stored:
    """What is stored of the campaign's `scenes`: the runs of each, and published rows of recipes that were not run.
    Where no table is published below the results, the one that comes with the program counts.

    Raises StudyError when nothing is stored of any.
    """
    by_name = {scene.name: scene for scene in scenes}
    cases, origins = dict[str, list[Judged]](), []
    published = published_for(results)
    for name, scene in by_name.items():
        own, recipes = _runs(results, ACCURACY, scene)
        rows = (one for one in published_rows(published, scene) if one.compared)
        others = [one for one in rows if recipe_text(one.case) not in recipes]
        if own or others:
            cases[name] = over_meshes([*own, *others])
            origins += [str(results / ACCURACY.name)] * bool(own) + [str(_table(published))] * bool(others)
    if not cases:
        raise StudyError(
            f"no results of the study '{ACCURACY.name}' for {', '.join(by_name)}, neither below "
            f"{results / ACCURACY.name} nor in {_table(published)}; `organbench run {ACCURACY.name}` measures it"
        )
    return Stored(cases, " and ".join(dict.fromkeys(origins)))


def published_for(results: Path) -> Path:
    """The folder of published tables below the results, or where these have no table of the campaign, the one that
    comes with the program."""
    own = results / PUBLISHED
    return own if _table(own).is_file() else shipped() / PUBLISHED


def shipped() -> Path:
    """The results folder with the tables that come with the program: the package itself (setup.py), or in a checkout
    the one next to it."""
    return PACKAGE if (PACKAGE / PUBLISHED).is_dir() else PACKAGE.parent / "results"


def _table(published: Path, study: str = ACCURACY.name) -> Path:
    return published / study / f"{study}.csv"


def stored_of_user(results: Path, scene: Scene) -> Stored | None:
    """The runs of a user's scene by the study that `organbench run FILE.py` makes of it; None where none has an
    error."""
    study = study_of(scene)
    own, _ = _runs(results, study, scene)
    return Stored({scene.name: own}, str(results / study.name), study.name) if own else None


def _runs(results: Path, study: Study, scene: Scene) -> tuple[list[Judged], set[str]]:
    """Runs of a scene in a study that ended well and whose errors are known, and the recipes of all runs that count:
    also of those that ended badly."""
    cases = [case for case in study.cases if case.scene.name == scene.name]
    there = tuple(case for case in cases if is_there(case_path(results, study.name, case)))
    if not there:
        return [], set()
    runs, _ = load_runs(results, replace(study, cases=there))  # the study itself reports what is missing
    own = [one for one in map(judged, runs) if one is not None and one.compared]
    bad = [run.case for run in runs if run.record.status != Status.OK]
    return own, {recipe_text(case) for case in (*(one.case for one in own), *bad)}


def published_rows(published: Path, scene: Scene) -> list[Judged]:
    """Rows of the table of the campaign in a folder of published results that ended well. Raises StudyError for a table
    without complete recipes."""
    return [one for row, one in published_table(published, scene) if row["status"] == Status.OK]


def published_table(published: Path, scene: Scene, study: str = ACCURACY.name) -> list[tuple[Row, Judged]]:
    """The rows of a scene in a table of a folder of published results, each also as a case, whether it ended well or
    not. Raises StudyError for a table without complete recipes."""
    path = _table(published, study)
    if not path.is_file():
        return []
    try:
        rows = pd.read_csv(path)
        here, rows["status"] = machine_of(published, study) == machine_id(), rows["status"].map(Status)
        return [
            (row, _judged_row(scene, row, here)) for row in rows.loc[rows["scene"] == scene.name].to_dict("records")
        ]
    except (KeyError, ValueError, OSError) as error:
        if isinstance(error, StudyError):
            raise
        raise StudyError(
            f"{path} cannot be read ({error}); delete it, and the table that comes with the program counts"
        ) from error


def _judged_row(scene: Scene, row: Row, here: bool) -> Judged:
    case: Case = case_of_recipe(scene, row["recipe"])
    cost, own = (Measured(1.0 / float(row.get(name) or "nan")) for name in (COST, PROCESSOR_COST))
    disturbed, processor = (text if isinstance(text := row.get(name), str) else "" for name in (DISTURBED, PROCESSOR))
    force, displacement, shape, volume = (_of(row, entry) for entry in (FORCE, DISPLACEMENT, DISTANCE, VOLUME))
    one = Judged(case, force, displacement, cost, 1e-3 * float(row["dt [ms]"]), here, own, disturbed, processor)
    return replace(one, shape=shape, shape_volume=volume)


def _of(row: Row, metric: Metric) -> Measured:
    name, unit = metric.name, metric.unit
    return Measured(float(row.get(f"{name} [{unit}]", "nan")), float(row.get(f"{name} floor [{unit}]", "nan")))
