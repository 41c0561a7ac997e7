"""What other programs handed in, as a part of the page: each entry moves next to the reference, among the rows that are
published of its scene, and a chart shows the errors of all over their time."""

from collections.abc import Sequence
from contextlib import suppress
from pathlib import Path
from typing import Any

import numpy as np

from studies.base.errors import StudyError
from studies.catalog import STUDIES
from studies.catalog.study import Chart, Study
from studies.exchange.entry import FOLDER, entries_beside, entry_files, run_of_entry
from studies.metrics.judged import Judged, judged, over_meshes
from studies.metrics.run import by_scene
from studies.metrics.table import misses, study_table
from studies.metrics.wish import usual_wish
from studies.plots.style.style import save, svg_copies
from studies.plots.work_precision import figure_of
from studies.report.page.best import Best, best_beside, case_id
from studies.report.page.markup import COLUMNS, NEAR
from studies.report.page.part import part_path, run_id, write_part
from studies.scene.scene import Scene
from studies.store.ledger import Ledger
from studies.store.paths import study_folder
from studies.store.record import Status, read_record
from studies.sweep.load import References
from studies.tools.advise.campaign import published_for, published_table, stored_of_user

CHART = "error_time.png"
CHARTS = (Chart(CHART, "studies.plots.work_precision:draw"),)


class Entries(Study):
    """The entries as a study, for the page alone."""

    def __post_init__(self) -> None:
        """Its name is reserved for it."""


CHARTS = (Chart(CHART, "studies.plots.work_precision:draw"),)
ENTRIES = Entries(FOLDER, "How near do other programs come?", (), CHARTS, tuple(COLUMNS))


def refresh_entries(ledger: Ledger, scenes: Sequence[Scene] = ()) -> list[str]:
    """Keeps the part of all entries below the root of a ledger, none where there is none; what cannot be read, in
    sentences. scenes: of the user, whose references may have been solved on other meshes than the entries name."""
    root = ledger.root
    if not entry_files(root):
        part_path(root, ENTRIES).unlink(missing_ok=True)
        return []
    known = [scene for study in STUDIES for scene in study.scenes]
    runs, remarks = entries_beside(root, [*_named(root), *known, *scenes], References(ledger).of)
    rows: list[dict[str, Any]] = []
    best: list[Best] = []
    near: dict[str, float] = {}
    shown: dict[str, list[Judged]] = {}
    for name, group in by_scene(runs).items():
        scene = group[0].case.scene
        others, published = _others(root, scene)
        theirs = {run: judged(run) for run in group}
        near |= {run_id(run): one.worst(usual_wish(scene)) for run, one in theirs.items() if one is not None}
        rows += published
        best.append(best_beside(scene, others, theirs, run_id))
        shown[name] = [*others, *(one for one in theirs.values() if one is not None and one.compared)]
    pictures: dict[str, str] = {}
    if shown := {name: bodies for name, bodies in shown.items() if bodies}:
        study_folder(root, FOLDER).mkdir(parents=True, exist_ok=True)
        with svg_copies() as pictures:
            save(figure_of(shown, runs), study_folder(root, FOLDER) / CHART)
    table = study_table(runs, ENTRIES.columns).assign(**{NEAR: [near.get(run_id(run), np.inf) for run in runs]})
    write_part(root, ENTRIES, runs, table, pictures, published=rows, best=best)
    return remarks


def _named(root: Path) -> list[Scene]:
    """The scenes of the records themselves."""
    scenes = []
    for path in entry_files(root):
        with suppress(StudyError):  # `entries_beside` says what cannot be read
            scenes.append(run_of_entry(read_record(path), None).case.scene)
    return scenes


def _others(root: Path, scene: Scene) -> tuple[list[Judged], list[dict[str, Any]]]:
    """What is published of a scene by the last study of the catalogue that has it, as cases with a known error, and as
    rows of the page. Of a scene of the user the cases alone: their rows are those of the study."""
    study = next((one for one in reversed(STUDIES) if scene.name in [each.name for each in one.scenes]), None)
    if study is None:
        stored = stored_of_user(root, scene)
        return ([] if stored is None else stored.cases[scene.name]), []
    wish, rows = usual_wish(scene), published_table(published_for(root), scene, study.name)
    shown = [(row | misses(scene, row), one) for row, one in rows]
    published = [row | {"case": case_id(one.case), "published": True, NEAR: one.worst(wish)} for row, one in shown]
    return over_meshes(one for row, one in rows if row["status"] == Status.OK and one.compared), published
