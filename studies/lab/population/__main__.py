"""`python -m studies.lab.population [RESULTS [FOLDER ...]]`: the tables and charts of random organs from the runs of
`organbench run`, and from the tables of FOLDERs, of members that ran on other machines by the same code."""

import argparse
import sys
from dataclasses import replace
from pathlib import Path

import pandas as pd

from studies import StudyError, load_runs
from studies.lab.population.charts import write
from studies.lab.population.intervals import PAIRS, pairs_of
from studies.lab.population.rows import KEY, groups, key, merged, rows_of
from studies.lab.population.study import POPULATION, STUDY
from studies.lab.population.tables import members_of
from studies.lab.refusal import refusal

TABLE = f"{POPULATION}.csv"


def main(results: Path, *others: Path) -> None:
    """Raises StudyError where no member has run, and for a FOLDER without the tables of one code."""
    for other in others:
        if not all((other / name).is_file() for name in (TABLE, PAIRS)):
            raise StudyError(f"{other} has no {TABLE} and {PAIRS}; give a folder that this command wrote")
    known = pd.concat([pd.DataFrame(columns=KEY), *(pd.read_csv(other / TABLE) for other in others)])
    there = set(known[KEY].itertuples(index=False, name=None))
    missing = tuple(case for case in STUDY.cases if key(case) not in there)
    runs, problems = load_runs(results, replace(STUDY, cases=missing))
    if not runs and known.empty:
        raise StudyError(f"no random organ has run in {results}; organbench run studies/lab/population/study.py")
    rows = merged([known, rows_of(runs, STUDY.columns)], STUDY.cases)
    pairs = [pd.DataFrame(columns=["scene"]), pairs_of(runs), *(pd.read_csv(other / PAIRS) for other in others)]
    folder, every = results / POPULATION, groups(rows, STUDY.cases)
    folder.mkdir(parents=True, exist_ok=True)
    rows.to_csv(folder / TABLE, index=False, float_format="%.6g")
    pd.concat(pairs).drop_duplicates("scene").to_csv(folder / PAIRS, index=False, float_format="%.4g")
    (folder / "population.md").write_text(members_of(every) + "\n", encoding="utf-8")
    write(every, folder)
    ran = set(rows["scene"])
    print(folder, f"{len(ran)} of {len(STUDY.scenes)} members", sep="\n")
    print(*(problem for problem in problems if any(name in problem for name in ran)), sep="\n", file=sys.stderr)


if __name__ == "__main__":
    parser = argparse.ArgumentParser(prog="python -m studies.lab.population", description=__doc__)
    parser.add_argument("results", type=Path, nargs="?", default=Path("results"))
    parser.add_argument("folders", type=Path, nargs="*")
    given = parser.parse_args()
    with refusal("population"):
        main(given.results, *given.folders)
