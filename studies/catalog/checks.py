"""Checks of a study before anything is meshed."""

from studies.base.errors import StudyError
from studies.catalog.study import Study
from studies.metrics.load_size import beyond
from studies.metrics.table import check_columns
from studies.scene.checks import check_scene, surface_of
from studies.scene.clock import event_frames, frames_between
from studies.scene.scene import Scene
from studies.store.schema import Status


def check_study(study: Study, drawn: bool = True) -> list[str]:
    """Warnings of numbers that are hardly meant, of loads larger than measured; `drawn`: whether its charts will be.

    Raises StudyError for a chart without a function, a column that is no metric, and for checkpoints that no frames end
    at and a scene that cannot start (studies.scene.checks) in a study that does not expect failures.
    """
    check_columns(study.columns)
    for chart in study.charts if drawn else ():
        _ = chart.draw
    if study.accepts(Status.FAILED):
        return []
    for case in study.cases:
        frames = frames_between(case.scene, case.frames or case.scene.frames)
        for cut in case.scene.cuts:
            event_frames(case.scene, cut, frames)
    return [sentence for scene in study.scenes for sentence in (*check_scene(scene), *_check_loads(scene))]


def _check_loads(scene: Scene) -> list[str]:
    """A warning of loads beyond those with which errors were measured: such bodies may compute for minutes and fold."""
    try:
        points, _ = surface_of(scene.organ, scene.name)
    except StudyError:  # a file, of which `check_scene` warns
        return []
    larger = beyond(scene, points)
    return [f"scene '{scene.name}': {larger}: bodies may fail, and their errors are unknown"] if larger else []
