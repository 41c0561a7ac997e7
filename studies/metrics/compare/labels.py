"""Short names for cases of which no two are equal."""

from collections import defaultdict
from collections.abc import Iterable

from studies.metrics.compare.folders import Named

MORE: tuple[tuple[str, ...], ...] = ((), ("law",), ("step",), ("law", "step"), ("recipe",))
"""What a name holds besides body, nodes and method, in the order in which it is tried."""


def labels_of(cases: Iterable[Named]) -> dict[Named, str]:
    """Body, nodes and method of each case, and as much more as tells the cases of a study and scene apart."""
    alike = defaultdict[tuple[str, ...], set[Named]](set)
    for case in cases:
        alike[case.study, case.scene, _label(case, ())].add(case)
    labels = dict[Named, str]()
    for group in alike.values():
        more = next(one for one in MORE if len({_label(case, one) for case in group}) == len(group))
        labels |= {case: _label(case, more) for case in group}
    return labels


def _label(case: Named, more: tuple[str, ...]) -> str:
    words = {"law": case.law, "step": f"step {case.step}", "recipe": case.recipe}
    return ", ".join(filter(None, [case.body, case.nodes, case.method, *(words[name] for name in more)]))
