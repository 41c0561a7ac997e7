"""`organbench doctor`: what is missing on this machine."""

from pathlib import Path

import typer

from studies.catalog import STUDIES
from studies.cli.terminal import Results, busy, say
from studies.tools.doctor.finding import Finding, Level
from studies.tools.doctor.machine import machine
from studies.tools.doctor.results_folder import results_folder
from studies.tools.doctor.software import software


def doctor(results: Results = Path("results")) -> None:
    """Check this installation, its caches and its results. Exit code 1: something needed is missing."""
    with busy("looking at packages, caches and results"):
        names = {study.name for study in STUDIES}
        findings = [*software(), *machine(results), *results_folder(results, names)]
    for finding in findings:
        show(finding)
    faults = sum(finding.level is Level.FAULT for finding in findings)
    say(f"{faults} of {len(findings)} checks failed" if faults else "nothing required is missing")
    raise typer.Exit(1 if faults else 0)


def show(finding: Finding) -> None:
    say(f"{finding.level:<6} {finding.sentence}")
    if finding.mend:
        say(f"       {finding.mend}")
