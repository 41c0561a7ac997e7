"""`organbench verify`: the reference against problems whose answers are known, and published references again."""

from pathlib import Path
from typing import Annotated

import pandas as pd
import typer

from reference_fem import crosscheck
from studies.cli.terminal import Results, console
from studies.store.stamps import set_stamp
from studies.tools.verify.references import published_scenes, solved_again
from studies.tools.verify.verification import FOLDER, Verdict, run_pack, tolerance, write_kappa, write_verdicts

FAST = "smoke"
"""The fast half is kept apart: a part of the pack must not stand where the whole of it stood."""


def verify(
    fast: Annotated[bool, typer.Option("--fast", help="only the fast half, in a minute")] = False,
    references: Annotated[bool, typer.Option("--references", help="solve the published references again")] = False,
    results: Results = Path("results"),
) -> None:
    """Check the reference against known solutions and other codes. Exit code 1: a check failed."""
    if references:
        verify_references()
        return
    verdicts = run_pack(results, fast, show)
    root = results / FAST if fast else results
    written = write_verdicts(root / FOLDER, verdicts)
    if not fast:
        written += write_kappa(root / FOLDER)
        set_stamp(root, FOLDER)
    for path in written:
        console.print(str(path), markup=False, highlight=False)
    if not crosscheck.available():
        console.print("no second opinion: NGSolve is not installed (pip install organbench[crosscheck])", markup=False)
    count = sum(len(verdict.outcome.checks) for verdict in verdicts)
    failed = [f"{v.oracle.name}: {check.quantity}" for v in verdicts for check in v.failed]
    console.print(f"{count - len(failed)} of {count} checks passed", highlight=False)
    if failed:
        console.print("off: " + "; ".join(failed), markup=False, highlight=False)
        raise typer.Exit(1)


def verify_references() -> None:
    """Solves published references again, by the plans of their scenes, and says of each whether it is within the bars.
    Exit code 1: one is not."""
    off = 0
    for scene in published_scenes().values():
        checks = solved_again(scene)
        bad = [check for check in checks if not check.met]
        off += bool(bad)
        words = ", ".join(f"{check.quantity} {check.deviation:.2g} of {check.tolerance:.2g}" for check in checks)
        console.print(f"{scene.name}: {'OFF' if bad else 'within its bars'} ({words})", markup=False, highlight=False)
    if off:
        raise typer.Exit(1)


def show(verdict: Verdict) -> None:
    """Prints one oracle's numbers."""
    oracle = verdict.oracle
    title = f"{oracle.title} ({oracle.name}), {verdict.seconds:.1f} s. Source: {oracle.source}"
    console.print(title, style="bold", markup=False, highlight=False)
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
    console.print(pd.DataFrame(rows).to_string(index=False), markup=False, highlight=False)
    console.print()
