"""How far a body is from the truth in a scene without a reference, by the same recipe on a second mesh.

Ninety of 100 errors are within q (floor + change) (1 + w shape): change is the difference between the two meshes, shape
how far the body is off its organ at rest; floor, w and q come from bodies whose errors are known (interval.json, made
by studies.lab.population). This is split conformal prediction with a scaled score (Lei et al. 2018,
doi:10.1080/01621459.2017.1307116, section 5.2). Two meshes show the error of the mesh alone, which dominates that of a
body; a halved step or other masses hardly change it (docs/accuracy.md). Of a wrong shape both have a part in common.
"""

import json
import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace
from functools import lru_cache
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from massspring import ImplicitVolume
from studies.metrics.contact import contact_facets
from studies.metrics.load_size import beyond
from studies.metrics.metric import PERCENT
from studies.metrics.run import Run
from studies.runs.case import Case
from studies.runs.recipes import ADAPTIVE, QuadraticBody
from studies.scene.kind import load_of
from studies.scene.quantities import allowed
from studies.scene.scene import Scene
from studies.store.record import Status

NAN = float("nan")
RULE_FILE = Path(__file__).with_name("interval.json")
RULE: dict[str, Any] = json.loads(RULE_FILE.read_text(encoding="utf-8"))
"""`seeds` of the members that it rests on and the `commit` that made it; `nodes` of their two meshes; of the force and
the displacement of each `group`: number of `members`, `floor` [%], weight `of_shape` [1/%], and `factor` of
the body with each number of nodes [1]; `loads` that they were under; `seen`: the farthest end of each sign."""
OF_100 = 90
RESTS = 0.01
"""Most that a body may be from rest, over its largest displacement: of random stomachs that were 0.037 to 0.12 from it
the displacements were wrong by 0.024 to 0.12; of 78 bodies that were nearer, the farthest was 0.008 from it."""
WITHIN = "force_within", "mean_within"
"""The metrics that an interval gives."""


class Apart(NamedTuple):
    """Difference of two bodies in one scene at its last checkpoint; NaN if the scene does not allow the comparison."""

    force: float
    """Difference of the probed force, over that of the finer body [%]."""
    displacement: float
    """Mean difference of displacement over the surface of the finer body, over its largest displacement [%]."""


class Interval(NamedTuple):
    """What 90 of 100 errors of a body stay within; NaN where the scene does not compare it, or `why` says no."""

    force: float = NAN
    """Bound of |force_end| [%]."""
    displacement: float = NAN
    """Bound of mean_error [%]."""
    why: str = ""
    """Why there is none."""


SIGNS = {
    "force": ("forces of the two meshes that differ by {} %", "more"),
    "displacement": ("displacements of the two meshes that differ by {} %", "more"),
    "sway": ("a force that sways by {} %", "more"),
    "shape": ("a body up to {} % of the size off its organ", "more"),
    "facets": ("{} facets under the tool", "fewer"),
}
"""What two meshes show, and on which side of all that the rule has seen a value is outside."""


def apart(coarse: Run, fine: Run) -> Apart:
    scene = fine.case.scene
    force = displacement = NAN
    if allowed(scene, "force_end"):
        force = PERCENT * abs(float(coarse.force[-1] / fine.force[-1]) - 1.0)
    sides, others = fine.sides, coarse.sides
    if allowed(scene, "surface_mean") and sides is not None and others is not None and set(sides) == set(others):
        moved, seen = (run.fields.snapshots[-1] - run.fields.rest for run in (fine, coarse))
        errors, weights, sizes = [], [], []
        for name, side in sides.items():
            nodes = np.unique(side.facets)
            at = others[name].nearest(side.points[nodes])
            errors.append(np.linalg.norm(others[name].interpolated(seen, at) - moved[nodes], axis=1))
            weights.append(side.areas[nodes])
            sizes.append(np.linalg.norm(moved[nodes], axis=1))
        mean = np.average(np.concatenate(errors), weights=np.concatenate(weights))
        displacement = PERCENT * float(mean / np.concatenate(sizes).max())
    return Apart(force, displacement)


def second_mesh(case: Case, cases: Iterable[Case]) -> Case | None:
    """Of `cases` the one of the same scene and recipe on another mesh, one that the rule knows if there is any."""
    others = [
        other
        for other in cases
        if (other.scene, other.method) == (case.scene, case.method)
        and other.body != case.body == replace(other.body, nodes=case.body.nodes)
    ]
    return max(others, key=lambda other: other.body.nodes in RULE["nodes"], default=None)


def group(load: str) -> str:
    """Bodies that hang have a rule of their own: at the outline by which they hang both meshes have the same error."""
    return "weight" if load == "sag" else "other"


def signs(coarse: Run, fine: Run) -> dict[str, float]:
    """Each of SIGNS: differences of two meshes, else of the finer one; NaN where the scene has no such thing."""
    return {
        **apart(coarse, fine)._asdict(),
        "sway": PERCENT * float(fine.record.attributes.get("sway", NAN)),
        "shape": PERCENT * fine.shape.distance,
        "facets": contact_facets(fine),
    }


@lru_cache(maxsize=1)
def interval(run: Run) -> Interval:
    """The interval of a run that has a second mesh and no reference."""
    if why := _unlike(run):
        return Interval(why=why)
    assert run.second is not None  # _unlike checked that
    seen = signs(*sorted((run.second, run), key=lambda one: one.case.body.nodes))
    if math.isnan(seen["shape"]):
        return Interval(why="the shape of its organ is unknown: the mesh file is missing or has changed")
    for name, (words, than) in SIGNS.items():
        value, end = seen[name], RULE["seen"][name]
        if value > end if than == "more" else value < end:
            what = f"{words.format(f'{value:.2g}')}, {than} than any organ that the rule rests on ({end:.2g})"
            return Interval(why=f"outside: {what}")
    rules = {name: RULE[name].get(group(load_of(run.case.scene))) for name in Apart._fields}
    force, displacement = (
        NAN if rule is None else bound(rule, seen[name], seen["shape"], run.case.body.nodes)
        for name, rule in rules.items()
    )
    if math.isnan(force) and math.isnan(displacement):
        return Interval(why="outside: the rule rests on no organ in which the scene's quantities are compared")
    return Interval(force, displacement)


def bound(rule: Mapping[str, Any], change: Any, shape: Any, nodes: int) -> Any:
    """What 90 of 100 errors of the body with so many of RULE's nodes stay within [%]; change: of `Apart` [%], shape: of
    SIGNS [%], or arrays of both."""
    return rule["factor"][str(nodes)] * scale(rule, change, shape)


def scale(rule: Mapping[str, Any], change: Any, shape: Any) -> Any:
    """What errors are in proportion to [%]; arguments as `bound`."""
    return (rule["floor"] + change) * (1.0 + rule["of_shape"] * shape)


def _unlike(run: Run) -> str:
    """What a run and its second mesh have that no member of the rule had; empty where they are of its kind."""
    body, method = run.case.body, run.case.method
    usual = body == QuadraticBody(body.nodes, graded=ADAPTIVE, mass=body.mass) and isinstance(method, ImplicitVolume)
    if not usual or run.second is None or sorted((body.nodes, run.second.case.body.nodes)) != RULE["nodes"]:
        meshes = " and ".join(f"{nodes:,}" for nodes in RULE["nodes"])
        return (
            f"it takes two meshes in one study, QuadraticBody(graded='adaptive') of {meshes} nodes by implicit_volume"
        )
    if run.case.scene.cuts:
        return "outside: the rule rests on scenes without cuts"
    ended = next((one for one in (run, run.second) if one.record.status != Status.OK), None)
    if ended is not None:
        return f"the body with {ended.case.body.nodes:,} nodes is {ended.record.status}"
    away = from_rest(run, run.second)
    if away > RESTS:
        return f"at the end the body is {PERCENT * away:.2g} % of its displacement from rest"
    larger = beyond(run.case.scene, run.fields.rest)
    return f"outside: {larger}" if larger else ""


def from_rest(*runs: Run) -> float:
    """How far one of the bodies is from rest at the end, over its displacement [1], or its swing, if that is more:
    three shapes miss one whose period is their distance in time. 0 where none of them knows."""
    signs = [run.record.attributes.get(sign, NAN) for run in runs for sign in ("unsettled", "swing")]
    return float(np.nan_to_num(signs).max())


def sentences(runs: Sequence[Run]) -> list[str]:
    """Of each scene without a reference the interval of its finest quadratic body, or why there is none."""
    alone = [run for run in runs if run.reference is None and run.case.body.kind == "quadratic"]
    finest = {run.case.scene.name: run for run in sorted(alone, key=lambda run: run.case.body.nodes)}
    return [f"{name}: {words_of(run)}" for name, run in finest.items()]


def words_of(run: Run) -> str:
    """ "force 1.84 N ± 2.1 %, displacement up to 12 mm ± 0.4 % in the mean (90 of 100)"."""
    force, displacement, why = interval(run)
    if why:
        return f"no interval of its errors: {why}; a reference would tell them"
    parts = [f"force {run.force[-1]:.3g} N ± {force:.2g} %"] if force == force else []
    if displacement == displacement:
        largest = np.linalg.norm(run.fields.snapshots[-1] - run.fields.rest, axis=1).max()
        parts.append(f"displacement up to {1e3 * largest:.3g} mm ± {displacement:.2g} % in the mean")
    return f"{', '.join(parts)} ({'; '.join(filter(None, (f'{OF_100} of 100', untested(run.case.scene))))})"


def untested(scene: Scene) -> str:
    """ "tested on none under squeeze" if none of the members was under the load of the scene, else ""."""
    load = load_of(scene)
    return "" if load in RULE["loads"] else f"tested on none under {load}"
