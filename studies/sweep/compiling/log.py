"""What numba compiled in this process, as a summary and as a table."""

import csv
import io
from collections.abc import Iterable

from studies.base.compile_watch import Compiled


def summary(compiled: Iterable[Compiled], most: int = 10) -> list[str]:
    """Lines: how much was compiled, how much of it twice, and the `most` functions that took longest."""
    entries = list(compiled)
    distinct = {(entry.function, entry.arguments) for entry in entries}
    total = sum(entry.seconds for entry in entries)
    lines = [
        f"{len(entries)} compiled in {total:.1f} s of processor time, {len(entries) - len(distinct)} of them again"
    ]
    functions: dict[str, list[float]] = {}
    for entry in entries:
        functions.setdefault(entry.function, []).append(entry.seconds)
    by_time = sorted(functions.items(), key=lambda item: -sum(item[1]))
    return lines + [f"{sum(times):8.2f} s  {len(times):3d} x  {name}" for name, times in by_time[:most]]


def listing(compiled: Iterable[Compiled]) -> str:
    """A CSV table with a row for each function and its argument types."""
    text = io.StringIO()
    table = csv.writer(text, lineterminator="\n")
    table.writerow(("function", "processor time [s]", "arguments"))
    table.writerows((entry.function, f"{entry.seconds:.3f}", entry.arguments) for entry in compiled)
    return text.getvalue()
