"""The doctor's advice, followed before it is given: a command under which a clean body comes out of the file."""

import shlex
import warnings
from collections.abc import Iterator
from dataclasses import replace
from typing import Any

from studies.base.errors import StudyError
from studies.geometry.api.scans import scan
from studies.geometry.doctor.examine import Findings, examine
from studies.geometry.doctor.findings import COMMAND, TRY
from studies.geometry.files.units import Source

NODES = 550
OPENINGS, FOLDS = 5e-3, 3e-3
"""[m] that --solid and --smooth are tried with."""
MOST = 100_000
"""Triangles up to which advice is tried: seconds, which the mesh command does not need again."""
BEYOND = {"bad_points", "size", "one_sided", "duplicate_tetrahedra"}
"""Findings that no option of the command mends."""


def tried(source: Source, found: Findings) -> Findings:
    """The findings of the file with the command that mends all of them, and makes a clean body of NODES surface nodes;
    advice that does not work, or was not tried, begins with "try"."""
    codes = {finding.code for finding in found.findings} - {"unit"}
    if not codes:
        return found
    if source.unit is None and not found.measures["unit_said"]:
        source = replace(source, unit=found.measures["unit"])
    works = None
    if not codes & BEYOND and found.measures["triangles"] <= MOST:
        works = next((how for how in ways(codes) if is_clean(source, how)), None)
    mends = [marked(finding.mend, works is not None) for finding in found.findings]
    rows = tuple(replace(finding, mend=mend) for finding, mend in zip(found.findings, mends, strict=True))
    return replace(found, findings=rows, command=None if works is None else command(source, works))


def marked(mend: str, works: bool) -> str:
    """The advice with "try" in front where it may fail."""
    plain = mend.removeprefix(TRY)
    return plain if works or not plain.startswith(COMMAND) else TRY + plain


def ways(codes: set[str]) -> Iterator[dict[str, Any]]:
    """What to ask of `scan` for these findings, the gentlest first."""
    lids: dict[str, Any] = {"holes": True} if "open" in codes else {}
    if "shell" not in codes:
        if "handles" not in codes:
            yield lids
        yield lids | {"smooth": FOLDS}
    yield {"solid": OPENINGS}


def is_clean(source: Source, how: dict[str, Any]) -> bool:
    """Whether a body without findings comes out."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # the mesh command tells of every change
        try:
            return examine(scan(source, NODES, **how)).clean
        except StudyError:
            return False


def command(source: Source, how: dict[str, Any]) -> str:
    """The command that asks it."""
    words = ["organbench", "mesh", "--from", str(source.path)]
    side = None if source.longest_side is None else f"{source.longest_side:g}m"
    given = {"--unit": source.unit, "--scale": None if source.scale == 1.0 else f"{source.scale:g}"}
    given |= {"--longest-side": side, "--part": source.part, "--nodes": str(NODES)}
    given |= {f"--{key}": f"{1e3 * how[key]:g}" for key in ("smooth", "solid") if key in how}
    for option, value in given.items():
        words += [] if value is None else [option, value]
    words += ["--close-holes"] if "holes" in how else []
    return shlex.join([*words, "-o", f"{source.path.stem}_body.vtu"])
