"""Words on the command line as values: a case, and bounds as people type them (3% or 0.03, 1ms or 250us)."""

import re
from typing import Annotated

import typer

from studies.base.errors import StudyError
from studies.base.lookup import lookup
from studies.catalog.study import Study
from studies.runs.case import Case
from studies.runs.recipes import ADAPTIVE, BODIES, QuadraticBody
from studies.runs.user_code import methods_by_name
from studies.sweep.find_scene import find_scene

MethodName = Annotated[str, typer.Option(help="see `organbench list methods`")]
BodyKind = Annotated[str, typer.Option(help="tetrahedral, quadratic, adaptive (quadratic), surface or membrane")]
SurfaceNodes = Annotated[int, typer.Option(help="surface nodes")]
SHOWN = 8
"""Cases named where a part of a name fits several."""


def chosen_case(scene: str, method: str, body: str, nodes: int) -> Case:
    """`method` on a body of so many surface nodes in a scene. scene: as find_scene takes it.

    Raises StudyError for a word that names none.
    """
    chosen = find_scene(scene)  # first: a file brings its own methods
    kind = lookup(body, (*BODIES, ADAPTIVE), "body")
    return Case(
        scene=chosen,
        body=QuadraticBody(nodes, graded=ADAPTIVE) if kind == ADAPTIVE else BODIES[kind](nodes),
        method=lookup(method, methods_by_name(), "method")(),
    )


def case_named(study: Study, text: str) -> Case:
    """The case of a study with the name `text`, or the only one whose name contains it.

    Raises StudyError with the nearest name where none does, and with the names where several do.
    """
    by_name = {case.name: case for case in study.cases}
    matches = [name for name in by_name if text in name]
    if text in by_name or not matches:
        return lookup(text, by_name, f"case of {study.name}")
    if len(matches) > 1:
        more = f" and {len(matches) - SHOWN} more" if len(matches) > SHOWN else ""
        raise StudyError(
            f"{len(matches)} cases of {study.name} have {text!r} in their name: {', '.join(matches[:SHOWN])}{more}; "
            "give more of it"
        )
    return by_name[matches[0]]


NUMBER = r"\s*([0-9]*\.?[0-9]+(?:[eE][+-]?[0-9]+)?)\s*"
PER_MS = {"s": 1e3, "ms": 1.0, "us": 1e-3, "µs": 1e-3, "μs": 1e-3}
"""Units of computing time for 1 ms of simulated time, in ms."""


def share(text: str, noun: str) -> float | None:
    """A share [1], None for no text. Raises StudyError for what is no share, or none above 0 and up to 1."""
    if not text:
        return None
    match = re.fullmatch(f"{NUMBER}(%?)\\s*", text)
    value = float(match[1]) / (100.0 if match[2] else 1.0) if match else 0.0
    if not 0.0 < value <= 1.0:
        raise StudyError(
            f"{noun} {text!r} is not a tolerance; give a share above 0 and up to 100 %, such as 3% or 0.03"
        )
    return value


def budget(text: str) -> float | None:
    """Computing over simulated time [1], from computing time per 1 ms simulated; None for no text. Raises as above."""
    if not text:
        return None
    match = re.fullmatch(f"{NUMBER}({'|'.join(PER_MS)})\\s*", text)
    value = float(match[1]) * PER_MS[match[2]] if match else 0.0
    if not 0.0 < value < float("inf"):
        raise StudyError(
            f"budget {text!r} is not a time; give the computing time per 1 ms of simulated time, such as 1ms or 250us"
        )
    return value
