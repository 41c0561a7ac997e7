"""report.html: findings, one case, charts and the table of a results folder in one file of at most LIMIT bytes."""

import base64
import json
from collections.abc import Sequence
from pathlib import Path
from string import Template
from typing import Any

import pandas as pd

from studies.base.atomic import write_whole
from studies.catalog.study import Study
from studies.report.page.case_data import merged
from studies.report.page.findings import findings
from studies.report.page.markup import again_html, charts_html, findings_html, script_json, table_html
from studies.report.page.part import Part, read_part

Parts = list[tuple[Study, Part]]
NAME = "report.html"
LIMIT = 3_000_000
"""Bytes."""
NO_ROOM = "Its replay had no room in this file."
ASSETS = Path(__file__).parent / "assets"
SCRIPTS = ("data.js", "table.js", "tabs.js", "histories.js", "bodies.js", "obstacles.js", "replay.js", "controls.js")
"""In this order they make one script."""


def write_page(root: Path, studies: Sequence[Study]) -> tuple[Path | None, list[str]]:
    """Writes the page of what is kept of `studies` (studies.report.page.part); None where nothing is. And what had no
    room or could not be drawn, in sentences. Raises StudyError when it cannot be written."""
    parts = [(study, part) for study in studies if (part := read_part(root, study)) is not None and part["rows"]]
    if not parts:
        return None, []
    cases = joined_cases([part for _, part in parts])
    remarks = [f"report.html: {remark}" for _, part in parts for remark in part["remarks"]]
    content, dropped = fitting(parts, cases, _machine(root))
    write_whole(root / NAME, content)
    return root / NAME, [*remarks, *dropped]


def joined_cases(parts: Sequence[Part]) -> dict[str, Any]:
    """Cases of all studies by id; the same one of several studies once, with all that is known of it. Errors of all
    replays of a scene know the largest of them."""
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
    """A row per case: what one study of it did not measure is that of the next, and all are named."""
    found: dict[str, dict[str, Any]] = {}
    for row in rows:
        one = found.setdefault(row["case"], {**row, "study": ""})
        one |= {name: value for name, value in row.items() if one.get(name) is None}
        one["study"] = ", ".join(filter(None, (one["study"], row["study"])))
    return list(found.values())


def fitting(parts: Parts, cases: dict[str, Any], machine: dict[str, Any]) -> tuple[bytes, list[str]]:
    """The page within LIMIT, and what had to go for that, a sentence each: replays, then histories, the last first."""
    content, told = page(parts, cases, machine), []
    for what, empty in (("replay", None), ("histories", {})):
        holding = [number for number, case in cases.items() if case.get(what)]
        over, gone = len(content) - LIMIT, 0
        while over > 0 and gone < len(holding):
            gone += 1
            number = holding[-gone]
            over -= len(script_json(cases[number][what]))
            rest = {name: value for name, value in cases[number].items() if name != what}
            cases = {**cases, number: rest | ({"why": NO_ROOM} if empty is None else {what: empty})}
        if gone:
            content = page(parts, cases, machine)
            told.append(f"report.html holds no {what} of {gone} of {len(holding)} cases, to stay below {LIMIT:,} bytes")
    if len(content) > LIMIT:
        told.append(f"report.html has {len(content):,} bytes, more than {LIMIT:,}: its charts and its table are large")
    return content, told


def page(parts: Parts, cases: dict[str, Any], machine: dict[str, Any]) -> bytes:
    """The file."""
    rows = [{"study": study.name, **row} for study, part in parts for row in part["rows"]]
    shown = joined_rows(rows)
    tables = {study.name: part["rows"] for study, part in parts}
    names = [study.name for study, _ in parts]
    script = "\n".join((ASSETS / name).read_text(encoding="utf-8") for name in SCRIPTS)
    text = Template((ASSETS / "page.html").read_text(encoding="utf-8")).substitute(
        style=(ASSETS / "page.css").read_text(encoding="utf-8"),
        summary=f"{_counted(shown)} of {len(parts)} studies: {', '.join(names)}. Volume-preserving mass-spring organs "
        "against nearly incompressible finite elements.",
        findings=findings_html(findings(tables)),
        charts=charts_html(
            {study.name: part["charts"] for study, part in parts},
            {study.name: " ".join(study.question.split()) for study, _ in parts},
        ),
        table=table_html(shown, cases),
        count=len(shown),
        csv=base64.b64encode(csv_of(rows).encode()).decode("ascii"),
        again=again_html(names, machine),
        data=script_json({"cases": cases, "first": first_case(cases)}),
        script=script,
    )
    return text.encode()


def _counted(rows: Sequence[dict[str, Any]]) -> str:
    theirs = sum(bool(row.get("entry")) for row in rows)
    entries = f", {theirs} of them entries from outside," if theirs else ""
    return f"{len(rows)} cases{entries}"


def first_case(cases: dict[str, Any]) -> str | None:
    """The one that is shown at first: a replay with errors in colour, else any replay, else any case."""
    ranked = sorted(cases, key=lambda n: -2 * _comparable(cases[n]) - ("replay" in cases[n]))
    return ranked[0] if ranked else None


def csv_of(rows: Sequence[dict[str, Any]]) -> str:
    """All columns of all studies; what a study does not measure stays empty."""
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
