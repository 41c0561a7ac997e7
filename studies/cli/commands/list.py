"""`organbench list`: what there is to name."""

from typing import Annotated

import typer
from rich.markup import escape
from rich.table import Table

from massspring import LITERATURE, METHODS
from studies.base.lookup import lookup
from studies.catalog import STUDIES
from studies.cli.terminal import console
from studies.geometry.organs import SHAPES
from studies.metrics.metrics import METRICS
from studies.scene.library import CUT, SCENES

KINDS = {
    "studies": [(study.name, study.question) for study in STUDIES],
    "scenes": [(scene.name, scene.title) for scene in (*SCENES, *CUT)],
    "organs": [(name, make.__doc__) for name, make in SHAPES.items()],
    "methods": [(method.name, method.__doc__) for method in (*METHODS, *LITERATURE)],
    "metrics": [(metric.name, metric.of.__doc__) for metric in METRICS],
}
"""What can be listed: names, each with a text whose first paragraph is shown."""


def list(kind: Annotated[str, typer.Argument(help=f"one of {', '.join(KINDS)}; default: all")] = "") -> None:
    """List studies, scenes, organs, methods and metrics."""
    if kind:
        lookup(kind, KINDS, "kind of name")
    for title, rows in KINDS.items():
        if kind in ("", title):
            table = Table(title=None if kind else title, title_justify="left", show_header=False, box=None)
            for name, text in rows:
                table.add_row(escape(name), escape(" ".join((text or "").split("\n\n")[0].split())))
            console.print(table)
