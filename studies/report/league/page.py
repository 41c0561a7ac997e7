"""league.html: the profiles and a card for each engine, in one file that needs neither a script nor a network."""

import json
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import pandas as pd
from markupsafe import Markup

from studies.base.atomic import write_whole
from studies.exchange.league import LEAGUE, SET, frozen
from studies.metrics.cells import MISSING, plain, value_cell
from studies.metrics.metric import COMPARABLE
from studies.report.league.rows import (
    COLUMNS,
    COST,
    COUNT,
    PROFILED,
    TABLE,
    Row,
    cards,
    engines,
    league_rows,
    pairs,
    profile,
)
from studies.report.page.markup import ASSETS, TEMPLATES
from studies.report.page.svg import inline
from studies.store.tables import write_table

NAME, CHART = "league.html", "profiles.png"
FACTORS = (1.0, 3.0, 10.0)
"""Of what is usually enough: a column of the chart each."""
BUDGETS = {COST: "computing / simulated time [s/s]", COUNT: "force evaluations / time [1/s]"}
HEADS = {
    "force_end": "force",
    "mean_error": "displacement, mean",
    "volume_worst": "volume",
    "penetration": "penetration",
}


def write_league(root: Path, with_report: bool = False) -> tuple[list[Path], list[str]]:
    """Table, chart and page of what is entered below the results folder `root`; their paths, none without an entry, and
    what cannot be read, in sentences. with_report: the page links to report.html, which is written next to it.

    Raises StudyError where something cannot be written."""
    from studies.plots.campaigns.league import draw  # with matplotlib, which takes half a second to load
    from studies.plots.style.style import svg_copies

    rows, remarks = league_rows(root)
    if not rows:
        return [], remarks
    folder = root / LEAGUE
    folder.mkdir(parents=True, exist_ok=True)
    write_table(folder / TABLE, pd.DataFrame(rows))
    with svg_copies() as pictures:
        draw(profiles(rows), folder / CHART)
    write_whole(root / NAME, page(rows, pictures[CHART], with_report))
    return [folder / TABLE, folder / CHART, root / NAME], remarks


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


def page(rows: Sequence[Row], svg: str, with_report: bool = False) -> bytes:
    """The file, with a link to report.html or without."""
    return (
        TEMPLATES.get_template("league.html")
        .render(
            style=Markup((ASSETS / "page.css").read_text(encoding="utf-8")),
            set=SET,
            with_report=with_report,
            scenes=[name for name, one in frozen().items() if not one.held_back],
            held=[(name, one) for name, one in frozen().items() if one.held_back],
            chart=Markup(inline(svg, "profiles", "Share of the pairs within a tolerance over the budget")),
            heads=HEADS,
            cards=cards(rows),
            rows=[_shown(row) for row in rows],
        )
        .encode()
    )


def league_cards(root: Path) -> list[dict[str, Any]]:
    """The cards of the page that lies in the results folder `root`, none without one: for the section of the report."""
    table = root / LEAGUE / TABLE
    if not (table.is_file() and (root / NAME).is_file()):
        return []
    read = pd.read_csv(table, keep_default_na=True).astype({"ours": bool})
    texts = ("version", "message")
    return cards([{**row, **{name: _text(row[name]) for name in texts}} for row in read.to_dict("records")])


def _text(value: Any) -> str:
    return "" if value != value else str(value)


def _shown(row: Mapping[str, Any]) -> dict[str, Any]:
    cells = [
        value_cell(row[f"{name} [%]"], row[f"{name} floor [%]"], signed=name == "force_end")
        if name in PROFILED
        else _plain(row[f"{name} [%]"])
        for name in COLUMNS
    ]
    settings = ", ".join(f"{name} {value}" for name, value in json.loads(row["settings"]).items())
    words = f"{row['mesh']}, {row['nodes']}"
    return {
        "engine": row["engine"],
        "scene": row["scene"],
        "mesh": words,
        "cells": [*cells, _plain(row[COST]), _plain(row[COUNT])],
        "settings": settings or "usual",
        "message": row["message"] if row["message"] else "",
    }


def _plain(value: float) -> str:
    return MISSING if value != value else plain(value)
