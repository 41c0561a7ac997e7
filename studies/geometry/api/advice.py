"""The doctor's advice, followed before it is given: a command under which a clean body comes out of the file."""

import shlex
import warnings
from collections.abc import Iterator, Mapping
from dataclasses import replace
from typing import Any

from studies.base.errors import StudyError
from studies.geometry.api.scans import scan
from studies.geometry.doctor.examine import Findings, examine
from studies.geometry.doctor.findings import COMMAND, TRY
from studies.geometry.files.units import Source, likely_units, stem_of

NODES = 550
OPENINGS, FOLDS = 5e-3, 3e-3
"""[m] that --solid and --smooth are tried with."""
MOST = 100_000
"""Triangles up to which advice is tried: seconds, which the mesh command does not need again."""
BEYOND = {"bad_points", "size", "small", "far_away", "one_sided", "duplicate_tetrahedra"}
"""Findings that no option of the command repairs."""


def tried(source: Source, found: Findings) -> Findings:
    """The findings of the file with the command that fixes all of them, and makes a clean body of NODES surface nodes.

    Where no command does, each advice says what was tried and what came nearest; advice that was not tried begins with
    "try"."""
    codes = {finding.code for finding in found.findings} - {"unit"}
    if not codes:
        return found
    if source.unit is None and not found.measures["unit_said"]:
        source = replace(source, unit=found.measures["unit"])
    works, attempts = None, dict[str, Findings | None]()
    if not codes & BEYOND and found.measures["triangles"] <= MOST and likely_units(max(found.measures["size"])):
        for how in ways(codes):
            body = attempts[options(how)] = examined(source, how)
            if body is not None and body.clean:
                works = how
                break
    rows = tuple(replace(row, mend=marked(row.mend, works is not None, attempts)) for row in found.findings)
    return replace(found, findings=rows, command=None if works is None else command(source, works))


def marked(mend: str, works: bool, attempts: Mapping[str, Findings | None]) -> str:
    """The advice: as it is where it works, with "try" in front where it was not tried, else what was tried instead."""
    plain = mend.removeprefix(TRY)
    if works or not plain.startswith(COMMAND):
        return plain
    if not attempts:
        return TRY + plain
    words = f"no option repairs everything; tried: {'; '.join(attempts)}"
    bodies = {name: body for name, body in attempts.items() if body is not None}
    if not bodies:
        return f"{words}; none makes a body: repair it in the program that made it"
    name, body = min(bodies.items(), key=lambda item: len(item[1].findings))
    left = ", ".join(finding.code.replace("_", " ") for finding in body.findings)
    return f"{words}; {name} makes a body, in which this is left: {left}"


def ways(codes: set[str]) -> Iterator[dict[str, Any]]:
    """What to ask of `scan` for these findings, the gentlest first."""
    lids: dict[str, Any] = {"holes": True} if "open" in codes else {}
    if "shell" not in codes:
        if "handles" not in codes:
            yield lids
        yield lids | {"smooth": FOLDS}
    yield {"solid": OPENINGS}
    if "shell" not in codes and "handles" in codes:
        yield lids


def examined(source: Source, how: dict[str, Any]) -> Findings | None:
    """What the doctor says of the body that comes out; None where none does."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # the mesh command tells of every change
        try:
            return examine(scan(source, NODES, **how))
        except StudyError:
            return None


def options(how: dict[str, Any]) -> str:
    """What asks it of the mesh command: "--nodes 550 --smooth 3"."""
    given = [f"--{key} {1e3 * how[key]:g}" for key in ("smooth", "solid") if key in how]
    return " ".join([f"--nodes {NODES}", *given, *(["--close-holes"] if "holes" in how else [])])


def command(source: Source, how: dict[str, Any]) -> str:
    """The command that asks it."""
    words = ["organbench", "mesh", "--from", str(source.path)]
    side = None if source.longest_side is None else f"{source.longest_side:g}m"
    given = {"--unit": source.unit, "--scale": None if source.scale == 1.0 else f"{source.scale:g}"}
    given |= {"--longest-side": side, "--part": source.part}
    for option, value in given.items():
        words += [] if value is None else [option, value]
    return shlex.join([*words, *options(how).split(), "-o", f"{stem_of(source.path)}_body.vtu"])
