"""Whether a body can be trusted in a scene without a reference: the same recipe on two meshes, compared.

What both meshes share, a half step or other masses do not show; the error of a body is that of its mesh
(docs/accuracy.md).
"""

from collections.abc import Sequence
from dataclasses import replace
from itertools import pairwise
from typing import NamedTuple

import numpy as np

from studies.metrics.judged import DISPLACEMENT, FORCE
from studies.metrics.metric import PERCENT
from studies.metrics.metrics import contact_facets
from studies.metrics.run import Run, by_scene
from studies.metrics.wish import Wish, usual_wish
from studies.runs.case import ADAPTIVE, BodyRecipe, Case
from studies.scene.kind import load_of
from studies.scene.quantities import allowed
from studies.scene.scene import Scene
from studies.store.record import Status

ENOUGH = 1594
"""Nodes with which adaptive bodies of 95 of 100 random organs are within the target. With fewer two meshes may agree
and both be wrong: half of the livers and spleens beyond the target with 1,194 nodes differ by less than the target from
994 (docs/population.md)."""
COARSER_SHARE = 0.8
"""Of the finer one's nodes the coarser one has at most this share: 1,194 of 1,594 were measured, and two meshes that
are nearly the same agree whatever both lack."""
SHARE, SHARE_OF_HANGING = 1.5, 0.5
"""Of the wished error by which two meshes may differ, the finer with ENOUGH nodes. Most of the difference is the error
of the coarser one; but both lack the same at the outline by which an organ hangs."""


class Apart(NamedTuple):
    """How far two bodies of one scene are apart at its last checkpoint; NaN where the scene compares none."""

    force: float
    """Of the probed force, over that of the finer [%]."""
    displacement: float
    """Mean over the surface of the finer body, over its largest displacement [%]."""


class Verdict(NamedTuple):
    """Of the finest of two bodies or more in a scene."""

    scene: str
    trusted: bool
    why: str
    """ "two meshes (1,194 and 1,594 nodes) differ by 0.4 % in force and 0.2 % in displacement; allowed: …"."""


def apart(coarse: Run, fine: Run) -> Apart:
    """How far the coarse body is from the fine one."""
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
    """Of each scene without a reference in which a graded quadratic recipe ran on two meshes or more: of the two
    finest."""
    pairs = _pairs([run for run in runs if run.reference is None])
    finest = {(coarse.case.scene.name, _without_nodes(coarse.case.body)): (coarse, fine) for coarse, fine in pairs}
    return [_verdict(scene, *pair) for (scene, _), pair in finest.items()]


class Judgement(NamedTuple):
    """What the comparison of two meshes said of a scene, and what its reference says."""

    scene: str
    nodes: int
    """Of the finer body."""
    apart: Apart
    alike: bool
    """Whether the two differ by no more than the wished errors."""
    trusted: bool
    within: bool
    """Whether the errors of the finer body are within the wish."""


def judgements(runs: Sequence[Run]) -> list[Judgement]:
    """Of each scene with a reference and of each two neighbouring sizes of a graded quadratic recipe; only a finer one
    with ENOUGH nodes may be trusted."""
    judged = []
    for coarse, fine in _pairs([run for run in runs if run.reference is not None]):
        scene, between = fine.case.scene, apart(coarse, fine)
        wish = usual_wish(scene)
        errors = ((FORCE, wish.force), (DISPLACEMENT, wish.displacement))
        values = [(abs(entry(fine)), bound) for entry, bound in errors if bound is not None]
        right = [value <= bound for value, bound in values if value == value]
        if not right:  # nothing says whether it is right
            continue
        trusted = not doubt(coarse.case, fine.case) and within(between, wish, allowed_share(scene))
        alike = within(between, wish, 1.0)
        judged.append(Judgement(scene.name, fine.case.body.nodes, between, alike, trusted, all(right)))
    return judged


class Tally(NamedTuple):
    """Of judgements."""

    beyond: int
    """Scenes whose error is beyond the wish."""
    named: int
    """Of these those that are not trusted."""
    within: int
    """Scenes whose error is within the wish."""
    doubted: int
    """Of these those that are not trusted."""


def tally(judged: Sequence[Judgement]) -> Tally:
    """How many of the bad are named and how many of the good are doubted."""
    bad, good = [one for one in judged if not one.within], [one for one in judged if one.within]
    return Tally(len(bad), sum(not one.trusted for one in bad), len(good), sum(not one.trusted for one in good))


def _pairs(runs: Sequence[Run]) -> list[tuple[Run, Run]]:
    """Runs of neighbouring sizes of a graded quadratic recipe in a scene that both ended well, coarse one first."""
    pairs = []
    for group in by_scene(runs).values():
        recipes: dict[BodyRecipe, list[Run]] = {}
        for run in group:
            body = run.case.body
            if body.kind == "quadratic" and body.graded and run.record.status == Status.OK:
                recipes.setdefault(_without_nodes(body), []).append(run)
        for sizes in recipes.values():
            sizes.sort(key=lambda run: run.case.body.nodes)
            pairs += [pair for pair in pairwise(sizes) if pair[0].case.body != pair[1].case.body]
    return pairs


def _without_nodes(body: BodyRecipe) -> BodyRecipe:
    return replace(body, nodes=BodyRecipe().nodes)


def _verdict(scene: str, coarse: Run, fine: Run) -> Verdict:
    between, wish = apart(coarse, fine), usual_wish(fine.case.scene)
    nodes = f"{coarse.case.body.nodes:,} and {fine.case.body.nodes:,} nodes"
    parts = [
        f"{value:.2g} % in {name}"
        for name, value in (("force", between.force), ("displacement", between.displacement))
        if value == value
    ]
    facets, share, reason = contact_facets(fine), allowed_share(fine.case.scene), doubt(coarse.case, fine.case)
    few = f"; {facets:.0f} facets touch" if facets == facets else ""
    why = f"two meshes ({nodes}) differ by {' and '.join(parts)}{few}"
    if reason:
        return Verdict(scene, False, f"{reason}; {why}")
    return Verdict(scene, within(between, wish, share), f"{why}; allowed: {share:g} times the target")


def doubt(coarse: Case, fine: Case) -> str:
    """Why the finer of two bodies of a scene is not trusted, however near they are; empty for what was measured:
    adaptive bodies with ENOUGH nodes, next to one with at most COARSER_SHARE of them, in scenes without cuts
    (docs/population.md)."""
    if fine.body.nodes < ENOUGH:
        return f"meshes with fewer than {ENOUGH:,} nodes may agree and be wrong"
    if coarse.body.nodes > COARSER_SHARE * fine.body.nodes:
        return "meshes with nearly as many nodes agree even when both are wrong"
    if fine.body.graded != ADAPTIVE:
        return "the rule is measured for adaptive bodies alone"
    return "the rule is not measured for scenes with cuts" if fine.scene.cuts else ""


def allowed_share(scene: Scene) -> float:
    """What of the target the two bodies may differ by."""
    return SHARE_OF_HANGING if load_of(scene) == "sag" else SHARE


def within(between: Apart, wish: Wish, share: float) -> bool:
    """Whether two meshes agree to `share` of the wished errors: the error of the finer is likely within them."""
    pairs = ((between.force, wish.force), (between.displacement, wish.displacement))
    compared = [(value, bound) for value, bound in pairs if value == value and bound is not None]
    return bool(compared) and all(value <= share * bound for value, bound in compared)
