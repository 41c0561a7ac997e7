"""The table of the league: a row for each engine, scene and mesh, computed from the stored entries."""

import json
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

from studies.base.errors import StudyError
from studies.exchange.entry import entry_files, run_of_entry
from studies.exchange.league import LEAGUE, frozen
from studies.metrics.judged import cost_of
from studies.metrics.metric import COMPARABLE
from studies.metrics.table import metric
from studies.metrics.wish import SOLID
from studies.reference.load import reference_for
from studies.store.record import read_record

TABLE = "league.csv"
COLUMNS = ("force_end", "mean_error", "volume_worst", "penetration")
PROFILED = {"force_end": SOLID[0], "mean_error": SOLID[1]}
"""Quantities of profiles -> default target [%]; all scenes of the set have solid organs."""
COST, COUNT = "cost [s/s]", "evaluations [1/s]"
"""Computing time, and evaluations of all forces, for a simulated second."""
ROUNDING = 1e-6
"""Smaller sizes [%] come from rounding."""
Row = Mapping[str, Any]


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
    entry = json.loads(str(record.attributes.get(LEAGUE) or "{}"))
    if entry.get("scene") not in frozen():
        raise StudyError(f"{path} is no entry of the league; delete it")
    run = run_of_entry(record, None)
    scene = run.case.scene
    run = run_of_entry(record, reference_for(path, scene))
    comparable = record.status in COMPARABLE
    row = {
        "engine": entry["engine"],
        "version": entry["version"],
        "ours": entry["ours"],
        "scene": scene.name,
        "mesh": entry["mesh"],
        "nodes": entry["nodes"],
        "status": str(record.status),
        "message": record.message,
        "settings": json.dumps(entry["settings"]),
        "reference": "" if run.reference is None else run.reference.source,
    }
    for name in COLUMNS:
        one = metric(name)
        row[f"{name} [%]"] = one(run) if comparable else float("nan")
        row[f"{name} floor [%]"] = one.uncertainty(run) if comparable else float("nan")
    count = entry["evaluations"]
    cost = cost_of(run) if comparable else None
    return row | {COST: cost.value if cost else float("nan"), COUNT: count / scene.duration if count else float("nan")}


def pairs() -> dict[tuple[str, str], float]:
    """(scene, quantity) of the open scenes -> bar of the reference [%]."""
    return {(scene, name): bar for scene, one in frozen().items() for name, bar in one.bars.items()}


def tolerance(name: str, factor: float, bar: float) -> float:
    """`factor` times the default target [%], but at least the uncertainty of the reference."""
    return max(factor * PROFILED[name], bar)


def solutions(
    rows: Sequence[Row], engine: str, factor: float, bars: Mapping[tuple[str, str], float]
) -> Iterator[tuple[tuple[str, str], Row]]:
    """Each pair that an engine solves within the tolerance, with the row in which it does."""
    for row in rows:
        for name in PROFILED:
            pair = (row["scene"], name)
            if row["engine"] != engine or pair not in bars:
                continue
            if abs(row[f"{name} [%]"]) <= tolerance(name, factor, bars[pair]):
                yield pair, row


def profile(
    rows: Sequence[Row], engine: str, factor: float, bars: Mapping[tuple[str, str], float], budget: str = COST
) -> list[tuple[float, float]]:
    """(budget, share of the pairs that are solved within the tolerance for at most this budget), ascending; a pair
    counts from the cost of its cheapest sufficient entry on, and not at all if no cost is known."""
    cheapest: dict[tuple[str, str], float] = {}
    for pair, row in solutions(rows, engine, factor, bars):
        if row[budget] == row[budget]:
            cheapest[pair] = min(cheapest.get(pair, row[budget]), row[budget])
    costs = sorted(cheapest.values())
    return [(cost, (number + 1) / len(bars)) for number, cost in enumerate(costs)]


def engines(rows: Sequence[Row]) -> list[str]:
    """By name, those of others first."""
    ours = {row["engine"]: bool(row["ours"]) for row in rows}
    return sorted(ours, key=lambda name: (ours[name], name))


def cards(rows: Sequence[Row]) -> list[dict[str, Any]]:
    """One for each engine: the range of the sizes of its errors, its cost, and what it cannot do."""
    bars = pairs()
    return [_card(name, [row for row in rows if row["engine"] == name], bars) for name in engines(rows)]


def _card(name: str, rows: Sequence[Row], bars: Mapping[tuple[str, str], float]) -> dict[str, Any]:
    judged = [row for row in rows if row["status"] in COMPARABLE]
    missing = [
        scene for scene, one in frozen().items() if not one.held_back and scene not in {r["scene"] for r in rows}
    ]
    cannot: dict[str, list[str]] = {}
    for row in rows:
        if row["message"]:
            scenes = cannot.setdefault(row["message"].removeprefix(f"{name}: "), [])
            scenes += [row["scene"]] if row["scene"] not in scenes else []
    solved = {pair for pair, _ in solutions(rows, name, 1.0, bars)}
    return {
        "engine": name,
        "version": rows[0]["version"],
        "ours": bool(rows[0]["ours"]),
        "scenes": len({row["scene"] for row in judged}),
        "ranges": {column: _range(judged, f"{column} [%]") for column in COLUMNS},
        "cost": _range(judged, COST),
        "count": _range(judged, COUNT),
        "solved": f"{len(solved)} of {len(bars)}" if judged else "–",
        "missing": missing,
        "cannot": [f"{', '.join(scenes)}: {reason}" for reason, scenes in cannot.items()],
    }


def _range(rows: Sequence[Row], column: str) -> str:
    """ "1.2 to 41": smallest and largest size; a dash if nothing is known, 0 below ROUNDING."""
    values = [abs(row[column]) if abs(row[column]) > ROUNDING else 0.0 for row in rows if row[column] == row[column]]
    if not values:
        return "–"
    low, high = (f"{value:.2g}" if value < 100 else f"{value:,.0f}" for value in (min(values), max(values)))
    return low if low == high else f"{low} to {high}"
