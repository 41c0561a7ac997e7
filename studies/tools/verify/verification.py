"""Runs the oracle pack of the reference and keeps what it found: verify.csv, verify.md and the convergence chart."""

import math
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pandas as pd

from reference_fem import SolveError, oracles
from reference_fem.oracles import Check, Curve, Oracle, Outcome, kappa
from studies.base.atomic import write_whole
from studies.base.errors import StudyError
from studies.plots import verify as convergence
from studies.tools.verify.second_judge import second_judges
from studies.tools.verify.second_opinion import second_opinions

FOLDER = "verify"
ORACLES: tuple[Oracle, ...] = (*oracles.ORACLES, *second_opinions())
"""The pack, with the second opinion where the code for it is installed."""


@dataclass(frozen=True)
class Verdict:
    """One oracle, what it found, and how long it took [s]."""

    oracle: Oracle
    outcome: Outcome
    seconds: float

    @property
    def failed(self) -> tuple[Check, ...]:
        """The numbers that are not where they must be."""
        return tuple(check for check in self.outcome.checks if not check.met)


def run_pack(root: Path, fast: bool, on_verdict: Callable[[Verdict], None]) -> list[Verdict]:
    """Measures every oracle (`fast`: the fast half), cheap ones first, and the references of scenes below `root` that
    have a second judge; on_verdict sees each as it is found."""
    verdicts = []
    for oracle in sorted((*ORACLES, *second_judges(root)), key=lambda oracle: not oracle.fast):
        if fast and not oracle.fast:
            continue
        start = time.perf_counter()
        verdict = Verdict(oracle, measured(oracle), time.perf_counter() - start)
        verdicts.append(verdict)
        on_verdict(verdict)
    return verdicts


def measured(oracle: Oracle) -> Outcome:
    """What an oracle finds; one that cannot be solved fails by a NaN, and the others still have their say."""
    try:
        return oracle.measure()
    except (SolveError, StudyError) as problem:
        return Outcome((Check(f"not solved: {problem}", "1", 1.0, math.nan, 0.01, "none", 0),))


def check_table(verdicts: Sequence[Verdict]) -> pd.DataFrame:
    """One row per number; deviations are relative, or in the quantity's unit where the tolerance is."""
    rows = [
        {
            "oracle": verdict.oracle.name,
            "quantity": check.quantity,
            "unit": check.unit,
            "expected": check.expected,
            "got": check.got,
            "deviation": check.deviation,
            "tolerance": tolerance(check),
            "met": "yes" if check.met else "NO",
            "source": verdict.oracle.source,
            "mesh": check.mesh,
            "unknowns": check.unknowns,
            "oracle seconds": round(verdict.seconds, 2),
        }
        for verdict in verdicts
        for check in verdict.outcome.checks
    ]
    return pd.DataFrame(rows)


def tolerance(check: Check) -> str:
    """What the deviation must be: "<= 0.005", "<= 0.15 abs" in the quantity's unit, "> 0.5" for what must miss."""
    sign = ">" if check.kind == "misses" else "<="
    return f"{sign} {check.tolerance:g}{' abs' if check.absolute else ''}"


def summary(verdicts: Sequence[Verdict]) -> str:
    """A table in Markdown, one row per oracle with its worst number."""
    lines = [
        "| oracle | numbers met | worst of them | expected | got | deviation | allowed | mesh | source |",
        "|---|---|---|---|---|---|---|---|---|",
    ]
    for verdict in verdicts:
        checks = verdict.outcome.checks
        worst = max(checks, key=closeness)
        cells = [
            verdict.oracle.title,
            f"{len(checks) - len(verdict.failed)} of {len(checks)}",
            f"{worst.quantity} [{worst.unit}]",
            f"{worst.expected:.6g}",
            f"{worst.got:.6g}",
            f"{worst.deviation:.2g}",
            tolerance(worst),
            f"{worst.mesh}, {worst.unknowns:,} unknowns",
            verdict.oracle.source,
        ]
        lines.append("| " + " | ".join(cells) + " |")
    return "\n".join(lines) + "\n"


def closeness(check: Check) -> float:
    """How much of its tolerance a number uses: above 1 it fails, and so does a NaN."""
    used = check.deviation / check.tolerance
    if not math.isfinite(used):
        return math.inf
    return 1.0 / max(used, 1e-300) if check.kind == "misses" else used


def curves_of(verdicts: Sequence[Verdict]) -> list[Curve]:
    """All errors over mesh size."""
    return [curve for verdict in verdicts for curve in verdict.outcome.curves]


def write_verdicts(folder: Path, verdicts: Sequence[Verdict]) -> list[Path]:
    """Writes verify.csv, verify.md and convergence.png; their paths. Raises StudyError when one cannot be written."""
    table, words, chart = (folder / name for name in ("verify.csv", "verify.md", "convergence.png"))
    write_whole(table, check_table(verdicts).to_csv(index=False, float_format="%.9g").encode())
    write_whole(words, summary(verdicts).encode())
    convergence.draw(curves_of(verdicts), chart)
    return [table, words, chart]


def write_kappa(folder: Path) -> list[Path]:
    """Solves and writes what kappa/mu does to a result: kappa.csv and kappa.png; their paths."""
    rows, ratios = kappa.dependence(), np.array(kappa.RATIOS)
    table, chart = folder / "kappa.csv", folder / "kappa.png"
    frame = pd.DataFrame({"kappa/mu": ratios, **rows})
    write_whole(table, frame.to_csv(index=False, float_format="%.9g").encode())
    convergence.draw_kappa(ratios, rows, chart)
    return [table, chart]
