"""`organbench publish`: what the repository shows becomes what is stored."""

from pathlib import Path

from studies.catalog import STUDIES
from studies.cli.terminal import Results, console
from studies.report import publish as publishing


def publish(
    results: Results = Path("results"),
) -> None:
    """Copies tables and charts to results/published, and the summary into README.md; refuses stale results."""
    copies, absent = publishing.publish(results, STUDIES, Path("."))
    for path in copies:
        console.print(str(path), markup=False, highlight=False)
    if absent:
        again = "; ".join(f"{name}: {publishing.EXTRAS[name]}" for name in absent)
        console.print(f"not made again, stays as published: {again}", markup=False, highlight=False)
