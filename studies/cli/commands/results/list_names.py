"""`organbench list`: what there is to name."""

from rich.markup import escape
from rich.table import Table

from studies.cli import outline
from studies.cli.terminal import console
from studies.geometry.organs import SHAPES
from studies.scenes import SCENES


def list_all() -> None:
    """Studies, scenes, organs, methods and metrics, a line each."""
    groups = {
        "studies": outline.studies(),
        "scenes": [(s.name, s.title) for s in SCENES],
        "organs": [(name, (make.__doc__ or "").strip().split("\n")[0]) for name, make in SHAPES.items()],
        "methods": outline.methods(),
        "metrics": outline.metrics(),
    }
    for title, rows in groups.items():
        table = Table(title=title, title_justify="left", show_header=False, box=None)
        for row in rows:
            table.add_row(*map(escape, row))
        console.print(table)
