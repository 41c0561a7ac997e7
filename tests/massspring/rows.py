"""Rows of the method tests, generated from what the methods support: no combination is made to be skipped."""

from collections.abc import Iterable, Iterator, Sequence

import pytest

from massspring import METHODS, Method
from massspring.methods import VARIANTS

CONTESTANTS: dict[str, Method] = {
    **{method.name: method() for method in METHODS},
    "element_hard": VARIANTS[0],
    "xpbd_whole": VARIANTS[1],
    "implicit_volume_recovers": VARIANTS[2],
    "explicit_elements_corotated": VARIANTS[3],
    "implicit_elements_corotated": VARIANTS[4],
}
"""Every method by default, and those with a switch the other way round."""
KINDS = ("block", "ball", "hollow", "regions", "nodal")
"""Of bodies: fixture `kept_body`."""
SUPPORTED = {
    "none": KINDS,
    "several": KINDS,
    "whole": ("block", "ball"),
    "tetrahedra": ("block",),
    "points": (),
    "elements": (),
}
"""What a method keeps -> the kinds of bodies that it can advance; test_capabilities.py holds it against `Setup`.
Quadratic bodies have tests of their own (methods/test_quadratic_motion.py), and so have elements (elements)."""


COSTLY = {("implicit_springs", "regions"), ("implicit_springs", "nodal")}
"""Several volumes again, which the hollow body keeps with the same code: a campaign."""


def recovers(method: Method) -> bool:
    """Whether a body that is far from its volumes is another one until it is back."""
    return getattr(method, "recovers", False)


def kinds_of(method: Method) -> tuple[str, ...]:
    """The kinds of bodies that a method can advance; what recovers needs tetrahedra."""
    kinds = SUPPORTED[method.capabilities.keeps]
    return tuple(kind for kind in kinds if kind != "ball") if recovers(method) else kinds


def rows(methods: Iterable[str] = CONTESTANTS, kinds: Sequence[str] = KINDS) -> list:
    """(name in CONTESTANTS, kind of body), of all that go together."""
    pairs = [(name, kind) for name in methods for kind in kinds_of(CONTESTANTS[name]) if kind in kinds]
    return [pytest.param(pair, id="-".join(pair), marks=marks_of(pair)) for pair in pairs]


def marks_of(row: Sequence[object]) -> tuple[pytest.MarkDecorator, ...]:
    """Of a row that begins with a method and a kind of body."""
    return (pytest.mark.campaign,) if tuple(row[:2]) in COSTLY else ()


Row = tuple[str, str, str, object]
"""Name in CONTESTANTS, kind of body, precision, option."""


def by_pairs(options: Sequence[object], exclude: Iterable[tuple[str, object]] = ()) -> Iterator[Row]:
    """Rows in which every pair meets that goes together, without the product of all.

    Methods, bodies and precisions in full with the first option, each other option on two bodies, which change from
    method to method. `exclude`: (kind of body, option) that do not go together.
    """
    excluded = set(exclude)
    for i, (name, method) in enumerate((one, other) for one, other in CONTESTANTS.items() if kinds_of(other)):
        kinds = kinds_of(method)
        for precision in ("float64", "float32") if method.capabilities.float32 else ("float64",):
            for j, option in enumerate(options):
                fitting = [kind for kind in kinds if (kind, option) not in excluded]
                two = {fitting[(2 * i + 2 * j + k) % len(fitting)]: None for k in range(2)}
                taken = fitting if j == 0 else two
                for kind in taken:
                    yield name, kind, precision, option
