"""The league of engines: its table, computed from the stored entries, the chart of profiles, and league.html, a page
with a card for each engine that needs neither a script nor a network."""

import json
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

import pandas as pd
from markupsafe import Markup

from studies.base.atomic import write_whole
from studies.base.errors import StudyError
from studies.exchange.entry import entry_files, run_of_entry
from studies.exchange.league import LEAGUE, SET, frozen
from studies.metrics.cells import MISSING, plain, value_cell
from studies.metrics.judged import cost_of
from studies.metrics.table import metric
from studies.metrics.wish import SOLID
from studies.reference.load import reference_for
from studies.report.page.markup import ASSETS, TEMPLATES
from studies.report.page.svg import inline
from studies.store.record import json_in, read_record
from studies.store.schema import COMPARABLE
from studies.store.tables import write_table

NAME, CHART, TABLE = "league.html", "profiles.png", "league.csv"
SAID = {"engine", "version", "ours", "scene", "mesh", "nodes", "settings", "evaluations"}
"""What the file of an entry says, and a row repeats."""
HEADS = {
    "force_end": "force",
    "mean_error": "displacement, mean",
    "volume_worst": "volume",
    "penetration": "penetration",
}
"""Metrics of the table [%], and their heads on the page."""
PROFILED = {"force_end": SOLID[0], "mean_error": SOLID[1]}
"""Quantities of profiles -> default target [%]; all scenes of the set have solid organs."""
FACTORS = (1.0, 3.0, 10.0)
"""Of what is usually enough: a column of the chart each."""
COST, COUNT = "cost [s/s]", "evaluations [1/s]"
"""Computing time, and evaluations of all forces, for a simulated second."""
BUDGETS = {COST: "computing / simulated time [s/s]", COUNT: "force evaluations / time [1/s]"}
ROUNDING = 1e-6
"""Smaller sizes [%] come from rounding."""
NAN = float("nan")
Row = Mapping[str, Any]
Pair = tuple[str, str]
"""A scene and a quantity."""


def write_league(root: Path) -> tuple[list[Path], list[dict[str, Any]], list[str]]:
    """Table, chart and page of what is entered below the results folder `root`: their paths, none without an entry; the
    cards of the engines; and what cannot be read, in sentences. Raises StudyError where something cannot be written."""
    from studies.plots.campaigns.league import draw  # with matplotlib, which takes half a second to load
    from studies.plots.style.style import svg_copies

    rows, remarks = league_rows(root)
    if not rows:
        return [], [], remarks
    folder = root / LEAGUE
    folder.mkdir(parents=True, exist_ok=True)
    write_table(folder / TABLE, pd.DataFrame(rows))
    with svg_copies() as pictures:
        draw(profiles(rows), folder / CHART)
    write_whole(root / NAME, page(rows, pictures[CHART]))
    return [folder / TABLE, folder / CHART, root / NAME], cards(rows), remarks


def league_rows(root: Path) -> tuple[list[dict[str, Any]], list[str]]:
    """All entries of the league below the results folder `root` by engine, scene and nodes, and what cannot be read, a
    sentence each."""
    rows, problems = [], []
    for path in entry_files(root / LEAGUE):
        try:
            rows.append(_row(path))
        except StudyError as problem:
            problems.append(str(problem))
    order = list(frozen())
    return sorted(rows, key=lambda row: (row["engine"], order.index(row["scene"]), row["nodes"])), problems


def _row(path: Path) -> dict[str, Any]:
    """Raises StudyError for a record that cannot be read or is no entry of the set."""
    record = read_record(path)
    entry = json_in(record.attributes.get(LEAGUE) or "{}", f"the entry in {path}")
    if entry.get("scene") not in frozen() or not set(entry) >= SAID:
        raise StudyError(f"{path} is no entry of the league; delete it")
    scene = run_of_entry(record, None).case.scene
    run = run_of_entry(record, reference_for(path, scene))
    comparable = record.status in COMPARABLE
    row = {name: entry[name] for name in ("engine", "version", "ours")} | {"scene": scene.name}
    row |= {"mesh": entry["mesh"], "nodes": entry["nodes"], "status": str(record.status), "message": record.message}
    row["settings"] = json.dumps(entry["settings"])
    row["reference"] = "" if run.reference is None else run.reference.source
    for name in HEADS:
        row[f"{name} [%]"] = metric(name)(run) if comparable else NAN
        row[f"{name} floor [%]"] = metric(name).uncertainty(run) if comparable else NAN
    cost, count = cost_of(run) if comparable else None, entry["evaluations"]
    return row | {COST: cost.value if cost else NAN, COUNT: count / scene.duration if count else NAN}


def pairs() -> dict[Pair, float]:
    """The judged pairs of the open scenes -> bar of the reference [%]."""
    return {(scene, name): bar for scene, one in frozen().items() for name, bar in one.bars.items()}


def tolerance(name: str, factor: float, bar: float) -> float:
    """`factor` times the default target [%], but at least the uncertainty of the reference."""
    return max(factor * PROFILED[name], bar)


def solutions(
    rows: Sequence[Row], engine: str, factor: float, bars: Mapping[Pair, float]
) -> Iterator[tuple[Pair, Row]]:
    """Each pair that an engine solves within the tolerance, with the row in which it does."""
    for row in rows:
        for name in PROFILED:
            pair = (row["scene"], name)
            if row["engine"] != engine or pair not in bars:
                continue
            if abs(row[f"{name} [%]"]) <= tolerance(name, factor, bars[pair]):
                yield pair, row


def profile(
    rows: Sequence[Row], engine: str, factor: float, bars: Mapping[Pair, float], budget: str = COST
) -> list[tuple[float, float]]:
    """(budget, share of the pairs that are solved within the tolerance for at most this budget), ascending; a pair
    counts from the cost of its cheapest sufficient entry on, and not at all if no cost is known."""
    cheapest: dict[Pair, float] = {}
    for pair, row in solutions(rows, engine, factor, bars):
        if row[budget] == row[budget]:
            cheapest[pair] = min(cheapest.get(pair, row[budget]), row[budget])
    costs = sorted(cheapest.values())
    return [(cost, (number + 1) / len(bars)) for number, cost in enumerate(costs)]


def profiles(rows: Sequence[Row]) -> Any:
    """What the chart shows."""
    from studies.plots.campaigns.league import Profiles

    bars = pairs()
    words = tuple(
        f"force within {factor * PROFILED['force_end']:g} %,\ndisplacement within {factor * PROFILED['mean_error']:g} %"
        for factor in FACTORS
    )
    of = {
        name: {
            (row, column): profile(rows, name, factor, bars, budget)
            for row, budget in enumerate(BUDGETS)
            for column, factor in enumerate(FACTORS)
        }
        for name in engines([row for row in rows if row["status"] in COMPARABLE])
    }
    note = (
        f"{len(bars)} pairs of scene and quantity (force, mean displacement) of {SET}. No tolerance is below the "
        "uncertainty of the reference. A pair counts from the cheapest mesh that is good enough on; one that an engine "
        "was not run on is not solved. Times: one core."
    )
    return Profiles(words, tuple(BUDGETS.values()), of, (note,))


def engines(rows: Sequence[Row]) -> list[str]:
    """By name, those of others first."""
    ours = {row["engine"]: bool(row["ours"]) for row in rows}
    return sorted(ours, key=lambda name: (ours[name], name))


def cards(rows: Sequence[Row]) -> list[dict[str, Any]]:
    """One for each engine: the range of the sizes of its errors, its cost, and what it cannot do."""
    bars = pairs()
    return [_card(name, [row for row in rows if row["engine"] == name], bars) for name in engines(rows)]


def _card(name: str, rows: Sequence[Row], bars: Mapping[Pair, float]) -> dict[str, Any]:
    judged, there = [row for row in rows if row["status"] in COMPARABLE], {row["scene"] for row in rows}
    cannot: dict[str, dict[str, None]] = {}
    for row in rows:
        if row["message"]:
            cannot.setdefault(row["message"].removeprefix(f"{name}: "), {})[row["scene"]] = None
    solved = {pair for pair, _ in solutions(rows, name, 1.0, bars)}
    return {
        "engine": name,
        "version": rows[0]["version"],
        "ours": bool(rows[0]["ours"]),
        "scenes": len({row["scene"] for row in judged}),
        "ranges": {column: _range(judged, f"{column} [%]") for column in HEADS},
        "cost": _range(judged, COST),
        "count": _range(judged, COUNT),
        "solved": f"{len(solved)} of {len(bars)}" if judged else "–",
        "missing": [scene for scene, one in frozen().items() if not one.held_back and scene not in there],
        "cannot": [f"{', '.join(scenes)}: {reason}" for reason, scenes in cannot.items()],
    }


def _range(rows: Sequence[Row], column: str) -> str:
    """ "1.2 to 41": smallest and largest size; a dash if nothing is known, 0 below ROUNDING."""
    values = [abs(row[column]) if abs(row[column]) > ROUNDING else 0.0 for row in rows if row[column] == row[column]]
    if not values:
        return "–"
    low, high = (f"{value:.2g}" if value < 100 else f"{value:,.0f}" for value in (min(values), max(values)))
    return low if low == high else f"{low} to {high}"


def page(rows: Sequence[Row], svg: str) -> bytes:
    """The file."""
    return (
        TEMPLATES.get_template("league.html")
        .render(
            style=Markup((ASSETS / "page.css").read_text(encoding="utf-8")),
            set=SET,
            scenes=[name for name, one in frozen().items() if not one.held_back],
            held=[(name, one) for name, one in frozen().items() if one.held_back],
            chart=Markup(inline(svg, "profiles", "Share of the pairs within a tolerance over the budget")),
            heads=HEADS,
            cards=cards(rows),
            rows=[_shown(row) for row in rows],
        )
        .encode()
    )


def _shown(row: Row) -> dict[str, Any]:
    """A row of the table of all entries, as text."""
    cells = []
    for name in HEADS:
        value, floor = row[f"{name} [%]"], row[f"{name} floor [%]"]
        cells.append(value_cell(value, floor, signed=name == "force_end") if name in PROFILED else _plain(value))
    return {
        "engine": row["engine"],
        "scene": row["scene"],
        "mesh": f"{row['mesh']}, {row['nodes']}",
        "cells": [*cells, _plain(row[COST]), _plain(row[COUNT])],
        "settings": ", ".join(f"{name} {value}" for name, value in json.loads(row["settings"]).items()) or "usual",
        "message": row["message"],
    }


def _plain(value: float) -> str:
    return MISSING if value != value else plain(value)
