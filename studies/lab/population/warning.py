"""Whether the comparison of two meshes named the bodies that are wrong, as their references show."""

from collections.abc import Sequence
from typing import NamedTuple

from studies import Run
from studies.metrics.judged import DISPLACEMENT, FORCE
from studies.metrics.trust import Apart, allowed_share, apart, doubt_of, pairs_of, within
from studies.metrics.wish import usual_wish


class Judgement(NamedTuple):
    """Result of the comparison of two meshes in a scene, and of that with its reference."""

    scene: str
    nodes: int
    """Nodes of the finer body."""
    apart: Apart
    alike: bool
    """Whether the difference of the two is within the target errors."""
    trusted: bool
    within: bool
    """Whether the errors of the finer body are within the target."""


def judgements(runs: Sequence[Run]) -> list[Judgement]:
    """Judgements of each scene with a reference, for neighbouring sizes of each graded quadratic recipe. Only a finer
    body with ENOUGH nodes may be trusted."""
    judged = []
    for coarse, fine in pairs_of([run for run in runs if run.reference is not None]):
        scene, between = fine.case.scene, apart(coarse, fine)
        wish = usual_wish(scene)
        errors = ((FORCE, wish.force), (DISPLACEMENT, wish.displacement))
        values = [(abs(entry(fine)), bound) for entry, bound in errors if bound is not None]
        right = [value <= bound for value, bound in values if value == value]
        if not right:  # no error is known
            continue
        trusted = not doubt_of(coarse, fine) and within(between, wish, allowed_share(scene))
        alike = within(between, wish, 1.0)
        judged.append(Judgement(scene.name, fine.case.body.nodes, between, alike, trusted, all(right)))
    return judged


class Tally(NamedTuple):
    """Counts of judgements."""

    beyond: int
    """Scenes whose error exceeds the target."""
    named: int
    """Of these those that are not trusted."""
    within: int
    """Scenes whose error is within the wish."""
    doubted: int
    """Of these those that are not trusted."""


def tally(judged: Sequence[Judgement]) -> Tally:
    """Counts how many bodies beyond the target are not trusted, and how many within it are not trusted."""
    bad, good = [one for one in judged if not one.within], [one for one in judged if one.within]
    return Tally(len(bad), sum(not one.trusted for one in bad), len(good), sum(not one.trusted for one in good))
