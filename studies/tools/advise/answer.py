"""The cheapest recipe that was measured to be good enough: for a scene of the campaign, or one of the same kind."""

from dataclasses import dataclass, replace
from pathlib import Path
from typing import NamedTuple

from studies.base.errors import StudyError
from studies.base.lookup import lookup
from studies.catalog.accuracy import ACCURACY
from studies.metrics.judged import UNKNOWN, Judged, cheapest, nearest, with_times
from studies.metrics.load_size import beyond
from studies.metrics.timing.short import ShortTiming, short_timing
from studies.metrics.wish import Wish
from studies.runs.recipes import BodyRecipe
from studies.scene.checks import surface_of
from studies.scene.kind import kind_of
from studies.scene.library import SCENES
from studies.scene.scene import Scene
from studies.tools.advise.campaign import Stored, stored, stored_of_user
from studies.tools.advise.kinds import same_kind, worst_of
from studies.tools.advise.population import Unseen, unseen

PERCENT = 100.0
ERRORS = ("force", "displacement")
RESULTS = Path("results")


class Recommendation(NamedTuple):
    """A body and its step."""

    body: BodyRecipe
    dt_fraction: float
    """Time step over the stability limit."""


@dataclass(frozen=True)
class Advice:
    """An answer, and all that it rests on."""

    scene: Scene
    wish: Wish
    usual: bool
    """Whether the wished errors are the usual ones, because none was named."""
    stored: Stored
    chosen: Judged | None
    """The cheapest that meets the wish, else the nearest; None where the scene compares no error of the wish."""
    meets: bool
    unknowable: tuple[str, ...]
    """Errors whose wish is below the uncertainty of a reference."""
    ignored: tuple[str, ...]
    """Errors of the wish that no scene compares."""
    alike: tuple[str, ...] = ()
    """Scenes of the same kind, where the scene itself was never run; the errors are the worst of them."""
    beyond: str = ""
    """Which loads of a scene that was never run are larger than any with which errors were measured."""
    short: ShortTiming | None = None
    """The timing that was taken for this answer."""
    misshapen: Judged | None = None
    """The cheapest that meets the wish and would be chosen if it kept the shape of its organ."""
    unseen: Unseen | None = None
    """What the chosen recipe did on other organs of the kind; None where no population was run with it."""

    @property
    def real_time(self) -> float:
        """Simulated over computing time of the chosen recipe [1]; NaN where it is not known."""
        return 1.0 / self.chosen.cost.value if self.chosen is not None else float("nan")


def advise(
    scene: Scene | str,
    force: float | None = None,
    displacement: float | None = None,
    budget: float | None = None,
    results: Path | str = RESULTS,
    timing: bool = True,
) -> Advice:
    """The cheapest recipe whose measured errors meet a wish, and whose body keeps the shape of its organ.

    scene: one of SCENES by name, or any other; force, displacement: largest |force_end| and mean_error [1]; where
    neither is given 0.03 and 0.01, of a hollow organ 0.06 and 0.03; budget: computing over simulated time [1];
    timing: whether this machine times the answer where no time of it is stored.
    Raises StudyError for an unknown name, a bound that is not positive, a kind of scene that was never measured, and
    where nothing is stored.
    """
    scene = lookup(scene, {one.name: one for one in SCENES}, "scene") if isinstance(scene, str) else scene
    named = Wish(_percent("force", force), _percent("displacement", displacement), _bound("budget", budget))
    evidence, alike = _evidence(scene, Path(results))
    rows = worst_of(scene, list(evidence.cases.values())) if alike else evidence.cases[scene.name]
    answer = replace(_chosen(scene, named, rows, evidence), alike=alike)
    if alike:
        larger = beyond(scene, surface_of(scene.organ, scene.name)[0])
        answer = replace(answer, beyond=larger, meets=answer.meets and not larger)
    if answer.chosen is not None:
        answer = replace(answer, unseen=unseen(Path(results), answer.chosen.case))
    return _timed(answer) if timing else _untimed(answer)


def recommended(scene: Scene | str, results: Path | str = RESULTS) -> Recommendation:
    """Body and step that `advise` chooses for the usual wish, without timing.

    Raises StudyError where nothing meets it, or the reference is not accurate enough to decide.
    """
    answer = advise(scene, results=results, timing=False)
    if answer.chosen is None or not answer.meets:
        undecided = "the reference is not accurate enough to decide" if answer.unknowable else ""
        why = answer.beyond or undecided or "no body meets the target"
        raise StudyError(
            f"no recipe is recommended for scene '{answer.scene.name}': {why}; `organbench advise {answer.scene.name}` "
            "names the closest candidate"
        )
    return Recommendation(answer.chosen.case.body, answer.chosen.case.dt_fraction)


def _percent(name: str, bound: float | None) -> float | None:
    checked = _bound(name, bound)
    return None if checked is None else PERCENT * checked


def _bound(name: str, bound: float | None) -> float | None:
    if bound is not None and not (isinstance(bound, int | float) and 0 < bound < float("inf")):
        raise StudyError(f"{name} is {bound!r}; give a positive number, such as 0.03")
    return bound


def _evidence(scene: Scene, results: Path) -> tuple[Stored, tuple[str, ...]]:
    """What is stored of a scene; of one that never ran, what is stored of scenes of its kind, and their names."""
    own = [other for other in ACCURACY.scenes if replace(other, reference=scene.reference) == scene]
    if own:
        return stored(results, own), ()
    if (runs := stored_of_user(results, scene)) is not None:
        return runs, ()
    if scene.cuts:
        raise StudyError(
            f"no results apply to scene '{scene.name}', which cuts its organ: '{ACCURACY.name}' has no such scene; "
            f"`organbench run cutting` compares bodies that are cut"
        )
    alike = same_kind(scene, ACCURACY.scenes)
    if not alike:
        raise StudyError(
            f"no results apply to scene '{scene.name}': the study '{ACCURACY.name}' has no scene of its kind "
            f"({kind_of(scene)}); `organbench list` names its scenes, or run your own study"
        )
    evidence = stored(results, alike)
    return evidence, tuple(evidence.cases)


def _chosen(scene: Scene, named: Wish, rows: list[Judged], evidence: Stored) -> Advice:
    """The cheapest that meets the wish and keeps the shape, else the nearest. No error is judged below the uncertainty
    of the reference."""
    wish = named.or_usual(scene)
    errors = {name: bound for name in ERRORS if (bound := getattr(wish, name)) is not None}
    ignored = tuple(name for name in errors if not any(getattr(one, name).known for one in rows))
    unknowable = tuple(
        name for name, bound in errors.items() if any(getattr(one, name).uncertainty > bound for one in rows)
    )
    best = None if unknowable else cheapest(rows, wish)
    chosen = best or nearest(rows, wish)
    misshapen = None if unknowable else _misshapen(rows, wish)
    usual, meets = wish != named, best is not None
    return Advice(scene, wish, usual, evidence, chosen, meets, unknowable, ignored, misshapen=misshapen)


def _misshapen(rows: list[Judged], wish: Wish) -> Judged | None:
    """The cheapest that meets the wish whatever its shape; None where it keeps the shape."""
    whole = {one.case.key: one for one in rows}
    blind = cheapest((replace(one, shape=UNKNOWN, shape_volume=UNKNOWN) for one in rows), wish)
    return whole[blind.case.key] if blind is not None and whole[blind.case.key].off_shape else None


def _timed(answer: Advice) -> Advice:
    """With the cost of the chosen recipe on this machine; a budget that it misses here is not met."""
    one = answer.chosen
    if one is None or one.timed_here:
        return answer
    short = short_timing(one.case)
    timed = replace(with_times(one, short.timing, short.frame), dt=short.dt)
    return replace(answer, chosen=timed, meets=answer.meets and timed.worst(answer.wish) <= 1.0, short=short)


def _untimed(answer: Advice) -> Advice:
    """Without a time of its recipe no budget is met."""
    blind = answer.wish.budget is not None and answer.chosen is not None and not answer.chosen.cost.known
    return replace(answer, meets=answer.meets and not blind)
