"""`python -m studies.lab.silicone`: the silicone beam predicted by both solvers, as silicone.csv and its chart.

About ten minutes. `--programs` lets other programs release the beam and puts their rows into the table that is there.
"""

import argparse
import sys
import tempfile
from pathlib import Path

from studies import StudyError
from studies.lab.league.programs import PROGRAMS, Surroundings
from studies.lab.silicone.chart import Point, draw
from studies.lab.silicone.measured import LOADS
from studies.lab.silicone.predict import FINE, bars, fitted_youngs, predicted, read_table, write_table
from studies.lab.silicone.programs import LIMIT, program_row


def main() -> None:
    """Writes the table row by row, and draws the chart."""
    parser = argparse.ArgumentParser(prog="python -m studies.lab.silicone", description=__doc__)
    parser.add_argument("--results", type=Path, default=Path("results"))
    parser.add_argument("--programs", action="store_true", help="other programs")
    parser.add_argument("--only", choices=[one.name for one in PROGRAMS], help="one of them")
    parser.add_argument("--youngs", type=float, help="E [Pa]; default: fitted to the unloaded beam")
    parser.add_argument("--environments", type=Path, help="folder of the programs' environments")
    asked = parser.parse_args()
    table = asked.results / "silicone" / "silicone.csv"
    table.parent.mkdir(parents=True, exist_ok=True)
    if asked.programs:
        with tempfile.TemporaryDirectory() as folder:
            at = Surroundings(Path(folder), asked.environments or asked.results / "cache" / "environments", LIMIT)
            release(table, asked.only, asked.youngs or fitted_youngs(FINE), at)
    else:
        rows = []
        for row in predicted():
            rows.append(row)
            write_table(table, rows)
            say(row)
    draw(read_table(table), bars(), table.with_suffix(".png"))


def say(row: Point) -> None:
    print(f"{row.who}, {row.newton:g} N: {row.sag:.2f} mm, {row.frequency:.3f} Hz, {row.damping:.4f}", flush=True)


def release(table: Path, only: str | None, youngs: float, at: Surroundings) -> None:
    """Puts the rows of programs into the table in place of those that they have there; what fails is reported on
    standard error."""
    rows = read_table(table)
    for program in (one for one in PROGRAMS if only in (None, one.name)):
        for load in LOADS:
            try:
                row = program_row(program, load, youngs, at)
            except StudyError as problem:
                print(f"{program.name}, {load.newton:g} N: {problem}", file=sys.stderr, flush=True)
                break
            rows = [*(one for one in rows if (one.who, one.newton) != (row.who, row.newton)), row]
            write_table(table, rows)
            say(row)


if __name__ == "__main__":
    main()
