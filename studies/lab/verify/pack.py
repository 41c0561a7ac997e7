"""Runs the oracle pack of the reference and keeps what it found: verify.csv, verify.md and the convergence chart."""

import math
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pandas as pd

from reference_fem import SolveError
from reference_fem.oracles import ORACLES, Check, Oracle, Outcome, kappa
from studies.lab.verify.second_opinion import second_opinions
from studies.plots import verify as convergence


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


def run_pack(fast: bool, on_verdict: Callable[[Verdict], None]) -> list[Verdict]:
    """Measures every oracle (`fast`: the fast half), cheap ones first; on_verdict sees each as it is found."""
    verdicts = []
    for oracle in sorted((*ORACLES, *second_opinions()), key=lambda oracle: not oracle.fast):
        if fast and not oracle.fast:
            continue
        start = time.perf_counter()
        verdicts.append(Verdict(oracle, measured(oracle), time.perf_counter() - start))
        on_verdict(verdicts[-1])
    return verdicts


def measured(oracle: Oracle) -> Outcome:
    """What an oracle finds; one that cannot be solved fails by a NaN, and the others still have their say."""
    try:
        return oracle.measure()
    except SolveError as problem:
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
    """What the deviation must be: "<= 0.005", or "<= 0.15 abs" in the quantity's unit."""
    return f"<= {check.tolerance:g}{' abs' if check.absolute else ''}"


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
    return used if math.isfinite(used) else math.inf


def write_verdicts(folder: Path, verdicts: Sequence[Verdict]) -> list[Path]:
    """Writes verify.csv, verify.md and convergence.png; their paths."""
    folder.mkdir(parents=True, exist_ok=True)
    table, words, chart = (folder / name for name in ("verify.csv", "verify.md", "convergence.png"))
    check_table(verdicts).to_csv(table, index=False, float_format="%.9g")
    words.write_text(summary(verdicts), encoding="utf-8")
    convergence.draw([curve for verdict in verdicts for curve in verdict.outcome.curves], chart)
    return [table, words, chart]


def write_kappa(folder: Path) -> list[Path]:
    """Solves and writes what kappa/mu does to a result: kappa.csv and kappa.png; their paths."""
    rows, ratios = kappa.dependence(), np.array(kappa.RATIOS)
    table, chart = folder / "kappa.csv", folder / "kappa.png"
    pd.DataFrame({"kappa/mu": ratios, **rows}).to_csv(table, index=False, float_format="%.9g")
    convergence.draw_kappa(ratios, rows, chart)
    return [table, chart]
