"""Findings from the tables of a results folder: a sentence each, with numbers and their uncertainties."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from studies.base.counting import counted
from studies.metrics.cells import plain, value_cell

Row = Mapping[str, Any]
"""Row of a table of `study_table`; None for an unknown number."""
Tables = Mapping[str, Sequence[Row]]
VOLUME, FORCE, MEAN = "volume_worst [%]", "force_end [%]", "mean_error [%]"
FRAME, REAL = "frame_time [ms]", "real_time [s/s]"
RECIPE = ("scene", "body", "law", "nodes", "stiffness")
"""Columns that are equal for a body with and without a constraint."""
KEPT, FREE = "implicit_volume", "free"
CONTESTED = {FORCE: "force", MEAN: "mean displacement error", VOLUME: "worst volume", REAL: "speed"}
"""Numbers in which entries from outside and our runs are compared."""
MOST_NAMED = 6
"""Numbers of entries that a finding names."""
HALF = 0.51
"""Largest share of the step limit of a usual step; a step below half of it is fine [1]."""
RAISED = str.maketrans("-0123456789", "⁻⁰¹²³⁴⁵⁶⁷⁸⁹")


@dataclass(frozen=True)
class Finding:
    title: str
    number: str
    text: str


def findings(tables: Tables) -> list[Finding]:
    """The findings from the tables of the studies, by name, each from rows that ended well. All but the last refer to
    our runs."""
    ours = {name: [row for row in table if not row.get("entry")] for name, table in tables.items()}
    candidates = [each(ours) for each in (volume, one_volume, nearest_force, cost, real_time, limit)]
    return [finding for finding in (*candidates, entries(tables)) if finding is not None]


def volume(tables: Tables) -> Finding | None:
    pairs = _pairs(_joined(tables, VOLUME))
    if not pairs:
        return None
    kept = max((kept for kept, _ in pairs), key=lambda row: row[VOLUME])
    lost = max((free for _, free in pairs), key=lambda row: row[VOLUME])
    return Finding(
        "How well volumes are kept",
        f"{_small(kept[VOLUME])} %",
        f"Largest error of a volume kept by {KEPT}, in {counted(len(pairs), 'pair')} of runs ({_name(kept)}). "
        f"Without the constraint the same bodies are off by up to {plain(lost[VOLUME])} % "
        f"({_name(lost)}). A volume is compared with the body's own at rest, which rounding alone blurs.",
    )


def one_volume(tables: Tables) -> Finding | None:
    rows = [row for row in _ended_well(tables.get("volume_loss", ()), FORCE) if row["method"] == KEPT]
    if not rows:
        return None
    kinds = dict.fromkeys(row["body"] for row in rows)
    phrases = [f"{_range([row for row in rows if row['body'] == kind], FORCE)} in {_kind(kind)}" for kind in kinds]
    worst = max(rows, key=lambda row: abs(row[FORCE]))
    return Finding(
        "Forces of bodies with one volume",
        f"{_measured(worst, FORCE)} %",
        f"Largest force error at the deepest point, of bodies that keep one volume ({_name(worst)}). Their errors are "
        f"{' and '.join(phrases)}, over {counted(len({row['scene'] for row in rows}), 'scene')}.",
    )


def nearest_force(tables: Tables) -> Finding | None:
    best: dict[str, Row] = {}
    for row in _joined(tables, FORCE, MEAN):
        if row["method"] == KEPT and abs(row[FORCE]) < abs(best.get(row["scene"], {FORCE: float("inf")})[FORCE]):
            best[row["scene"]] = row
    if not best:
        return None
    phrases = [
        f"{_measured(row, FORCE)} % in {row['scene']} ({row['body']}, {row['nodes']} nodes; mean displacement error "
        f"{_measured(row, MEAN, signed=False)} %)"
        for row in best.values()
    ]
    return Finding(
        "The force nearest to the reference",
        _range(list(best.values()), FORCE),
        f"Force errors of the best body that keeps its volume, in each scene: {'; '.join(phrases)}.",
    )


def cost(tables: Tables) -> Finding | None:
    pairs = _pairs(_ended_well(tables.get("frame_rate", ()), FRAME))
    if not pairs:
        return None
    overheads = sorted((_overhead(kept, free) for kept, free in pairs), key=lambda one: one[0])
    cells = [value_cell(percent, spread, signed=True) for percent, spread in overheads]
    kept, free = max(pairs, key=lambda pair: pair[0][FRAME] / pair[1][FRAME])
    return Finding(
        "Cost of keeping a volume",
        f"{' to '.join(dict.fromkeys((cells[0], cells[-1])))} %",
        f"Time that {KEPT} adds to a frame, in {counted(len(pairs), 'pair')} of runs. The most is in "
        f"{_name(kept)}: {_measured(kept, FRAME, signed=False)} ms against {_measured(free, FRAME, signed=False)} ms. "
        f"In {counted(sum(spread > abs(percent) for percent, spread in overheads), 'pair')} the repeats spread by more "
        "than the difference.",
    )


def real_time(tables: Tables) -> Finding | None:
    rows = list({_key(row, "method", "dt [ms]"): row for row in _joined(tables, REAL)}.values())
    if not rows:
        return None
    slowest = min(rows, key=lambda row: row[REAL])
    return Finding(
        "Speed",
        f"{sum(row[REAL] > 1 for row in rows)} of {len(rows)}",
        "Timed bodies that simulate more than a second in a second of computing on one core. The slowest, "
        f"{_name(slowest)} by {slowest['method']}, simulates {_measured(slowest, REAL, signed=False)} s.",
    )


def limit(tables: Tables) -> Finding | None:
    rows = [row for row in tables.get("stability_map", ()) if row.get("dt/dt_c") is not None]
    if not rows:
        return None
    below, above = ([row["status"] for row in rows if (row["dt/dt_c"] < 1) == side] for side in (True, False))
    return Finding(
        "The limit of the time step",
        f"{below.count('diverged')} of {len(below)}",
        "Runs below the predicted limit of the time step that diverge; above it "
        f"{len(above) - above.count('diverged')} of {len(above)} do not. These are counts of single runs.",
    )


def entries(tables: Tables) -> Finding | None:
    """Where a number of an entry from outside is the best of its scene, of all bodies and methods in all studies."""
    contests = [contest for column in CONTESTED for contest in _contests(tables, column)]
    if not contests:
        return None
    wins = [_win(column, best, ours) for column, best, ours in contests if best.get("entry")]
    words = "; ".join(wins[:MOST_NAMED]) + (f"; and {len(wins) - MOST_NAMED} more" if len(wins) > MOST_NAMED else "")
    return Finding(
        "Results of other programs",
        f"{len(wins)} of {len(contests)}",
        "Results (force, displacement, volume and speed in each scene) in which another program beats all our bodies "
        f"and methods{': ' if wins else '.'}{words}{'.' if wins else ''}",
    )


def _contests(tables: Tables, column: str) -> list[tuple[str, Row, Row | None]]:
    """Of each scene with an entry that has this number: the best row, and the best of ours."""
    scenes: dict[str, list[Row]] = {}
    for row in _joined(tables, column):
        scenes.setdefault(row["scene"], []).append(row)
    contests = []
    for rows in scenes.values():
        ranked = sorted(rows, key=lambda row: -row[column] if column == REAL else abs(row[column]))
        if any(row.get("entry") for row in rows):
            contests.append((column, ranked[0], next((row for row in ranked if not row.get("entry")), None)))
    return contests


def _win(column: str, best: Row, ours: Row | None) -> str:
    what, unit = CONTESTED[column], column.split("[")[1].rstrip("]")

    def number(row: Row) -> str:
        return _small(row[column]) if column == VOLUME else _measured(row, column, signed=column == FORCE)

    against = "" if ours is None else f" (ours at best {number(ours)} {unit}, {_name(ours)} by {ours['method']})"
    return f"{what} of {best['method']} in {best['scene']}, {number(best)} {unit}{against}"


def _joined(tables: Tables, *columns: str) -> list[Row]:
    return [row for table in tables.values() for row in _ended_well(table, *columns)]


def _ended_well(table: Sequence[Row], *columns: str) -> list[Row]:
    return [row for row in table if row["status"] == "ok" and all(row.get(name) is not None for name in columns)]


def _pairs(rows: Sequence[Row]) -> list[tuple[Row, Row]]:
    """Rows of the same body with the constraint and without, both at about the same share of the step limit."""
    usual = [row for row in rows if HALF / 2 <= (row["dt/dt_c"] or 0.0) <= HALF]
    kept, free = ({_key(row): row for row in reversed(usual) if row["method"] == name} for name in (KEPT, FREE))
    return [(kept[key], free[key]) for key in reversed(kept) if key in free]


def _overhead(kept: Row, free: Row) -> tuple[float, float]:
    """What the constraint adds to a frame, and how far the repeats of both spread [%]."""
    ratio = kept[FRAME] / free[FRAME]
    spread = sum((_floor(row, FRAME) or 0.0) / row[FRAME] for row in (kept, free))
    return 100 * (ratio - 1), 100 * ratio * spread


def _key(row: Row, *more: str) -> tuple[Any, ...]:
    return tuple(row[name] for name in (*RECIPE, *more))


def _floor(row: Row, column: str) -> float | None:
    return row.get(column.replace(" [", " floor ["))


def _measured(row: Row, column: str, signed: bool = True) -> str:
    floor = _floor(row, column)
    return value_cell(row[column], float("nan") if floor is None else floor, signed=signed)


def _range(rows: Sequence[Row], column: str) -> str:
    by_size = sorted(rows, key=lambda row: abs(row[column]))
    return " to ".join(dict.fromkeys(_measured(row, column) for row in (by_size[0], by_size[-1]))) + " %"


def _kind(body: str) -> str:
    return "the paper's surface bodies" if body == "surface" else f"{body} bodies"


def _name(row: Row) -> str:
    return f"{row['scene']}, {row['body']}, {row['nodes']} nodes"


def _small(value: float) -> str:
    """Two digits: 0.41, or 2.8 × 10⁻⁵ where that is shorter."""
    digits, _, power = f"{value:.2g}".partition("e")
    return f"{digits} × 10{str(int(power)).translate(RAISED)}" if power else digits
