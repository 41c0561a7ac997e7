"""Data of one study for the page, collected while its runs are loaded and stored until they change."""

import hashlib
import json
import math
import re
import shlex
from collections.abc import Hashable, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import pandas as pd

from studies.base.atomic import write_whole
from studies.catalog.study import RESERVED, Study, command_line, word_elsewhere
from studies.exchange.entry import is_entry
from studies.metrics.run import Run
from studies.report.page.best import Best, best_bodies, case_id
from studies.report.page.case_data import case_data, entry_data
from studies.report.page.reference_shape import reference_id, reference_shape
from studies.runs.current import case_path
from studies.runs.user_code import files_of
from studies.scene.library import CUT, SCENES
from studies.store.paths import key_hash, record_files

Part = dict[str, Any]
"""study: its name, question and word; rows: of the study's table, with the id of each case and whether it is an entry
from outside; cases and references: by id; charts: file and SVG; remarks; best: the best body of each scene."""
KEYS = {"study", "rows", "cases", "references", "charts", "remarks", "best"}
ID = re.compile("[0-9a-f]+")
"""Of a case or reference. It names a file of the page's folder, and a part may come from a stranger."""


ABOUT = ("name", "question", "word")
"""Fields of a study that the page shows."""


def part_path(root: Path, study: Study) -> Path:
    """Where the part of a study is kept between two reports."""
    return root / "cache" / f"{study.name}.page.json"


def write_part(
    root: Path,
    study: Study,
    runs: Sequence[Run],
    table: pd.DataFrame,
    pictures: Mapping[str, str],
    published: Sequence[Mapping[str, Any]] = (),
    best: Sequence[Best] | None = None,
) -> None:
    """Gathers and keeps the part of a study and of the entries from outside in its scenes; `table` has a row for each
    of `runs`, `pictures` its charts as SVG by the names of their files. published: further rows, which have no case on
    the page; best: by default that of `runs`."""
    ids = [run_id(run) for run in runs]
    rows = [{name: _plain(value) for name, value in row.items()} for row in (*table.to_dict("records"), *published)]
    cases: dict[str, Any] = {}
    references: dict[str, Any] = {}
    for number, run in zip(ids, runs, strict=True):
        cases.setdefault(number, _data(root, study, run))
        if run.reference is not None and (name := reference_id(run.case.scene)) not in references:
            references[name] = reference_shape(run.reference)
    files = [chart.file for chart in study.charts]
    charts = [{"file": name, "svg": pictures[name]} for name in files if name in pictures]
    remarks = [
        f"chart {name} is omitted: studies.plots.style.style.save did not draw it"
        for name in files
        if name not in pictures
    ]
    theirs = [is_entry(run.case) for run in runs]
    for row, n, entry in zip(rows, ids, theirs, strict=False):  # published rows have their own
        row |= {"case": n, "entry": entry}
    about = {name: getattr(study, name) for name in ABOUT}
    part: Part = {"study": about, "rows": rows, "cases": cases, "references": references, "charts": charts}
    chosen = best_bodies([run for run in runs if not is_entry(run.case)], run_id) if best is None else [*best]
    part |= {"remarks": remarks, "best": chosen}
    content = json.dumps(part, allow_nan=False).encode()
    write_whole(part_path(root, study), _digest(content) + b"\n" + content)


def read_part(root: Path, study: Study) -> Part | None:
    """None where none is kept, or where it is damaged or no part of this version: then it is gathered again."""
    try:
        digest, _, content = part_path(root, study).read_bytes().partition(b"\n")
    except OSError:
        return None
    part = json.loads(content) if digest == _digest(content) else None
    if not isinstance(part, dict) or set(part) != KEYS:
        return None
    return part if all(map(ID.fullmatch, (*part["cases"], *part["references"]))) else None


def _digest(content: bytes) -> bytes:
    """The first line of the file: SHA-256 of all below."""
    return hashlib.sha256(content).hexdigest().encode()


def other_studies(root: Path, studies: Sequence[Study]) -> tuple[list[Study], list[str]]:
    """Studies whose part is kept in `root` though they are not among `studies`: those of the user's files, and of a
    folder of surfaces. Each has only the fields that the page shows; no file of the user is run.

    Also a sentence for each study that is stored and has no part, or an older one.
    """
    names, others, remarks = {study.name for study in studies}, [], []
    for folder in sorted(path for path in root.glob("*") if path.is_dir() and path.name not in (*RESERVED, *names)):
        records = record_files(root, folder.name)
        if not records:
            continue
        study = Study(folder.name, "", (), (), ())
        part = read_part(root, study)
        if part is None:
            remarks.append(f"report.html: {folder.name} is not on the page; `organbench report FILE.py`, with the file "
                           "that defines the study, adds it")  # fmt: skip
            continue
        others.append(replace(study, **{name: str(part["study"][name]) for name in ABOUT if name != "name"}))
        if max(path.stat().st_mtime_ns for path in records) > part_path(root, study).stat().st_mtime_ns:
            again = command_line("report", others[-1:])
            remarks.append(f"report.html: {folder.name} shows its last charts; `{again}` redraws them")
    return others, remarks


def _data(root: Path, study: Study, run: Run) -> dict[str, Any]:
    if is_entry(run.case):
        return entry_data(run, _scene_word(study, run.case.scene.name))
    path = _named(root, case_path(root, study.name, run.case))
    own = files_of(run.case)
    files = [word for file in own for word in ("--file", file.path.name)]
    again = shlex.join(["organbench", "replay", str(path), *files])
    line = command_line("run", [study], "--case", run.case.name, *results_option(root), elsewhere=True)
    return case_data(run, again) | {"run": line}


def _scene_word(study: Study, scene: str) -> str:
    """A scene as the command line takes it: of a study of the user's with the file, in which several may be."""
    if study.word.endswith(".py"):
        return shlex.quote(f"{word_elsewhere(study)}:{scene}")
    return scene if scene in [each.name for each in (*SCENES, *CUT)] else f"FILE.py:{scene}"


def run_id(run: Run) -> str:
    """An id that is the same for runs with the same numbers, independent of additional recorded fields; for an entry
    the same in all studies with its scene."""
    return key_hash(run.record.key) if is_entry(run.case) else case_id(run.case)


def _named(root: Path, path: Path) -> Path:
    """As the command names it where the results folder lies: other folders stay private."""
    return _shown(root) / path.relative_to(root)


def _shown(root: Path) -> Path:
    """A results folder as it was given; of one elsewhere the last part."""
    return Path(root.name) if root.is_absolute() or ".." in root.parts else root


def results_option(root: Path) -> list[str]:
    """What commands need to find the results folder, if it is not the usual one."""
    return [] if _shown(root) == Path("results") else ["--results", str(_shown(root))]


def _plain(value: Hashable) -> Hashable:
    """As JSON has it: no NaN, no numpy."""
    value = value.item() if hasattr(value, "item") else value  # pyright: ignore[reportAttributeAccessIssue]
    return None if isinstance(value, float) and not math.isfinite(value) else value
