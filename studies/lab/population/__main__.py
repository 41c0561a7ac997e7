"""`python -m studies.lab.population [RESULTS]`: the tables of random organs from the runs of `organbench run`."""

import argparse
import sys
from pathlib import Path

from studies import load_runs
from studies.lab.population.intervals import PAIRS, pairs_of
from studies.lab.population.study import POPULATION, STUDY
from studies.lab.population.tables import members_of, worst_of

TEXTS = {
    "population.md": members_of,
    "worst.md": worst_of,
    PAIRS: lambda runs: pairs_of(runs).to_csv(index=False, float_format="%.4g").rstrip(),
}


def main(results: Path) -> None:
    runs, problems = load_runs(results, STUDY)
    for name, text in TEXTS.items():
        path = results / POPULATION / name
        path.write_text(text(runs) + "\n", encoding="utf-8")
        print(path)
    print(*problems, sep="\n", file=sys.stderr)


if __name__ == "__main__":
    parser = argparse.ArgumentParser(prog="python -m studies.lab.population", description=__doc__)
    parser.add_argument("results", type=Path, nargs="?", default=Path("results"))
    main(parser.parse_args().results)
