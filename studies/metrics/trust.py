"""Checks whether a body can be trusted in a scene without a reference, by comparing the same recipe on two meshes.

The comparison shows only the error of the mesh, not errors common to both meshes. The mesh dominates the error of a
body; a halved step or other masses hardly change it (docs/accuracy.md).
"""

from collections.abc import Sequence
from dataclasses import replace
from itertools import pairwise
from typing import NamedTuple

import numpy as np

from studies.metrics.metric import PERCENT
from studies.metrics.metrics import contact_facets
from studies.metrics.run import Run, by_scene
from studies.metrics.wish import Wish, usual_wish
from studies.runs.case import Case
from studies.runs.recipes import ADAPTIVE, BodyRecipe, TetrahedralBody
from studies.scene.kind import load_of
from studies.scene.quantities import allowed
from studies.scene.scene import Scene
from studies.store.record import Status

ENOUGH = 1594
"""Nodes with which adaptive bodies of 95 of 100 random organs meet the target. With fewer nodes two meshes may agree
although both are wrong: half of the livers and spleens that miss the target with 1,194 nodes differ by less than the
target from 994 nodes (docs/population.md)."""
COARSER_SHARE = 0.8
"""Largest ratio of the nodes of the coarser mesh to those of the finer. Measured were 1,194 and 1,594; two nearly equal
meshes agree even if both are wrong."""
SHARE, SHARE_OF_HANGING = 1.5, 0.5
"""Allowed difference of two meshes over the target error, with ENOUGH nodes in the finer: SHARE, and SHARE_OF_HANGING
for an organ that hangs. Most of the difference is the error of the coarser mesh, but at the outline by which an organ
hangs both have the same error."""


FEW_FACETS = "facets will touch the probe"
"""Part of a warning before the run (studies.meshing.kept_shape). With few facets the contact force has the wrong
direction on both meshes and turns the organ: two meshes of liver_0_086 agree, and with 17 facets it is 1.8 % off."""


class Apart(NamedTuple):
    """Difference of two bodies in one scene at its last checkpoint; NaN if the scene does not allow the comparison."""

    force: float
    """Difference of the probed force, over that of the finer body [%]."""
    displacement: float
    """Mean difference of displacement over the surface of the finer body, over its largest displacement [%]."""


class Verdict(NamedTuple):
    """Whether the finest of two or more bodies in a scene is trusted, and why."""

    scene: str
    trusted: bool
    why: str
    """ "two meshes (1,194 and 1,594 nodes) differ by 0.4 % in force and 0.2 % in displacement; allowed: …"."""


def apart(coarse: Run, fine: Run) -> Apart:
    scene = fine.case.scene
    force = displacement = float("nan")
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


def verdicts(runs: Sequence[Run]) -> list[Verdict]:
    """Verdicts from the two finest meshes of each scene without a reference in which a graded quadratic recipe ran on
    two or more meshes."""
    pairs = pairs_of([run for run in runs if run.reference is None])
    finest = {(coarse.case.scene.name, _without_nodes(coarse.case.body)): (coarse, fine) for coarse, fine in pairs}
    return [_verdict(scene, *pair) for (scene, _), pair in finest.items()]


def is_compared(body: BodyRecipe) -> bool:
    """Whether sizes of a recipe are compared with each other."""
    return body.kind == "quadratic" and bool(body.graded)


def pairs_of(runs: Sequence[Run]) -> list[tuple[Run, Run]]:
    """Pairs of runs that ended well, of neighbouring sizes of a graded quadratic recipe in a scene, the coarse one
    first."""
    pairs = []
    for group in by_scene(runs).values():
        recipes: dict[BodyRecipe, list[Run]] = {}
        for run in group:
            if is_compared(run.case.body) and run.record.status == Status.OK:
                recipes.setdefault(_without_nodes(run.case.body), []).append(run)
        for sizes in recipes.values():
            sizes.sort(key=lambda run: run.case.body.nodes)
            pairs += [pair for pair in pairwise(sizes) if pair[0].case.body != pair[1].case.body]
    return pairs


def _without_nodes(body: BodyRecipe) -> BodyRecipe:
    return replace(body, nodes=TetrahedralBody().nodes)


def _verdict(scene: str, coarse: Run, fine: Run) -> Verdict:
    between, wish = apart(coarse, fine), usual_wish(fine.case.scene)
    nodes = f"{coarse.case.body.nodes:,} and {fine.case.body.nodes:,} nodes"
    parts = [
        f"{value:.2g} % in {name}"
        for name, value in (("force", between.force), ("displacement", between.displacement))
        if value == value
    ]
    facets, share, reason = contact_facets(fine), allowed_share(fine.case.scene), doubt_of(coarse, fine)
    few = f"; {facets:.0f} facets touch" if facets == facets else ""
    why = f"two meshes ({nodes}) differ by {' and '.join(parts)}{few}"
    if reason:
        return Verdict(scene, False, f"{reason}; {why}")
    return Verdict(scene, within(between, wish, share), f"{why}; allowed: {share:g} times the target")


def doubt(coarse: Case, fine: Case) -> str:
    """Why the finer of two bodies of a scene is not trusted even if they agree; empty for the kinds that were measured:
    adaptive bodies with ENOUGH nodes, compared with one of at most COARSER_SHARE of them, in scenes without cuts
    (docs/population.md)."""
    if fine.body.nodes < ENOUGH:
        return f"meshes with fewer than {ENOUGH:,} nodes may agree and be wrong"
    if coarse.body.nodes > COARSER_SHARE * fine.body.nodes:
        return "meshes with nearly as many nodes agree even when both are wrong"
    if fine.body.graded != ADAPTIVE:
        return "the rule is measured for adaptive bodies alone"
    return "the rule is not measured for scenes with cuts" if fine.scene.cuts else ""


def doubt_of(coarse: Run, fine: Run) -> str:
    """Why the finer of two runs is not trusted even if they agree: `doubt`, or few facets under its probe."""
    few = FEW_FACETS in str(fine.record.attributes.get("warnings", ""))
    return doubt(coarse.case, fine.case) or ("too few facets touch the probe" if few else "")


def allowed_share(scene: Scene) -> float:
    """Allowed difference of the two bodies over the target."""
    return SHARE_OF_HANGING if load_of(scene) == "sag" else SHARE


def within(between: Apart, wish: Wish, share: float) -> bool:
    """Whether two meshes agree to `share` of the target errors; the error of the finer is then likely within the
    target."""
    pairs = ((between.force, wish.force), (between.displacement, wish.displacement))
    compared = [(value, bound) for value, bound in pairs if value == value and bound is not None]
    return bool(compared) and all(value <= share * bound for value, bound in compared)
