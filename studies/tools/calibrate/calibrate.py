"""The recipe of an organ, fitted on its scenes against the reference, with trials on other scenes."""

from collections.abc import Iterable, Sequence
from datetime import UTC, datetime
from pathlib import Path

from studies.base.compile_watch import watching
from studies.base.errors import StudyError
from studies.base.lookup import lookup
from studies.metrics.judged import Judged
from studies.runs.case import BodyRecipe
from studies.runs.current import run_fingerprint
from studies.scene.kind import has_wall
from studies.scene.scene import Scene
from studies.store.ledger import Ledger
from studies.store.machine import this_machine
from studies.sweep.executor import CompileListener, Progress, Silent
from studies.tools.calibrate.fit import Fit, fit
from studies.tools.calibrate.folds import Fold, folds_of, own_scenes
from studies.tools.calibrate.measured import Measurements, bring_up_to_date, pending
from studies.tools.calibrate.parameters import KINDS, Parameter, parameters_of
from studies.tools.calibrate.stored import Calibration, SceneErrors, Trial, write_calibration
from studies.tools.calibrate.verdict import Compared, Verdict, verdict_of, worst

NODES = 550
RESULTS = Path("results")
FITTING = "fitting"
"""Stage of the progress: a piece for every fit."""


def starting_recipe(organ: str, kind: str, nodes: int = NODES) -> BodyRecipe:
    """The body of an organ before anything is fitted: with the scene's volumes, and a bent axis in a hollow organ.

    Raises StudyError for another kind than "tetrahedral" and "surface", and an organ that is not calibrated.
    """
    lookup(kind, KINDS, "body for a calibration")
    if kind == "tetrahedral":
        return BodyRecipe(nodes=nodes)
    return BodyRecipe("surface", nodes, axis="centre_line" if has_wall(own_scenes(organ)[0]) else "straight")


def calibrate(
    organ: str,
    body: BodyRecipe | str = "tetrahedral",
    results: Path | str = RESULTS,
    jobs: int = 1,
    progress: Progress | None = None,
    on_compile: CompileListener | None = None,
    folds: Sequence[Fold] | None = None,
) -> Calibration:
    """Fits a few numbers of a body to the references of an organ, tests the fit on other scenes, and stores both.

    organ: a name of SHAPES, with `folds` any name; body: what to start from, or "tetrahedral" or "surface" for one of
    550 nodes; jobs: processes for references and first runs, which `progress` shows; on_compile: hears what they
    compile; folds: scenes to fit and to judge on, by default those of `folds_of`.
    All runs are stored below `results`: an interrupted calibration continues.
    Raises StudyError for an organ or a body that is not calibrated, a missing reference, and a scene in
    which the body ends badly before anything is fitted.
    """
    root, tried = Path(results), tuple(folds if folds is not None else folds_of(organ))
    start = starting_recipe(organ, body) if isinstance(body, str) else body
    parameters_of(start)  # refused before anything runs
    scenes = _scenes_of(tried)
    ledger = Ledger(root)
    tasks = pending(ledger, scenes, start)
    if tasks:
        bring_up_to_date(tasks, root, jobs, progress or Silent(), on_compile or (lambda name: None))
        ledger.look_again()
    with watching(on_compile or (lambda name: None)):
        outcome = calibration(organ, start, tried, Measurements(ledger, scenes), progress or Silent())
    write_calibration(root, outcome)
    return outcome


def _scenes_of(folds: Sequence[Fold]) -> list[Scene]:
    """Every scene of the folds once. Raises StudyError for folds that lack one, a scene without a reference, and two
    that share a name."""
    if not folds or not all(fold.fitted and fold.judged for fold in folds):
        raise StudyError("a calibration needs scenes to fit and other scenes to test")
    scenes: dict[str, Scene] = {}
    for scene in (scene for fold in folds for scene in fold.scenes):
        if scene.reference is None:
            raise StudyError(f"scene '{scene.name}' has no reference for fitting or scoring")
        if scenes.setdefault(scene.name, scene) != scene:
            raise StudyError(f"two scenes of a calibration are called '{scene.name}'; rename one")
    return list(scenes.values())


def calibration(
    organ: str, start: BodyRecipe, folds: Sequence[Fold], runs: Measurements, progress: Progress
) -> Calibration:
    """A fit and its trial for every fold, and one fit on all scenes that were fitted on; not stored.

    Raises StudyError for a scene in which the body ends badly before anything is fitted.
    """
    progress.begin(FITTING, len(folds) + 1)
    trials = tuple(_trial(start, fold, runs, progress) for fold in folds)
    own = list({scene.name: scene for fold in folds for scene in fold.fitted}.values())
    whole = fit(start, own, runs.errors)
    progress.advance(FITTING, organ)
    return Calibration(
        organ=organ,
        start=start,
        recipe=whole.recipe,
        parameters=values_of(whole.recipe, whole.parameters),
        fitted=tuple(scene.name for scene in own),
        verdict=worst(verdict for trial in trials for verdict in (trial.force, trial.displacement)),
        trials=trials,
        fingerprint=run_fingerprint(),
        date=datetime.now(UTC).date().isoformat(),
        versions={"python": this_machine().python, **this_machine().packages},
    )


def values_of(recipe: BodyRecipe, parameters: Iterable[Parameter]) -> dict[str, float]:
    """Name -> value of each."""
    return {parameter.name: parameter.read(recipe) for parameter in parameters}


def _trial(start: BodyRecipe, fold: Fold, runs: Measurements, progress: Progress) -> Trial:
    before = {scene.name: runs.first_errors(scene, start) for scene in fold.scenes}
    best = fit(start, fold.fitted, runs.errors)
    after = {scene.name: runs.errors(scene, best.recipe) for scene in fold.scenes}
    rows = tuple(_errors(scene, scene in fold.fitted, before[scene.name], after[scene.name]) for scene in fold.scenes)
    force, displacement = (_verdict(rows, quantity) for quantity in ("force", "displacement"))
    values = values_of(best.recipe, best.parameters)
    progress.advance(FITTING, " and ".join(scene.name for scene in fold.fitted))
    return Trial(values, rows, force, displacement, tuple(_remarks(start, fold, best, after)))


def _errors(scene: Scene, fitted: bool, before: Judged, after: Judged | None) -> SceneErrors:
    force, displacement = (_compared(quantity, before, after) for quantity in ("force", "displacement"))
    return SceneErrors(scene.name, fitted, force, displacement)


def _compared(quantity: str, before: Judged, after: Judged | None) -> Compared | None:
    first = getattr(before, quantity)
    if not first.known:
        return None
    return Compared(first.value, None if after is None else getattr(after, quantity).value, first.uncertainty)


def _verdict(rows: Sequence[SceneErrors], quantity: str) -> Verdict | None:
    own, others = ([getattr(row, quantity) for row in rows if row.fitted is fitted] for fitted in (True, False))
    return verdict_of([pair for pair in own if pair], [pair for pair in others if pair])


def _remarks(start: BodyRecipe, fold: Fold, best: Fit, after: dict[str, Judged | None]) -> Iterable[str]:
    own = {scene.organ.shape for scene in fold.fitted}
    others = dict.fromkeys(scene.organ.shape for scene in fold.judged if scene.organ.shape not in own)
    if others:
        yield f"judged on other organs ({', '.join(others)})"
    left = [parameter.name for parameter in parameters_of(start) if parameter not in best.parameters]
    if left:
        yield f"{' and '.join(left)} not fitted: the scene compares fewer errors than the body has parameters"
    if best.at_bound:
        yield f"{' and '.join(best.at_bound)} ended at a bound of the search range"
    if not best.converged:
        yield "the search stopped before it converged"
    lost = [name for name, errors in after.items() if errors is None]
    if lost:
        yield f"the fitted body failed in {' and '.join(lost)}"
