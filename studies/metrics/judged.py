"""A recipe in a scene with its measured values, and how it compares with an accuracy target."""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from massspring import ImplicitVolume
from studies.meshing.bounds import SHAPE, SHAPE_VOLUME
from studies.metrics.run import Run
from studies.metrics.table import metric
from studies.metrics.timing.protocol import FrameTiming
from studies.metrics.wish import Wish
from studies.runs.case import Case
from studies.runs.recipes import BodyRecipe, TetrahedralBody, neighbours
from studies.store.record import Status

NAN = float("nan")
FORCE, DISPLACEMENT = metric("force_end"), metric("mean_error")
WITHIN = metric("force_within"), metric("mean_within")
DISTANCE, VOLUME = metric("shape_error"), metric("shape_volume")


class Measured(NamedTuple):
    """A number and its uncertainty in the same unit; NaN if unknown."""

    value: float
    uncertainty: float = NAN

    @property
    def known(self) -> bool:
        return self.value == self.value


UNKNOWN = Measured(NAN)


@dataclass(frozen=True)
class Judged:
    """A case that ended well, with its errors and its cost."""

    case: Case
    force: Measured = UNKNOWN
    """force_end [%], signed; unknown if the scene compares no force."""
    displacement: Measured = UNKNOWN
    """mean_error [%]."""
    cost: Measured = UNKNOWN
    """Computing time over simulated time [1], and half the range of the repeats of its median frame."""
    dt: float = NAN
    """Time step [s]."""
    timed_here: bool = False
    """Whether the cost was measured on this machine."""
    processor_cost: Measured = UNKNOWN
    """As `cost`, of processor time."""
    disturbed: str = ""
    """What disturbed the timing (FrameTiming.disturbed)."""
    processor: str = ""
    """Name of the processor that the cost is of; empty where it is not known."""
    shape: Measured = UNKNOWN
    """shape_error [%]; unknown in tables of older code."""
    shape_volume: Measured = UNKNOWN
    """shape_volume [%], signed."""
    members: "tuple[Judged, ...]" = ()
    """For a recipe that ran on five neighbouring meshes: the result on each; the errors above are then the largest."""
    bounds: bool = False
    """Whether no reference judges it, and its errors are what 90 of 100 stay within (studies.metrics.interval)."""

    @property
    def advisable(self) -> bool:
        """Whether it may be recommended: only bodies with implicit_volume. Other methods are for comparison."""
        return isinstance(self.case.method, ImplicitVolume)

    def median(self, name: str) -> float:
        """Median over the meshes of the absolute value of the error `name` [%]."""
        return float(np.median([abs(getattr(one, name).value) for one in self.members or (self,)]))

    @property
    def compared(self) -> bool:
        return self.force.known or self.displacement.known

    @property
    def off_shape(self) -> dict[str, float]:
        """Bounds of the shape that it exceeds -> measured value over bound [1]."""
        shares = _shares({"shape": (self.shape, SHAPE), "shape_volume": (self.shape_volume, SHAPE_VOLUME)})
        return {name: share for name, share in shares.items() if share > 1.0}

    def shares(self, wish: Wish) -> dict[str, float]:
        """Bounds of a wish whose quantity is known, and exceeded bounds of the shape -> measured value over bound [1]:
        at most 1 meets the bound."""
        errors = {"force": (self.force, wish.force), "displacement": (self.displacement, wish.displacement)}
        return _shares({**errors, "budget": (self.cost, wish.budget)}) | self.off_shape

    def undecided(self, wish: Wish) -> bool:
        """Whether the wish bounds an error more tightly than the uncertainty of the reference."""
        pairs = ((self.force, wish.force), (self.displacement, wish.displacement))
        return any(bound is not None and error.uncertainty > bound for error, bound in pairs)

    def worst(self, wish: Wish) -> float:
        """The largest of `shares`: at most 1 meets the wish; infinite if none of its errors is known."""
        shares = self.shares(wish)
        return max(shares.values()) if {"force", "displacement"} & set(shares) else np.inf


def _shares(bounds: Mapping[str, tuple[Measured, float | None]]) -> dict[str, float]:
    return {name: abs(one.value) / bound for name, (one, bound) in bounds.items() if bound and one.known}


def judged(run: Run) -> Judged | None:
    """The results of a run; None if it did not end well."""
    if run.record.status != Status.OK:
        return None
    alone = run.reference is None
    entries = WITHIN if alone else (FORCE, DISPLACEMENT)
    force, displacement = (Measured(entry(run), entry.uncertainty(run)) for entry in entries)
    one = Judged(run.case, force, displacement, dt=float(run.attributes.dt), bounds=alone)
    one = replace(one, shape=Measured(DISTANCE(run)), shape_volume=Measured(VOLUME(run)))
    return one if run.timing is None else with_times(one, run.timing, float(run.attributes.frame))


def over_meshes(rows: Iterable[Judged]) -> list[Judged]:
    """Results of one scene. Those of neighbouring meshes are combined into one with the largest errors, in the position
    of the middle one.

    If any quadratic recipe ran on all five, recipes with implicit_volume that did not are left out: on a single mesh a
    result may be right by chance, and if one of five did not end well, the recipe is not reliable."""
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
    """The settings of a case other than its body."""
    return replace(one.case, body=TetrahedralBody(), recorded=(), timed=False).key


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
    return _cost(run.timing, run.timing.frame_ns, float(run.attributes.frame))


def with_times(one: Judged, timing: FrameTiming, frame: float) -> Judged:
    """A result with the costs by frame times of this machine; frame: simulated time of a frame [s]."""
    cost, own = (_cost(timing, times, frame) for times in (timing.frame_ns, timing.cpu_ns))
    why, name = timing.disturbed, timing.processor
    return replace(one, cost=cost, processor_cost=own, timed_here=True, disturbed=why, processor=name)


def _cost(timing: FrameTiming, times: np.ndarray | None, frame: float) -> Measured:
    """The median of `times` (repeat, F) [ns] over the simulated time of a frame [1], and half the range of that over
    the repeats, NaN where the timing is disturbed."""
    if times is None:
        return UNKNOWN
    spread = np.nan if timing.disturbed else float(np.ptp(1e-9 * np.median(times, axis=1) / frame)) / 2
    return Measured(1e-9 * float(np.median(times)) / frame, spread)


def cheapest(rows: Iterable[Judged], wish: Wish) -> Judged | None:
    """The recommendable result of least cost that meets a wish and the bounds of the shape; results of unknown cost
    come last. None if there is none, or if the reference is less certain than the wish."""
    meeting = [one for one in rows if one.advisable and one.worst(wish) <= 1.0 and not one.undecided(wish)]
    return min(meeting, key=by_cost, default=None)


def nearest(rows: Iterable[Judged], wish: Wish) -> Judged | None:
    """The recommendable result that exceeds the wish or the bounds of the shape by the smallest factor; None if no
    errors are known."""
    candidates = [one for one in rows if one.advisable and one.worst(wish) < np.inf]
    return min(candidates, key=lambda one: one.worst(wish), default=None)


def by_cost(one: Judged) -> tuple[bool, float, float]:
    """Sort key: cost; if it is unknown, nodes over time step."""
    step = one.dt if one.dt == one.dt else one.case.dt_fraction
    return not one.cost.known, one.cost.value if one.cost.known else 0.0, one.case.body.nodes / step


def front(points: Sequence[tuple[float, float]]) -> list[tuple[float, float]]:
    """The Pareto front: points (cost, error) that no other point beats in both, by ascending cost."""
    best: list[tuple[float, float]] = []
    for cost, error in sorted(points):
        if not best or error < best[-1][1]:
            best.append((cost, error))
    return best
