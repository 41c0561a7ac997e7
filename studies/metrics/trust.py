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
from studies.runs.case import BodyRecipe
from studies.scene.kind import load_of
from studies.scene.quantities import allowed
from studies.scene.scene import Scene
from studies.store.record import Status

ENOUGH = 1594
"""Nodes with which adaptive bodies of 95 of 100 random organs are within the target (docs/population.md)."""
SHARE, SHARE_OF_ENOUGH = 1.0, 1.5
"""Of the wished error by which two meshes may differ, and if the finer has ENOUGH nodes: most of the difference is then
the error of the coarser."""
SHARE_OF_HANGING = 0.5
"""The same for an organ that hangs, with ENOUGH nodes: both meshes lack the same at the outline by which it hangs."""


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
    """ "two meshes (994 and 1,194 nodes) differ by 0.4 % in force and 0.2 % in displacement"."""


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
    nodes: tuple[int, int]
    """Asked for, of both bodies."""
    apart: Apart
    trusted: bool
    within: bool
    """Whether the errors of the finer body are within the wish."""


def judgements(runs: Sequence[Run]) -> list[Judgement]:
    """Of each scene with a reference and of each two neighbouring sizes of a graded quadratic recipe."""
    found = []
    for coarse, fine in _pairs([run for run in runs if run.reference is not None]):
        scene, between = fine.case.scene, apart(coarse, fine)
        wish = usual_wish(scene)
        errors = ((FORCE, wish.force), (DISPLACEMENT, wish.displacement))
        values = [(abs(entry(fine)), bound) for entry, bound in errors if bound is not None]
        known = [value <= bound for value, bound in values if value == value]
        if not known:  # nothing says whether it is right
            continue
        nodes = (coarse.case.body.nodes, fine.case.body.nodes)
        found.append(
            Judgement(scene.name, nodes, between, within(between, wish, allowed_share(scene, nodes[1])), all(known))
        )
    return found


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


def tally(found: Sequence[Judgement]) -> Tally:
    """How many of the bad are named and how many of the good are doubted."""
    bad, good = [one for one in found if not one.within], [one for one in found if one.within]
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
    facets, share = contact_facets(fine), allowed_share(fine.case.scene, fine.case.body.nodes)
    few = f"; {facets:.0f} facets touch" if facets == facets else ""
    why = f"two meshes ({nodes}) differ by {' and '.join(parts)}{few}"
    if not share:
        why = f"what hangs needs {ENOUGH:,} nodes: coarser meshes agree and are wrong; {why}"
    elif share != SHARE:
        why += f"; allowed: {share:g} times the target"
    return Verdict(scene, within(between, wish, share), why)


def allowed_share(scene: Scene, nodes: int) -> float:
    """What of the target two meshes may differ by, the finer with `nodes` on its outer surface; 0 where no difference
    shows that the finer is right. Chosen on 141 random organs (docs/population.md): of nine hanging spleens beyond the
    target with 1,194 nodes, seven differed by less than half of it from 994."""
    if load_of(scene) == "sag":
        return SHARE_OF_HANGING if nodes >= ENOUGH else 0.0
    return SHARE_OF_ENOUGH if nodes >= ENOUGH else SHARE


def within(between: Apart, wish: Wish, share: float) -> bool:
    """Whether two meshes agree to `share` of the wished errors, if it is above 0: then the error of the finer is likely
    within them."""
    pairs = ((between.force, wish.force), (between.displacement, wish.displacement))
    known = [(value, bound) for value, bound in pairs if value == value and bound is not None]
    return bool(known) and share > 0.0 and all(value <= share * bound for value, bound in known)
