"""Families of bodies, from the body of the paper to quadratic elements, with their names, colours and markers."""

from dataclasses import dataclass
from typing import Literal

from massspring import LITERATURE, METHODS
from massspring.body.smoothed import edge_smoothed
from studies.plots.style.style import (
    BLACK,
    BLUE,
    GREEN,
    GREY,
    LITERATURE_COLOURS,
    MUTED,
    ORANGE,
    PURPLE,
    SKY,
    VERMILLION,
    YELLOW,
    method_colour,
)
from studies.runs.case import Case
from studies.runs.recipes import ADAPTIVE, VIRTUAL

PAPER = "the paper's body"


@dataclass(frozen=True)
class Family:
    """Bodies that differ only in size, masses, contact and step."""

    name: str
    colour: str
    marker: str | tuple[int, Literal[0, 1, 2], int]
    """Marker as matplotlib names it, or (number of corners, 0 for a polygon and 1 for a star, rotation [degrees])."""


SMOOTH = "smooth"
"""Key in place of the volumes for a body of smoothed springs, which has one volume per node."""

FAMILIES: dict[tuple[str, bool | str, str], Family] = {
    ("surface", False, "scene"): Family(PAPER, BLACK, "s"),
    ("tetrahedral", False, "scene"): Family("tetrahedra, one volume", VERMILLION, "o"),
    ("tetrahedral", False, "regions"): Family("tetrahedra, some volumes", ORANGE, "D"),
    ("tetrahedral", False, "nodal"): Family("tetrahedra, a volume per node", PURPLE, "^"),
    ("tetrahedral", False, SMOOTH): Family("tetrahedra, smoothed over edges", MUTED[0], "d"),
    ("quadratic", False, "vertex"): Family("quadratic, uniform", SKY, "P"),
    ("quadratic", True, "vertex"): Family("quadratic, graded", BLUE, "*"),
    ("quadratic", ADAPTIVE, "vertex"): Family("quadratic, adaptive", GREEN, (5, 1, 36)),
    ("quadratic", False, "mixed"): Family("quadratic, uniform, mixed", LITERATURE_COLOURS[2], (6, 1, 0)),
    ("quadratic", ADAPTIVE, "mixed"): Family("quadratic, adaptive, mixed", LITERATURE_COLOURS[1], (8, 1, 0)),
    ("tetrahedral", True, "scene"): Family("tetrahedra, graded", MUTED[4], "v"),
}
"""(kind of body, whether it is graded, its volumes) -> family; no two markers are alike."""
VIRTUAL_NODES = Family("tetrahedra, virtual nodes along a cut", MUTED[8], "8")
CONTESTANTS: dict[tuple[str, str], Family] = {
    ("explicit_elements", "tetrahedral"): Family("explicit elements, linear", MUTED[7], "<"),
    ("explicit_elements", "quadratic"): Family("explicit elements, quadratic", MUTED[2], ">"),
    ("implicit_elements", "tetrahedral"): Family("implicit elements, linear", YELLOW, "p"),
    ("implicit_elements", "quadratic"): Family("implicit elements, quadratic", MUTED[1], "h"),
    ("angular_springs", "tetrahedral"): Family("angular springs", MUTED[6], "X"),
    ("chain_mail", "tetrahedral"): Family("chain mail", MUTED[3], "H"),
    ("linear_modes", "quadratic"): Family("linear modes", MUTED[5], (4, 1, 0)),
    ("elastic_response", "quadratic"): Family("elastic response, precomputed", MUTED[9], (4, 0, 20)),
}
"""Alternatives to mass-spring bodies: (method, kind of body) -> family."""
OUTSIDE = "X"
"""Marker of methods that are not ours."""
OUR_METHODS = tuple(method.name for method in (*METHODS, *LITERATURE))
WHOLE = "implicit_volume"
"""The method that a family does not name."""


def family_of(case: Case) -> Family:
    """The family of a case: of CONTESTANTS by its method, or for the method WHOLE of FAMILIES by its body.

    A known body with a method that is not ours has the colour of that method. Every other case is grey, with its series
    and method as the name.
    """
    body = case.body
    element = CONTESTANTS.get((case.method.name, body.kind))
    if element is not None:
        return element
    volumes = SMOOTH if body.law == edge_smoothed.__name__ else body.volumes
    family = VIRTUAL_NODES if body.cut == VIRTUAL else FAMILIES.get((body.kind, body.graded, volumes))
    if family is not None and case.method.name == WHOLE:
        return family
    if family is not None and case.method.name not in OUR_METHODS:
        # An entry of another program, or a method of the user.
        return Family(f"{case.method.name.replace('_', ' ')}, {body.kind}", method_colour(case.method.name), OUTSIDE)
    own = "" if case.method.name == WHOLE else f", {case.method.name.replace('_', ' ')}"
    return Family(f"{body.series}{own}", GREY, "X" if family is None else family.marker)
