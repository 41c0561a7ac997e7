"""The case that words on the command line name."""

from typing import Annotated

import typer

from studies.base.errors import StudyError
from studies.base.lookup import lookup
from studies.catalog.study import Study
from studies.runs.case import BodyRecipe, Case
from studies.runs.own import methods_by_name
from studies.sweep.find_scene import find_scene

MethodName = Annotated[str, typer.Option(help="see `organbench list`")]
BodyKind = Annotated[str, typer.Option(help="tetrahedral, quadratic or surface")]
SurfaceNodes = Annotated[int, typer.Option(help="surface nodes")]
SHOWN = 8
"""Cases named where a part of a name fits several."""


def chosen_case(scene: str, method: str, body: str, nodes: int) -> Case:
    """`method` on a body of so many surface nodes in a scene. scene: as find_scene takes it.

    Raises StudyError for a word that names none.
    """
    chosen = find_scene(scene)  # first: a file brings its own methods
    kind = lookup(body, ("tetrahedral", "quadratic", "surface"), "body")
    return Case(
        scene=chosen,
        body=BodyRecipe(kind, nodes),  # type: ignore[arg-type]
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
