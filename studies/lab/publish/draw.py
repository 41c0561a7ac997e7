"""`python -m studies.lab.publish.draw`: published rows, drawn at random, are run again and compared.

Exit code 1: a number is not what is published. Times are not compared: they are those of another machine.
"""

import random
import sys
from argparse import ArgumentParser
from collections import defaultdict
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from tempfile import TemporaryDirectory

import pandas as pd

from studies import METRICS, STUDIES, Case, Study, StudyError, load_runs, run_studies, study_table
from studies.lab.refusal import refusal

PUBLISHED = Path("results/published")
SAME = ["scene", "body", "law", "nodes", "stiffness", "method"]
STEP = "dt/dt_c"
"""SAME: columns that are equal in the rows of one case. Where STEP is not, the mesh is another one: gmsh may decide
otherwise on another processor."""
DIFFERS = "DIFFERS"
TIMES = {"cut_ms", *(metric.name for metric in METRICS if metric.spread is not None)}
"""Metrics that are times of this machine; that of a cut is measured once, without a spread."""
PRINTED, NEAR = 1e-5, 1e-3
"""Relative differences: tables have six digits; another processor rounds otherwise, and steps add that up."""
SMALLEST = 1e-6
"""Smaller differences are of round-off whatever the number is: volumes are kept to about so much [%]."""


class Printed:
    """Says how far it is."""

    def begin(self, what: str, total: int) -> None:
        print(f"{what}: {total}", flush=True)

    def advance(self, what: str, note: str) -> None:
        print(f"  {note}", flush=True)


def main(arguments: Sequence[str] | None = None) -> int:
    parser = ArgumentParser(prog="python -m studies.lab.publish.draw", description=__doc__)
    parser.add_argument("--seed", type=int, help="repeats a draw")
    parser.add_argument("--rows", type=int, default=10)
    parser.add_argument("--published", type=Path, default=PUBLISHED)
    given = parser.parse_args(arguments)
    seed = random.randrange(10**6) if given.seed is None else given.seed
    print(f"seed {seed}: `python -m studies.lab.publish.draw --seed {seed}` draws the same rows", flush=True)
    with TemporaryDirectory() as folder:
        table = compared(
            drawn(seed, given.rows, studies_of(given.published), given.published), given.published, Path(folder)
        )
    print(table.to_string(index=False))
    wrong = table["verdict"].tolist().count(DIFFERS)
    print(f"{len(table) - wrong} of {len(table)} rows are what is published")
    return int(wrong > 0)


def studies_of(published: Path) -> list[Study]:
    """The catalogue, and the random organs of the published table: drawing them takes ten seconds."""
    table = published / "population" / "population.csv"
    if not table.is_file():
        return list(STUDIES)
    from studies.lab.population.study import STUDY

    ran = set(pd.read_csv(table)["scene"])
    return [*STUDIES, replace(STUDY, cases=tuple(case for case in STUDY.cases if case.scene.name in ran))]


def drawn(seed: int, count: int, studies: Sequence[Study], published: Path) -> list[Study]:
    """So many cases of studies with a published table, a study first, so that a large one does not fill the draw."""
    rng, cases = random.Random(seed), defaultdict[str, dict[str, Case]](dict)
    tables = [study for study in studies if (published / study.name / f"{study.name}.csv").is_file()]
    while sum(map(len, cases.values())) < count:
        study = rng.choice(tables)
        case = rng.choice(study.cases).replaced(timed=False)
        cases[study.name][case.key] = case
    return [replace(study, cases=tuple(cases[study.name].values()), charts=()) for study in tables if cases[study.name]]


def compared(studies: Sequence[Study], published: Path, folder: Path) -> pd.DataFrame:
    """Runs the cases of `studies` below `folder`; of each the number that differs most from what is published."""
    run_studies(folder, list(studies), 2, Printed())
    lines = []
    for study in studies:
        table = pd.read_csv(published / study.name / f"{study.name}.csv")
        for case in study.cases:
            runs, problems = load_runs(folder, replace(study, cases=(case,)))
            if not runs:
                raise StudyError(f"{study.name}, {case.name}: {problems[0]}")
            (row,) = study_table(runs, study.columns).to_dict("records")
            lines.append({"study": study.name, "case": case.name, **verdict(row, table)})
    return pd.DataFrame(lines)


def verdict(row: dict, table: pd.DataFrame) -> dict:
    """Of a row that was measured now, with the published one of the same case."""
    known = [name for name in SAME if row[name] != ""]  # a case that broke off before its body was made has no law
    rows = [one for one in table.to_dict("records") if all(one[name] == row[name] for name in known)]
    if not rows:
        return {"verdict": DIFFERS, "number": "no such row is published", "by": 1.0}
    steps = [apart(row[STEP], one[STEP]) for one in rows]
    nearest = [one for one, step in zip(rows, steps, strict=True) if step == min(steps)]
    return min((difference(row, one) for one in nearest), key=lambda one: one["by"])


def difference(row: dict, old: dict) -> dict:
    """Of two rows of one case: the number that differs most, and by how much of itself [1]."""
    if row["status"] != old["status"]:
        return {"verdict": DIFFERS, "number": "status", "published": old["status"], "now": row["status"], "by": 1.0}
    names = [name for name in row if name == STEP or (name.endswith("]") and name.split()[0] not in TIMES)]
    by, name = max((apart(row[name], old[name]), name) for name in names if name in old)
    words = "equal" if by <= PRINTED else "near" if by <= NEAR else DIFFERS
    return {"verdict": words, "number": name, "published": old[name], "now": float(f"{row[name]:.6g}"), "by": by}


def apart(now: float, was: float) -> float:
    """Relative difference; 1 where one of the two is not known [1]."""
    if now != now or was != was:
        return float((now != now) != (was != was))
    return abs(now - was) / max(abs(now), abs(was)) if abs(now - was) > SMALLEST else 0.0


if __name__ == "__main__":
    with refusal("draw"):
        sys.exit(main())
