"""`organbench publish`: what the repository shows becomes what is stored."""

from pathlib import Path
from typing import Annotated

import typer
from rich.console import Console

from studies import publish as publishing
from studies.catalog import STUDIES

console = Console(soft_wrap=True)


def publish(
    results: Annotated[
        Path, typer.Option("--results", envvar="ORGANBENCH_RESULTS", help="folder of the results")
    ] = Path("results"),
) -> None:
    """Copies tables and charts to results/published, and the summary into README.md; refuses stale results."""
    copies, absent = publishing.publish(results, STUDIES, Path("."))
    for path in copies:
        console.print(str(path), markup=False, highlight=False)
    if absent:
        again = "; ".join(f"{name}: {publishing.EXTRAS[name]}" for name in absent)
        console.print(f"not made again, stays as published: {again}", markup=False, highlight=False)
