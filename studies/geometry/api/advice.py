"""The advice of the mesh doctor: a command that makes a clean body from the file, tested before it is given."""

import shlex
import warnings
from collections.abc import Iterator, Mapping
from dataclasses import replace
from typing import Any

from studies.base.errors import StudyError
from studies.geometry.api.scans import scan, wall_of
from studies.geometry.doctor.examine import Findings, examine
from studies.geometry.doctor.findings import COMMAND, REMARKS, TRY
from studies.geometry.files.units import ORGAN, SMALLEST, Source, stem_of

NODES = 550
OPENINGS, FOLDS = 5e-3, 3e-3
"""Values of --solid and --smooth in trials [m]."""
PART = 0.5
"""Largest part of a body that an opening may be: a larger one is closed in a grid of many times the body."""
MOST = 100_000
"""Most triangles of a file for which advice is tested; a test takes seconds."""
BEYOND = {"bad_points", "size", "far_away", "duplicate_tetrahedra"}
"""Findings that no option of the command repairs."""


def with_command(source: Source, diagnosis: Findings) -> Findings:
    """The findings of a file and the command that fixes all of them with a clean body of NODES surface nodes.

    If no trial succeeds, the command is None, and every advice on the mesh command names the trials and the best of
    them; without trials it begins with "try". A finding on the unit alone is not tested.
    """
    codes = {finding.code for finding in diagnosis.findings} - {"unit"} - REMARKS
    if not codes:
        return diagnosis
    if source.unit is None and not diagnosis.measures["unit_said"]:
        source = replace(source, unit=diagnosis.measures["unit"])
    works, attempts, measures = None, dict[str, Findings | None](), diagnosis.measures
    if not codes & BEYOND and measures["triangles"] <= MOST and SMALLEST <= max(measures["size"]) <= ORGAN[1]:
        for how in ways(codes, max(measures["size"]), wall_of(source) if measures["lumens"] else None):
            body = attempts[options(how)] = examined(source, how)
            if body is not None and body.clean:
                works = how
                break
    rows = tuple(replace(row, mend=marked(row.mend, works is not None, attempts)) for row in diagnosis.findings)
    return replace(diagnosis, findings=rows, command=None if works is None else command(source, works))


def marked(mend: str, works: bool, attempts: Mapping[str, Findings | None]) -> str:
    """The advice unchanged if a trial `works` or it is no command; with "try" in front without trials; else the trials.

    attempts: options of a trial -> findings of its body, or None if it made none.
    """
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


def ways(codes: set[str], size: float, wall: float | None = None) -> Iterator[dict[str, Any]]:
    """Arguments of `scan` that may repair these findings, the gentlest first. size: longest side of the body, of which
    no opening may be a large part; wall: of a hollow body, which none may fill [m]."""
    lids: dict[str, Any] = {"holes": True} if "open" in codes else {}
    if wall is not None:
        yield lids | {"wall": wall}
        yield lids | {"wall": wall, "smooth": FOLDS}
        return
    if "shell" not in codes:
        if "handles" not in codes:
            yield lids
        yield lids | {"smooth": FOLDS}
    if PART * size > OPENINGS:
        yield {"solid": OPENINGS}
    if "shell" not in codes and "handles" in codes:
        yield lids


def examined(source: Source, how: dict[str, Any]) -> Findings | None:
    """The findings of the body that `scan` makes; None if it raises StudyError."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # the mesh command repeats these warnings
        try:
            return examine(scan(source, NODES, **how))
        except StudyError:
            return None


def options(how: dict[str, Any]) -> str:
    """These arguments as options of the mesh command."""
    given = [f"--{key} {1e3 * how[key]:g}" for key in ("smooth", "solid", "wall") if key in how]
    return " ".join([f"--nodes {NODES}", *given, *(["--close-holes"] if "holes" in how else [])])


def command(source: Source, how: dict[str, Any]) -> str:
    words = ["organbench", "mesh", "--from", str(source.path)]
    side = None if source.longest_side is None else f"{source.longest_side:g}m"
    scale = None if source.scale == 1.0 else f"{source.scale:g}"
    given = {"--unit": source.unit, "--scale": scale, "--longest-side": side, "--part": source.part}
    words += [word for option, value in given.items() if value is not None for word in (option, value)]
    return shlex.join([*words, *options(how).split(), "-o", f"{stem_of(source.path)}_body.vtu"])
