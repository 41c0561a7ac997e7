"""report.html: recommended bodies, a case, charts and the table of a results folder in one file of at most LIMIT bytes.

Cases for which it has no room are in FOLDER next to it, a file each, which the page loads when a case is opened.
"""

import base64
import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from hashlib import sha256
from pathlib import Path
from typing import Any

import pandas as pd
from markupsafe import Markup

from studies.base.atomic import write_whole
from studies.base.counting import counted
from studies.base.errors import StudyError
from studies.catalog.study import RESERVED, Study, command_line
from studies.metrics.cells import MISSED_NOTE
from studies.report.page.best import HEADS, answers, joined_best, own_first, scene_rows
from studies.report.page.case_data import merged
from studies.report.page.markup import ASSETS, TEMPLATES, machine_words, script_json, table, tabs
from studies.report.page.part import Part, other_studies, part_path, read_part, results_option

Parts = list[tuple[Study, Part]]
NAME = "report.html"
FOLDER = "report-cases"
LIMIT = 3_000_000
"""Bytes of the page; its folder may hold as many cases as there are."""
DETAILS = ("histories", "reference", "replay", "why")
"""Fields of a case that are stored in a separate file if the page has no room for them."""
SCRIPTS = (
    "data.js",
    "table.js",
    "tabs.js",
    "histories.js",
    "bodies.js",
    "obstacles.js",
    "replay.js",
    "controls.js",
    "address.js",
)
"""In this order they make one script."""


@dataclass(frozen=True)
class Page:
    """What is written: the page, and the files of its folder by name."""

    content: bytes
    files: dict[str, bytes]


def write_page(
    root: Path, studies: Sequence[Study], league: Sequence[Mapping[str, Any]] = (), shown: str | None = None
) -> tuple[Path | None, list[str]]:
    """Writes the page and its folder from the stored parts (studies.report.page.part) of `studies` and of others in
    `root`. Returns its path, None if nothing is stored, and sentences on parts that could not be drawn or are older.
    league: the cards of its engines; shown: the id of the case that is shown at first. Raises StudyError when something
    cannot be written."""
    others, remarks = other_studies(root, studies)
    parts = []
    for study in (*studies, *others):
        part = read_part(root, study)
        if part is None and part_path(root, study).exists():
            remarks.append(f"report.html: {study.name} is left out: {part_path(root, study)} is damaged; delete it")
        if part is not None and part["rows"]:
            parts.append((study, part))
            remarks += [f"report.html: {remark}" for remark in part["remarks"]]
    if not parts:
        return None, remarks
    page, more = fitting(parts, _machine(root), league, results_option(root), shown)
    for name, content in page.files.items():
        write_whole(root / FOLDER / name, content)
    write_whole(root / NAME, page.content)
    _remove_others(root / FOLDER, set(page.files))
    return root / NAME, [*remarks, *more]


def _remove_others(folder: Path, names: set[str]) -> None:
    """Removes files of cases of an earlier page, except `names`. Raises StudyError if one cannot be removed."""
    for path in folder.glob("*.js"):
        if path.name not in names:
            try:
                path.unlink()
            except OSError as error:
                raise StudyError(f"{path} cannot be removed ({error.strerror}); delete {folder}") from error


def joined_cases(parts: Sequence[Part]) -> dict[str, Any]:
    """Cases of all studies by id; a case of several studies once, with the data of all. All replays of a scene get the
    largest error among them."""
    cases: dict[str, Any] = {}
    for part in parts:
        for number, case in part["cases"].items():
            cases[number] = merged(cases[number], case) if number in cases else case
    largest: dict[str, float] = {}
    for case in _replayed(cases):
        largest[case["scene"]] = max(largest.get(case["scene"], 0.0), case["replay"].get("largest", 0.0))
    for case in _replayed(cases):
        case["replay"]["largest"] = largest[case["scene"]]
    return cases


def joined_rows(rows: Sequence[dict[str, Any]]) -> list[dict[str, Any]]:
    """One row for each case of several studies, with the data of all; a published one only where the case has no
    other."""
    by_case: dict[str, dict[str, Any]] = {}
    for row in sorted(rows, key=lambda row: bool(row.get("published"))):
        if row.get("published") and row["case"] in by_case:
            continue
        one = by_case.setdefault(row["case"], {**row, "study": ""})
        one |= {name: value for name, value in row.items() if one.get(name) is None}
        one["study"] = ", ".join(filter(None, (one["study"], row["study"])))
    return list(by_case.values())


def fitting(
    parts: Parts,
    machine: dict[str, Any],
    league: Sequence[Mapping[str, Any]] = (),
    options: Sequence[str] = (),
    shown: str | None = None,
) -> tuple[Page, list[str]]:
    """The page with as many cases as LIMIT has room for, the first one and those with the most to see before others;
    a sentence where even without cases it is larger."""
    cases = joined_cases([part for _, part in parts])
    first = shown if shown in cases else first_case(cases)
    data = {"cases": _heads(cases), "first": first, "folder": FOLDER, "pieces": {}}
    room, files = LIMIT - len(page(parts, data, machine, league, options)), {}
    for name, piece in _pieces(parts, cases, first).items():
        text = script_json(piece)
        size = len(text.encode()) + len(name) + len('"":,')
        if size <= room:
            data["pieces"][name] = piece
            room -= size
        else:
            files[f"{name}.js"] = f"keepPiece({json.dumps(name)}, {text});\n".encode()
    content = page(parts, data, machine, league, options)
    large = f"report.html has {len(content):,} bytes, more than {LIMIT:,}: its charts and its table are large"
    return Page(content, files), [large] if len(content) > LIMIT else []


def _heads(cases: Mapping[str, Any]) -> dict[str, Any]:
    """What the page always holds of each case: its words, the commands that run it, whether it moves."""
    return {
        number: {name: value for name, value in case.items() if name not in DETAILS} | {"replayed": "replay" in case}
        for number, case in cases.items()
    }


def _pieces(parts: Parts, cases: Mapping[str, Any], first: str | None) -> dict[str, Any]:
    """What may lie next to the page, by name, in the order in which it gets room: of each case the rest, and before it
    the shape of its reference."""
    references = {name: shape for _, part in parts for name, shape in part["references"].items()}
    pieces: dict[str, Any] = {}
    for number in sorted(cases, key=lambda number: (number != first, _rank(cases[number]))):
        shape = cases[number].get("replay", {}).get("reference")
        if shape is not None:
            pieces.setdefault(f"reference-{shape}", references[shape])
        pieces[f"case-{number}"] = {name: value for name, value in cases[number].items() if name in DETAILS}
    return pieces


def _rank(case: dict[str, Any]) -> int:
    """Recorded motions before those from checkpoint to checkpoint, cases that stand still last."""
    return 2 if "replay" not in case else int(case["replay"]["straight"])


def page(
    parts: Parts,
    data: Mapping[str, Any],
    machine: dict[str, Any],
    league: Sequence[Mapping[str, Any]] = (),
    options: Sequence[str] = (),
) -> bytes:
    """The file. data: what its script reads; options: of the commands that make it again."""
    rows = [{"study": study.name, **row} for study, part in parts for row in part["rows"]]
    case_rows = joined_rows(rows)
    script = "\n".join((ASSETS / name).read_text(encoding="utf-8") for name in SCRIPTS)
    studies = [study for study, _ in parts if study.name not in RESERVED]
    # A study named by a FILE, and its scenes, are the user's.
    own = {row["scene"] for study, part in parts if study.word for row in part["best"]}
    theirs = {row["scene"] for _, part in parts for row in part["best"] if row.get("entries")}
    best = own_first(joined_best([part["best"] for _, part in parts], case_rows), own | theirs)
    text = TEMPLATES.get_template("page.html").render(
        style=Markup((ASSETS / "page.css").read_text(encoding="utf-8")),
        summary=f"{_counted(case_rows)}{_named(studies)}. "
        "Volume-preserving mass-spring organs against nearly incompressible finite elements.",
        answers=answers(best, own, data["first"]),
        best_heads=HEADS,
        best_rows=scene_rows(best),
        shown=data["cases"],
        tabs=tabs(
            {study.name: part["charts"] for study, part in parts},
            {study.name: " ".join(study.question.split()) for study, _ in parts},
        ),
        cases=table(case_rows, data["cases"]),
        count=counted(len(case_rows), "case"),
        csv=base64.b64encode(csv_of(rows).encode()).decode("ascii"),
        commands=[
            *([command_line("run", studies, *options, elsewhere=True)] if studies else ()),
            *(" ".join([case["again"], *options]) for case in data["cases"].values() if "entry" in case),
            command_line("report", [study for study in studies if study.word], *options, elsewhere=True),
        ],
        machine=machine_words(machine),
        league=league,
        missed=MISSED_NOTE,
        data=Markup(script_json(data)),
        script=Markup(script),
        digest=base64.b64encode(sha256(script.encode()).digest()).decode("ascii"),
    )
    return text.encode()


def _named(studies: Sequence[Study]) -> str:
    names = ", ".join(study.name for study in studies)
    return f"; {counted(len(studies), 'study', 'studies')}: {names}" if studies else ""


def _counted(rows: Sequence[dict[str, Any]]) -> str:
    theirs, published = (sum(bool(row.get(name)) for row in rows) for name in ("entry", "published"))
    kinds = [counted(theirs, "entry", "entries") + " of other programs"] if theirs else []
    kinds += [counted(published, "published case")] if published else []
    among = f", among them {' and '.join(kinds)}" if kinds else ""
    return f"{counted(len(rows), 'case')}{among}"


def first_case(cases: dict[str, Any]) -> str | None:
    """The one that is shown at first: errors in colour before none, and a recorded motion before others."""
    ranked = sorted(cases, key=lambda number: (not _comparable(cases[number]), _rank(cases[number])))
    return ranked[0] if ranked else None


def csv_of(rows: Sequence[dict[str, Any]]) -> str:
    return pd.DataFrame([{name: value for name, value in row.items() if name != "case"} for row in rows]).to_csv(
        index=False, float_format="%.6g"
    )


def _comparable(case: dict[str, Any]) -> bool:
    return bool(case.get("replay", {}).get("comparable"))


def _replayed(cases: dict[str, Any]) -> list[dict[str, Any]]:
    return [case for case in cases.values() if "replay" in case]


def _machine(root: Path) -> dict[str, Any]:
    path = root / "machine.json"
    return json.loads(path.read_bytes()) if path.is_file() else {}
