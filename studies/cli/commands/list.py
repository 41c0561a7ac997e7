"""`organbench list`: what there is to name."""

from collections.abc import Callable, Sequence
from typing import Annotated

import typer
from rich.markup import escape
from rich.table import Table

from studies.base.lookup import lookup
from studies.cli import outline
from studies.cli.terminal import console
from studies.geometry.organs import SHAPES
from studies.scene.library import CUT, SCENES

KINDS: dict[str, Callable[[], Sequence[tuple[str, str]]]] = {
    "studies": outline.studies,
    "scenes": lambda: [(scene.name, scene.title) for scene in (*SCENES, *CUT)],
    "organs": lambda: [(name, (make.__doc__ or "").strip().split("\n")[0]) for name, make in SHAPES.items()],
    "methods": outline.methods,
    "metrics": outline.metrics,
}
"""What can be listed: names, each with its line."""


def list(kind: Annotated[str, typer.Argument(help=f"one of {', '.join(KINDS)}; default: all")] = "") -> None:
    """List studies, scenes, organs, methods and metrics."""
    if kind:
        lookup(kind, KINDS, "kind of name")
    for title, rows in KINDS.items():
        if kind in ("", title):
            table = Table(title=None if kind else title, title_justify="left", show_header=False, box=None)
            for row in rows():
                table.add_row(*map(escape, row))
            console.print(table)
