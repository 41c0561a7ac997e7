"""`python -m studies.tools.silicone.main`: the silicone beam predicted by both solvers, as a table and a chart."""

import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Annotated

import typer

from massspring import MassSpringError
from reference_fem import SolveError
from studies.base.errors import StudyError
from studies.plots.silicone import Bar, Point, draw
from studies.tools.silicone.measured import LOADS
from studies.tools.silicone.predict import (
    COARSE,
    CONTESTANTS,
    FINE,
    body_rows,
    fitted_youngs,
    measured_row,
    reference_rows,
)
from studies.tools.silicone.table import write_table

REFERENCE, COARSER = "reference", "reference, coarser mesh"


def predicted() -> Iterator[Point]:
    """All rows; E is fitted on each mesh of the reference, and bodies have that of the finer."""
    yield from map(measured_row, LOADS)
    youngs = fitted_youngs(FINE)
    for contestant in CONTESTANTS:
        yield from body_rows(contestant, youngs)
    yield from reference_rows(COARSE, COARSER, fitted_youngs(COARSE))
    yield from reference_rows(FINE, REFERENCE, youngs)


def bars() -> dict[str, list[Bar]]:
    """What was measured: of the sag its stated uncertainty, of the rest half the difference of the two runs."""
    rows = list(map(measured_row, LOADS))
    return {
        "sag": [Bar(row.newton, row.sag, load.uncertainty) for row, load in zip(rows, LOADS, strict=True)],
        "frequency": [
            Bar(row.newton, row.frequency, 0.5 * abs(load.frequency[1] - load.frequency[0]))
            for row, load in zip(rows, LOADS, strict=True)
        ],
        "damping": [
            Bar(row.newton, row.damping, 0.5 * abs(load.damping[1] - load.damping[0]))
            for row, load in zip(rows, LOADS, strict=True)
        ],
    }


def main(results: Annotated[Path, typer.Option(help="folder of the results")] = Path("results")) -> None:
    """Fits E and the damping on the unloaded beam, predicts the loaded ones (about ten minutes)."""
    folder, rows = results / "silicone", list[Point]()
    folder.mkdir(parents=True, exist_ok=True)
    for row in predicted():
        rows.append(row)
        write_table(folder / "silicone.csv", rows)
        values = f"{row.sag:.2f} mm, {row.frequency:.3f} Hz, {row.damping:.4f}"
        print(f"{row.who}, {row.newton:g} N: {values}", flush=True)
    draw(rows, bars(), folder / "silicone.png")


if __name__ == "__main__":
    try:
        typer.run(main)
    except (StudyError, SolveError, MassSpringError) as problem:
        print(f"silicone: {problem}", file=sys.stderr)
        sys.exit(2)
