"""A recipe in a scene with its measured values, and how it compares with an accuracy target."""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from massspring import ImplicitVolume
from studies.meshing.bounds import SHAPE, SHAPE_VOLUME
from studies.metrics.run import Run
from studies.metrics.table import metric
from studies.metrics.wish import Wish
from studies.runs.case import BodyRecipe, Case, neighbours
from studies.store.record import Status

NAN = float("nan")
FORCE, DISPLACEMENT = metric("force_end"), metric("mean_error")
DISTANCE, VOLUME = metric("shape_error"), metric("shape_volume")


class Measured(NamedTuple):
    """A number and how well it is known, in one unit; NaN where it is not."""

    value: float
    uncertainty: float = NAN

    @property
    def known(self) -> bool:
        """Whether there is a number."""
        return self.value == self.value


UNKNOWN = Measured(NAN)


@dataclass(frozen=True)
class Judged:
    """A case that ended well, with its errors and its cost."""

    case: Case
    force: Measured = UNKNOWN
    """force_end [%], signed; unknown where the scene compares no force."""
    displacement: Measured = UNKNOWN
    """mean_error [%]."""
    cost: Measured = UNKNOWN
    """Computing time over simulated time [1], and half the range of the repeats of its median frame."""
    dt: float = NAN
    """[s]."""
    timed_here: bool = False
    """Whether the cost is of this machine."""
    shape: Measured = UNKNOWN
    """shape_error [%]; unknown in tables of older code."""
    shape_volume: Measured = UNKNOWN
    """shape_volume [%], signed."""
    members: "tuple[Judged, ...]" = ()
    """Of a recipe that ran on five neighbouring meshes: each of them; the errors are then the largest."""

    @property
    def advisable(self) -> bool:
        """Whether it may be advised: a body by implicit_volume. Other methods are there for comparison."""
        return isinstance(self.case.method, ImplicitVolume)

    def median(self, name: str) -> float:
        """Of an error by name over the meshes [%]: of the size of a signed one."""
        return float(np.median([abs(getattr(one, name).value) for one in self.members or (self,)]))

    @property
    def compared(self) -> bool:
        """Whether anything is known of its errors."""
        return self.force.known or self.displacement.known

    @property
    def off_shape(self) -> dict[str, float]:
        """The bounds of the shape that it misses -> measured over bound [1]."""
        shares = _shares({"shape": (self.shape, SHAPE), "shape_volume": (self.shape_volume, SHAPE_VOLUME)})
        return {name: share for name, share in shares.items() if share > 1.0}

    def shares(self, wish: Wish) -> dict[str, float]:
        """Every bound of a wish that can be judged here, and those of the shape that are missed -> measured over bound
        [1]: 1 or less meets it."""
        errors = {"force": (self.force, wish.force), "displacement": (self.displacement, wish.displacement)}
        return _shares({**errors, "budget": (self.cost, wish.budget)}) | self.off_shape

    def undecided(self, wish: Wish) -> bool:
        """Whether an error is wished finer than the reference is known."""
        pairs = ((self.force, wish.force), (self.displacement, wish.displacement))
        return any(bound is not None and error.uncertainty > bound for error, bound in pairs)

    def worst(self, wish: Wish) -> float:
        """The largest of its shares: 1 or less meets the wish; infinite where none of its errors is known."""
        shares = self.shares(wish)
        return max(shares.values()) if {"force", "displacement"} & set(shares) else np.inf


def _shares(bounds: Mapping[str, tuple[Measured, float | None]]) -> dict[str, float]:
    return {name: abs(one.value) / bound for name, (one, bound) in bounds.items() if bound and one.known}


def judged(run: Run) -> Judged | None:
    """What a run measured; None where it ended badly."""
    if run.record.status != Status.OK:
        return None
    force, displacement = (Measured(entry(run), entry.uncertainty(run)) for entry in (FORCE, DISPLACEMENT))
    dt, timed = float(run.attributes.dt), run.timing is not None
    shape, volume = Measured(DISTANCE(run)), Measured(VOLUME(run))
    return Judged(run.case, force, displacement, cost_of(run), dt, timed, shape, volume)


def over_meshes(rows: Iterable[Judged]) -> list[Judged]:
    """Rows of one scene, those of neighbouring meshes as one, with the largest errors, at the place of the middle one.

    Where any quadratic recipe ran on all five, one of implicit_volume that did not is left out: on one mesh it may be
    right by luck, and of five where one ended badly it is not reliable."""
    by_setting = {(one.case.body, _setting(one)): one for one in rows}
    families = dict[tuple[BodyRecipe, str], Judged]()
    for (body, setting), one in by_setting.items():
        members = [by_setting.get((mesh, setting)) for mesh in neighbours(body)]
        if body.kind == "quadratic" and all(members):
            families[body, setting] = _largest(one, tuple(member for member in members if member is not None))
    if not families:
        return list(by_setting.values())
    alone = lambda one: one.advisable and one.case.body.kind == "quadratic"  # noqa: E731
    return [families.get(key, one) for key, one in by_setting.items() if key in families or not alone(one)]


def _setting(one: Judged) -> str:
    """What besides the body sets a case apart."""
    return replace(one.case, body=BodyRecipe(), recorded=(), timed=False).key


def _largest(middle: Judged, members: "tuple[Judged, ...]") -> Judged:
    worst = {
        name: max((getattr(one, name) for one in members), key=lambda error: abs(error.value) if error.known else -1.0)
        for name in ("force", "displacement", "shape", "shape_volume")
    }
    return replace(middle, members=members, **worst)


def cost_of(run: Run) -> Measured:
    """Computing time over simulated time [1], and half the range over the repeats."""
    if run.timing is None:
        return UNKNOWN
    return cost_of_frames(run.timing.frame_ns, float(run.attributes.frame))


def cost_of_frames(frame_ns: np.ndarray, frame: float) -> Measured:
    """The median frame over its simulated time [1], and half the range of that over the repeats.

    frame_ns: (repeat, F) [ns]; frame: simulated time of a frame [s].
    """
    costs = 1e-9 * np.median(frame_ns, axis=1) / frame
    return Measured(1e-9 * float(np.median(frame_ns)) / frame, float(np.ptp(costs)) / 2)


def cheapest(rows: Iterable[Judged], wish: Wish) -> Judged | None:
    """The advisable one of least cost that meets a wish and keeps the shape; those of unknown cost come last. None
    where none does, or where the reference is less well known than is wished."""
    meeting = [one for one in rows if one.advisable and one.worst(wish) <= 1.0 and not one.undecided(wish)]
    return min(meeting, key=by_cost, default=None)


def nearest(rows: Iterable[Judged], wish: Wish) -> Judged | None:
    """The advisable one that misses a wish, or the shape, by the smallest factor; None of those whose errors are not
    known."""
    candidates = [one for one in rows if one.advisable and one.worst(wish) < np.inf]
    return min(candidates, key=lambda one: one.worst(wish), default=None)


def by_cost(one: Judged) -> tuple[bool, float, float]:
    """Orders by cost, where that is unknown by nodes over step."""
    step = one.dt if one.dt == one.dt else one.case.dt_fraction
    return not one.cost.known, one.cost.value if one.cost.known else 0.0, one.case.body.nodes / step


def front(points: Sequence[tuple[float, float]]) -> list[tuple[float, float]]:
    """The (cost, error) that no other point beats in both, by ascending cost."""
    best: list[tuple[float, float]] = []
    for cost, error in sorted(points):
        if not best or error < best[-1][1]:
            best.append((cost, error))
    return best
