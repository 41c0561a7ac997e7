"""What a user is told of a body in a scene, and whether it is right."""

import math
import re
from collections.abc import Callable
from dataclasses import dataclass, field, replace
from pathlib import Path

from studies import (
    METRICS,
    BodyRecipe,
    Case,
    ImplicitVolume,
    Record,
    Run,
    Scene,
    Status,
    StudyError,
    measure,
    read_record,
    recommended,
    reference_for,
    solve_reference,
)
from studies.catalog.accuracy import LONG, even
from studies.catalog.of_scene import study_of
from studies.lab.population.intervals import BAR
from studies.metrics.contact import few_facets
from studies.metrics.interval import apart, interval
from studies.metrics.judged import DISPLACEMENT, FORCE
from studies.metrics.wish import usual_wish
from studies.runs.current import case_path
from studies.runs.indicators import remarks
from studies.scene.checks import WEIGHTLESS
from studies.store.record import write_record

JUDGED, UNIFORM, ADVISED = "run FILE.py", "uniform", "advised"
"""Ways to a body: the finer of the two meshes of `organbench run FILE.py`, which the coarser one judges; uniform with a
random size; the one that `advise` recommends."""
FAR = 3.0
"""Error over the target beyond which a body is far off."""
ELSEWHERE = "frames take longer", "the motion is", "on the way"
"""Parts of sentences on cost and on the way: they do not doubt the end, where a member is judged. Nor does WEIGHTLESS,
on what the reference lacks, too."""
NO_HEAVIER = re.compile(r"mass='heavy' makes the body no heavier than its tissue: [^;]*")
"""A warning on cost, too."""


@dataclass
class Outcome:
    """Of one body in a scene."""

    way: str
    recipe: str
    status: str
    """A Status, "refused" or "crashed"."""
    message: str = ""
    doubts: list[str] = field(default_factory=list)
    """Warnings, a mark, and why two meshes are not alike."""
    errors: dict[str, tuple[float, float, float]] = field(default_factory=dict)
    """Quantity -> (error, bar of the reference, target) [%]."""
    signs: dict[str, float] = field(default_factory=dict)
    """Metrics and attributes of the run, to find the kind of a fault."""

    @property
    def kind(self) -> str:
        """What the user is told, and of a body that is ok the truth."""
        if self.status != Status.OK:
            return self.status if self.status in ("refused", "crashed") else "not ok"
        return f"{'doubted' if self.doubts else 'silent'}, {self.truth}"

    @property
    def truth(self) -> str:
        """ "right", "wrong" or "far": wherever in its bar the reference is, or by a bar of a third of the target;
        "undecided" where neither says it."""
        known = [(abs(value), bar, target) for value, bar, target in self.errors.values() if not math.isnan(value)]
        for name, bound in ("far", FAR), ("wrong", 1.0):
            if any(value - bar > bound * target for value, bar, target in known):
                return name
        if not known or any(bar > BAR * target and value + bar > target for value, bar, target in known):
            return "undecided"
        return "right" if all(value <= target for value, _, target in known) else "wrong"

    def inside(self, name: str, quantity: str) -> bool | None:
        """Whether an error is within its interval; None without one, or where the reference does not decide it."""
        error, bar, target = self.errors.get(quantity, (math.nan, math.inf, 0.0))
        half = self.signs.get(f"within_{name}", math.nan)
        return None if math.isnan(error) or math.isnan(half) or bar > BAR * target else abs(error) <= half


Ended = list[tuple[Outcome, Run | None]]


def told(root: Path, scene: Scene, nodes: int) -> Ended:
    """What every way through a scene gives, with the run if it is ok; records are stored below `root`.

    nodes: of the uniform body.
    """
    alone, ran = replace(scene, reference=None), dict[str, Record]()  # as a user has it

    def ended_of(way: str, chosen: Callable[[], Case]) -> tuple[Outcome, Run | None]:
        return _ended(root, way, chosen, alone, ran)

    ended = [
        ended_of(JUDGED, lambda: study_of(alone).cases[-1]),
        ended_of(UNIFORM, lambda: _case(alone, replace(even(alone)[0], nodes=nodes), LONG)),
        ended_of(ADVISED, lambda: _case(alone, *recommended(alone))),
    ]
    one, fine = ended[0]
    if fine is not None:
        other, coarse = ended_of(JUDGED, lambda: study_of(alone).cases[-2])
        if coarse is None:
            one.doubts.append(f"the coarser mesh is {other.status}: {other.message}")
        else:
            within, wish = interval(replace(fine, second=coarse)), usual_wish(scene)
            one.doubts += [within.why] if within.why else []
            for name, change in apart(coarse, fine)._asdict().items():
                half, target = getattr(within, name), getattr(wish, name)
                one.doubts += [f"{name} ± {half:.2g} % (target {target:g})"] if half > target else []
                one.signs |= {f"apart_{name}": change, f"within_{name}": half}
    return ended


def _case(scene: Scene, body: BodyRecipe, dt_fraction: float) -> Case:
    return Case(scene, body, ImplicitVolume(), dt_fraction=dt_fraction)


def _ended(
    root: Path, way: str, chosen: Callable[[], Case], scene: Scene, ran: dict[str, Record]
) -> tuple[Outcome, Run | None]:
    """What is told of a case, and its run if it is ok; ran: records of the scene by recipe, which do not run again."""
    try:
        case = chosen()
        recipe = f"{case.body!r}, dt_fraction={case.dt_fraction:g}"
        record = ran.get(recipe) or measure(case)
    except StudyError as error:
        return Outcome(way, "", "refused", str(error)), None
    except Exception as error:  # a program that breaks is a finding, not the end of the campaign
        return Outcome(way, "", "crashed", f"{type(error).__name__}: {error}"), None
    if recipe not in ran:
        ran[recipe] = record
        write_record(case_path(root, scene.name, case), record)
    early = record.status in (Status.FAILED, Status.SKIPPED)  # refused before the first step
    one = Outcome(way, recipe, "refused" if early else str(record.status), record.message)
    if record.status != Status.OK:
        return one, None
    run = Run(case, record)
    one.signs = {name: value for name, value in record.attributes.items() if isinstance(value, int | float)}
    warnings = NO_HEAVIER.sub("", str(record.attributes["warnings"])).replace(WEIGHTLESS, "")
    for sentence in remarks(scene, one.signs):
        warnings = warnings.replace(sentence, "") if any(part in sentence for part in ELSEWHERE) else warnings
    one.doubts = [words for words in (warnings.strip("; "), "few facets" * few_facets(run)) if words]
    one.signs |= {entry.name: value for entry in METRICS if math.isfinite(value := entry(run))}
    return one, run


def two_meshes(root: Path, scene: Scene) -> list[Run]:
    """The bodies of `organbench run FILE.py` on its two meshes and the reference that judges them; none where one is
    not stored below `root`."""
    cases = study_of(replace(scene, reference=None)).cases[-2:]
    try:
        reference = reference_for(root, scene)
        records = [read_record(case_path(root, scene.name, case)) for case in cases]
    except (StudyError, OSError):
        return []
    judged = reference if reference is not None and not reference.warnings else None
    return [Run(replace(case, scene=scene), record, judged) for case, record in zip(cases, records, strict=True)]


def judge(root: Path, scene: Scene, ended: Ended) -> str:
    """Compares runs with the reference, solved below `root` if a body is ok; returns what is wrong with it."""
    runs, wish = [(one, run) for one, run in ended if run is not None], usual_wish(scene)
    if not runs:
        return ""
    try:
        reference = solve_reference(root, scene)
    except StudyError as error:
        return str(error)
    for one, run in runs:
        judged = replace(run, case=replace(run.case, scene=scene), reference=reference)
        for entry, target in ((FORCE, wish.force), (DISPLACEMENT, wish.displacement)):
            assert target is not None  # the usual wish bounds both
            bar = math.inf if reference.warnings else entry.uncertainty(judged)
            one.errors[entry.name] = (entry(judged), bar, target)
    return reference.warnings
