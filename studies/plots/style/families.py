"""Families of bodies, from the paper's body to quadratic elements, with a name, a colour and a marker in charts."""

from dataclasses import dataclass
from typing import Literal

from massspring import LITERATURE, METHODS
from massspring.body.smoothed import edge_smoothed
from studies.plots.style.style import (
    BLACK,
    BLUE,
    GREEN,
    GREY,
    MUTED,
    ORANGE,
    PURPLE,
    SKY,
    VERMILLION,
    YELLOW,
    method_colour,
)
from studies.runs.case import ADAPTIVE, VIRTUAL, Case

PAPER = "the paper's body"


@dataclass(frozen=True)
class Family:
    """Bodies that differ by size, masses, contact and step only."""

    name: str
    colour: str
    marker: str | tuple[int, Literal[0, 1, 2], int]
    """As matplotlib names it, or corners, kind (0: polygon, 1: star) and turn [degrees]."""


SMOOTH = "smooth"
"""In place of its volumes: a body of smoothed springs, one volume per node."""

FAMILIES: dict[tuple[str, bool | str, str], Family] = {
    ("surface", False, "scene"): Family(PAPER, BLACK, "s"),
    ("tetrahedral", False, "scene"): Family("tetrahedra, one volume", VERMILLION, "o"),
    ("tetrahedral", False, "regions"): Family("tetrahedra, some volumes", ORANGE, "D"),
    ("tetrahedral", False, "nodal"): Family("tetrahedra, a volume per node", PURPLE, "^"),
    ("tetrahedral", False, SMOOTH): Family("tetrahedra, smoothed over edges", MUTED[0], "d"),
    ("quadratic", False, "scene"): Family("quadratic, uniform", SKY, "P"),
    ("quadratic", True, "scene"): Family("quadratic, graded", BLUE, "*"),
    ("quadratic", ADAPTIVE, "scene"): Family("quadratic, adaptive", GREEN, (5, 1, 36)),
    ("tetrahedral", True, "scene"): Family("tetrahedra, graded", MUTED[4], "v"),
}
"""By kind of body, whether it is graded, and its volumes; colours by Okabe and Ito, no two markers alike."""
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
"""Alternatives to mass-spring bodies, by method and kind of body."""
OUR_METHODS = tuple(method.name for method in (*METHODS, *LITERATURE))
WHOLE = "implicit_volume"
"""The method that needs no name."""


def family_of(case: Case) -> Family:
    """The family of a case; a case in neither FAMILIES nor CONTESTANTS is grey, with the name of its method."""
    body = case.body
    element = CONTESTANTS.get((case.method.name, body.kind))
    if element is not None:
        return element
    volumes = SMOOTH if body.law == edge_smoothed.__name__ else body.volumes
    family = VIRTUAL_NODES if body.cut == VIRTUAL else FAMILIES.get((body.kind, body.graded, volumes))
    if family is not None and case.method.name == WHOLE:
        return family
    if family is not None and case.method.name not in OUR_METHODS:
        # An entry of another program, or a method of one's own.
        return Family(f"{case.method.name.replace('_', ' ')}, {body.kind}", method_colour(case.method.name), "X")
    own = "" if case.method.name == WHOLE else f", {case.method.name.replace('_', ' ')}"
    return Family(f"{body.series}{own}", GREY, "X" if family is None else family.marker)
