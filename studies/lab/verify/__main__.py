"""`python -m studies.lab.verify [--fast] [--results DIR]`: the reference against problems whose answers are known.

Writes verify.csv, verify.md, the convergence chart and what kappa/mu does to DIR/verify. Exit code 1: a check failed.
"""

import argparse
import sys
from pathlib import Path

import pandas as pd

from studies.lab.verify.ngsolve_code import available
from studies.lab.verify.pack import Verdict, run_pack, tolerance, write_kappa, write_verdicts


def main(words: list[str]) -> int:
    """`--fast`: the fast half, in a folder of its own: it must not stand where the whole pack stood."""
    parser = argparse.ArgumentParser(prog="python -m studies.lab.verify", description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--fast", action="store_true", help="only the fast half, in a minute")
    parser.add_argument("--results", type=Path, default=Path("results"))
    given = parser.parse_args(words)
    verdicts = run_pack(given.fast, show)
    folder = given.results / ("smoke/verify" if given.fast else "verify")
    for path in write_verdicts(folder, verdicts) + ([] if given.fast else write_kappa(folder)):
        print(path)
    if not available():
        print("no second opinion: NGSolve is not installed (pip install organbench[crosscheck])")
    failed = [f"{v.oracle.name}: {check.quantity}" for v in verdicts for check in v.failed]
    count = sum(len(verdict.outcome.checks) for verdict in verdicts)
    print(f"{count - len(failed)} of {count} checks passed", *(f"off: {one}" for one in failed), sep="\n")
    return int(bool(failed))


def show(verdict: Verdict) -> None:
    """Prints one oracle's numbers."""
    oracle = verdict.oracle
    print(f"{oracle.title} ({oracle.name}), {verdict.seconds:.1f} s. Source: {oracle.source}")
    rows = [
        {
            "quantity": check.quantity,
            "unit": check.unit,
            "expected": f"{check.expected:.7g}",
            "got": f"{check.got:.7g}",
            "deviation": f"{check.deviation:.2e}",
            "allowed": tolerance(check),
            "": "ok" if check.met else "OFF",
            "mesh": check.mesh,
            "unknowns": f"{check.unknowns:,}",
        }
        for check in verdict.outcome.checks
    ]
    print(pd.DataFrame(rows).to_string(index=False), end="\n\n", flush=True)


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
