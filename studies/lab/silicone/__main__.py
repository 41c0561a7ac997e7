"""`python -m studies.lab.silicone [SCENE]`: measured silicone predicted by both solvers, as tables and a chart.

beam_release: ten minutes; cylinder_press: ten minutes, with `--curves` half a minute; `--data` takes other cylinders of
the same size. `--programs` lets other programs release the beam, and puts their rows into the table that is there, or
press the cylinder between bonded plates.
"""

import argparse
import sys
import tempfile
from collections.abc import Callable, Sequence
from pathlib import Path

import pandas as pd

from studies import StudyError
from studies.lab.league.programs import PROGRAMS, Program, Surroundings
from studies.lab.silicone import press
from studies.lab.silicone.chart import Point, figure, press_figure
from studies.lab.silicone.cylinder import MOONEY, curves, sticking_moduli
from studies.lab.silicone.measured import LOADS
from studies.lab.silicone.predict import FINE, bars, fitted_youngs, predicted, read_table, write_table
from studies.lab.silicone.programs import LIMIT, press_rows, program_row
from studies.plots.style.style import save


def main() -> None:
    """Writes the tables, those of the beam row by row, and draws the chart."""
    parser = argparse.ArgumentParser(prog="python -m studies.lab.silicone", description=__doc__)
    parser.add_argument("scene", nargs="?", choices=("beam_release", "cylinder_press"), default="beam_release")
    parser.add_argument("--results", type=Path, default=Path("results"))
    parser.add_argument("--programs", action="store_true", help="other programs")
    parser.add_argument("--only", choices=[one.name for one in PROGRAMS], help="one of them")
    parser.add_argument("--youngs", type=float, help="E [Pa]; default: fitted to the unloaded beam")
    parser.add_argument("--environments", type=Path, help="folder of the programs' environments")
    parser.add_argument("--data", type=Path, default=press.DATA, help="CSV of presses as the one that is shipped")
    parser.add_argument("--curves", type=Path, help="press_curves.csv of an earlier run, instead of computing it")
    asked = parser.parse_args()
    table = asked.results / "silicone" / "silicone.csv"
    table.parent.mkdir(parents=True, exist_ok=True)
    programs = [one for one in PROGRAMS if asked.only in (None, one.name)]
    if asked.scene == "cylinder_press" and not asked.programs:
        try:
            judge_presses(press.read_runs(asked.data), asked.curves, table.with_name)
        except (OSError, StudyError) as problem:
            print(f"cylinder_press: {problem}", file=sys.stderr)
            sys.exit(2)
        return
    if asked.programs:
        with tempfile.TemporaryDirectory() as folder:
            at = Surroundings(Path(folder), asked.environments or asked.results / "cache" / "environments", LIMIT)
            if asked.scene == "cylinder_press":
                press_by(programs, table.with_name("press_programs.csv"), at)
                return
            release(table, programs, asked.youngs or fitted_youngs(FINE), at)
    else:
        rows = []
        for row in predicted():
            rows.append(row)
            write_table(table, rows)
            say(row)
    save(figure(read_table(table), bars()), table.with_suffix(".png"))


def judge_presses(runs: list[press.Run], known: Path | None, place: Callable[[str], Path]) -> None:
    """Writes press*.csv and press.png; curves are those of the file `known`."""
    if known is None:
        write(curves(), place("press_curves.csv"))
        write(sticking_moduli(), place("press_modulus.csv"))
    table = press.read_curves(known or place("press_curves.csv"))
    found, stick = list(press.options(runs, table)), press.law(table)
    write(press.table_of_materials(runs, table, found), place("press.csv"))
    write(press.table_of_laws(found), place("press_laws.csv"))
    shown = {
        f"{one.kind}, one number by {one.scope}" if one.scope else one.kind: press.of_sample(one.rows, "B").iloc[:, 1:]
        for one in found
        if not one.scope or (one.kind == MOONEY and one.scope != "all")
    }
    spread = press.scatter(found[0].rows, stick)
    save(press_figure(table, press.over_sliding(runs, stick), spread, shown), place("press.png"))


def press_by(programs: Sequence[Program], path: Path, at: Surroundings) -> None:
    """Puts the rows of programs, and of our body, into the table in place of those that they have there."""
    rows = pd.DataFrame(press_rows(programs, at))
    there = [pd.read_csv(path)] if path.is_file() else []
    write(pd.concat([*there, rows]).drop_duplicates("who", keep="last"), path)


def write(table: pd.DataFrame, path: Path) -> None:
    table.to_csv(path, index=False, float_format="%.4g")
    print(f"{path}\n{table.round(3).to_string(index=False)}", flush=True)


def say(row: Point) -> None:
    print(f"{row.who}, {row.newton:g} N: {row.sag:.2f} mm, {row.frequency:.3f} Hz, {row.damping:.4f}", flush=True)


def release(table: Path, programs: Sequence[Program], youngs: float, at: Surroundings) -> None:
    """Puts the rows of programs into the table in place of those that they have there; what fails is reported on
    standard error."""
    rows = read_table(table)
    for program in programs:
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
