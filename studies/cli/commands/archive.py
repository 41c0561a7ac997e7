"""`organbench archive`: results that can be handed on."""

from datetime import UTC, datetime
from pathlib import Path
from typing import Annotated

import typer

from studies.catalog import STUDIES
from studies.cli.terminal import Results, busy, say, warn
from studies.report.archive.checking import check
from studies.report.archive.packing import pack, stored_studies
from studies.sweep.find_study import find_studies


def archive(
    studies: Annotated[
        list[str] | None,
        typer.Argument(metavar="STUDY", help="studies to pack; default: all of the catalogue that are stored"),
    ] = None,
    output: Annotated[Path, typer.Option("-o", "--output", help="the zip file")] = Path("organbench-results.zip"),
    results: Results = Path("results"),
    checked: Annotated[
        Path | None, typer.Option("--check", metavar="FILE", help="only compare this archive with its checksums")
    ] = None,
) -> None:
    """Pack records, tables, charts and code into a zip file. Stale results are refused."""
    if checked is not None:
        with busy(f"reading {checked}"):
            count = check(checked)
        say(f"{checked}: {count} files, each as it was packed")
        return
    chosen, others = (find_studies(studies), []) if studies else stored_studies(results, STUDIES)
    files = [Path(name) for name in studies or [] if name.endswith(".py")]
    with busy(f"packing {', '.join(study.name for study in chosen)}"):
        count, remarks = pack(results, chosen, output, datetime.now(UTC).date().isoformat(), files)
    warn(remarks)
    if others:
        warn([f"not packed: {', '.join(others)}, of files; name them, as in `organbench archive FILE.py`"])
    say(f"{output}: {count} files, {output.stat().st_size / 1e6:.1f} MB")
