"""The table silicone.csv: who says what of a load."""

import csv
import io
from collections.abc import Sequence
from pathlib import Path

from studies.base.atomic import write_whole
from studies.base.errors import StudyError
from studies.plots.silicone import Point

HEAD = ["who", "tip load [N]", "sag [mm]", "frequency [Hz]", "damping ratio [1]"]


def write_table(path: Path, rows: Sequence[Point]) -> None:
    """Replaces the table. Raises StudyError when it cannot be written."""
    text = io.StringIO()
    table = csv.writer(text, lineterminator="\n")
    table.writerow(HEAD)
    table.writerows((row.who, row.newton, *(f"{value:.4f}" for value in row[2:])) for row in rows)
    write_whole(path, text.getvalue().encode())


def read_table(path: Path) -> list[Point]:
    """Its rows. Raises StudyError for a file that is no such table."""
    with path.open(newline="", encoding="utf-8") as file:
        head, *rows = [*csv.reader(file)] or [[]]
    try:
        if head != HEAD:
            raise ValueError(f"its head is {','.join(head)!r}")
        return [Point(who, *map(float, values)) for who, *values in rows]
    except (ValueError, TypeError) as problem:
        raise StudyError(f"{path} is no table of the silicone beam ({problem}); make it again") from problem
