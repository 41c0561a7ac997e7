"""The case that words on the command line name."""

from typing import Annotated

import typer

from studies.base.lookup import lookup
from studies.runs.case import BodyRecipe, Case
from studies.runs.own import methods_by_name
from studies.scenes import SCENES

MethodName = Annotated[str, typer.Option(help="see `organbench list`")]
BodyKind = Annotated[str, typer.Option(help="tetrahedral, quadratic or surface")]
SurfaceNodes = Annotated[int, typer.Option(help="surface nodes")]


def chosen_case(scene: str, method: str, body: str, nodes: int) -> Case:
    """`method` on a body of so many surface nodes in a scene. Raises StudyError for a word that names none."""
    kind = lookup(body, ("tetrahedral", "quadratic", "surface"), "body")
    return Case(
        scene=lookup(scene, {s.name: s for s in SCENES}, "scene"),
        body=BodyRecipe(kind, nodes),  # type: ignore[arg-type]
        method=lookup(method, methods_by_name(), "method")(),
    )
