"""What the tables of a results folder say, in a sentence each, with the numbers and how well they are known."""

from collections.abc import Mapping
from dataclasses import dataclass

import pandas as pd

from studies.metrics.cells import MINUS, plain, value_cell

Tables = Mapping[str, pd.DataFrame]
VOLUME, FORCE, MEAN = "volume_worst [%]", "force_end [%]", "mean_error [%]"
FRAME, REAL = "frame_time [ms]", "real_time [s/s]"
RECIPE = ["scene", "body", "law", "nodes", "stiffness"]
"""What a body with and without a constraint share."""
RAISED = str.maketrans("-0123456789", "⁻⁰¹²³⁴⁵⁶⁷⁸⁹")
HALF = 0.51
"""Share of the step limit up to which a step is the usual one [1]."""


@dataclass(frozen=True)
class Finding:
    """A number and what it says."""

    title: str
    number: str
    text: str


def findings(tables: Tables) -> list[Finding]:
    """Those that the tables of the studies (by name; columns as `study_table`) bear; each from rows that ended well."""
    found = (volume(tables), one_volume(tables), nearest_force(tables), cost(tables), real_time(tables), limit(tables))
    return [finding for finding in found if finding is not None]


def volume(tables: Tables) -> Finding | None:
    """How well volumes are kept, and what the same bodies lose without."""
    pairs = _pairs(_joined(tables, VOLUME))
    if pairs.empty:
        return None
    kept, lost = (pairs.loc[pairs[f"{VOLUME} {which}"].idxmax()] for which in ("kept", "free"))
    return Finding(
        "How well volumes are kept",
        f"{_small(kept[f'{VOLUME} kept'])} %",
        f"is the farthest that a volume kept by implicit_volume is off in {len(pairs)} pairs of runs ({_name(kept)}). "
        f"Without the constraint the same bodies are off by up to {_plain(lost[f'{VOLUME} free'])} % ({_name(lost)}). "
        "A volume is compared with the body's own at rest, which rounding alone blurs.",
    )


def one_volume(tables: Tables) -> Finding | None:
    """What forces are worth in bodies that keep one volume."""
    rows = _ended_well(tables.get("volume_loss"), FORCE)
    rows = rows[rows["method"] == "implicit_volume"] if len(rows) else rows
    if rows.empty:
        return None
    said = [f"{_range(part, FORCE)} in {_kind(kind)}" for kind, part in rows.groupby("body", sort=False)]
    worst = rows.loc[rows[FORCE].abs().idxmax()]
    return Finding(
        "Forces of bodies with one volume",
        f"{_measured(worst, FORCE)} %",
        f"is the largest error of a force at the deepest point ({_name(worst)}). Bodies that keep one volume are off "
        f"by {' and by '.join(said)}, over {rows['scene'].nunique()} scenes.",
    )


def _kind(body: object) -> str:
    return "the paper's surface bodies" if body == "surface" else f"{body} bodies"


def nearest_force(tables: Tables) -> Finding | None:
    """How near forces come to the reference, scene by scene."""
    rows = _joined(tables, FORCE, MEAN)
    rows = rows[rows["method"] == "implicit_volume"] if len(rows) else rows
    if rows.empty:
        return None
    best = rows.loc[rows[FORCE].abs().groupby(rows["scene"], sort=False).idxmin()]
    said = [
        f"{_measured(row, FORCE)} % in {row['scene']} ({row['body']}, {row['nodes']} nodes; displacement on the mean "
        f"{_measured(row, MEAN, signed=False)} %)"
        for _, row in best.iterrows()
    ]
    return Finding(
        "The force nearest to the reference",
        _range(best, FORCE),
        f"is how far the best body of each scene that keeps its volume is off: {'; '.join(said)}.",
    )


def cost(tables: Tables) -> Finding | None:
    """What keeping one volume adds to a frame."""
    pairs = _pairs(_ended_well(tables.get("frame_rate"), FRAME))
    if pairs.empty:
        return None
    kept, free = (pairs[f"{FRAME} {which}"] for which in ("kept", "free"))
    added = 100 * (kept / free - 1)
    spread = 100 * kept / free * (_spread(pairs, "kept") / kept + _spread(pairs, "free") / free)
    cells = [value_cell(a, s, signed=True) for a, s in zip(added, spread, strict=True)]
    least, most = int(added.to_numpy().argmin()), int(added.to_numpy().argmax())
    row = pairs.iloc[most]
    return Finding(
        "What keeping a volume costs",
        f"{cells[least]} to {cells[most]} %",
        f"is what implicit_volume adds to the time of a frame in {len(pairs)} pairs of runs. The most is in "
        f"{_name(row)}: {value_cell(kept.iloc[most], _spread(pairs, 'kept').iloc[most])} ms against "
        f"{value_cell(free.iloc[most], _spread(pairs, 'free').iloc[most])} ms. In {int((spread > added.abs()).sum())} "
        "pairs the repeats spread by more than the difference.",
    )


def real_time(tables: Tables) -> Finding | None:
    """How many bodies keep up with the clock."""
    rows = _joined(tables, REAL)
    if rows.empty:
        return None
    rows = rows.drop_duplicates([*RECIPE, "method", "dt [ms]"])
    slowest = rows.loc[rows[REAL].idxmin()]
    return Finding(
        "Speed",
        f"{int((rows[REAL] > 1).sum())} of {len(rows)}",
        "timed bodies simulate more than a second in a second of computing on one core. The slowest, "
        f"{_name(slowest)} by {slowest['method']}, simulates {_measured(slowest, REAL, signed=False)} s.",
    )


def limit(tables: Tables) -> Finding | None:
    """Whether the step limit says where runs break."""
    rows = tables.get("stability_map")
    if rows is None or rows.empty or "dt/dt_c" not in rows:
        return None
    rows = rows[rows["dt/dt_c"].notna()]
    below, above = rows[rows["dt/dt_c"] < 1], rows[rows["dt/dt_c"] >= 1]
    broken, held = int((below["status"] == "diverged").sum()), int((above["status"] != "diverged").sum())
    return Finding(
        "The limit of the time step",
        f"{broken} of {len(below)}",
        f"runs below the predicted limit of the time step diverge; above it {held} of {len(above)} do not. These are "
        "counts of single runs.",
    )


def _joined(tables: Tables, *columns: str) -> pd.DataFrame:
    """Rows that ended well of all tables with these columns; without those far below the usual step."""
    parts = [part for part in (_ended_well(table, *columns) for table in tables.values()) if len(part)]
    return pd.concat(parts, ignore_index=True) if parts else pd.DataFrame()


def _ended_well(table: pd.DataFrame | None, *columns: str) -> pd.DataFrame:
    if table is None or table.empty or not {"method", "status", *columns} <= set(table.columns):
        return pd.DataFrame()
    known = table[list(columns)].notna().all(axis=1)
    return table[known & (table["status"] == "ok")].reset_index(drop=True)


def _pairs(rows: pd.DataFrame) -> pd.DataFrame:
    """implicit_volume ("… kept") beside free ("… free") on the same body at about the same share of the step limit."""
    if rows.empty:
        return rows
    usual = rows[rows["dt/dt_c"].between(HALF / 2, HALF)].drop_duplicates([*RECIPE, "method"])
    kept, free = (usual[usual["method"] == name] for name in ("implicit_volume", "free"))
    return kept.merge(free, on=RECIPE, suffixes=(" kept", " free"))


def _spread(pairs: pd.DataFrame, which: str) -> pd.Series:
    name = f"{FRAME.replace(' [', ' floor [')} {which}"
    return pairs[name].fillna(0.0) if name in pairs else 0.0 * pairs[f"{FRAME} {which}"]


def _measured(row: pd.Series, column: str, signed: bool = True) -> str:
    """A value beside its uncertainty."""
    return value_cell(row[column], row.get(column.replace(" [", " floor ["), float("nan")), signed=signed)


def _range(rows: pd.DataFrame, column: str) -> str:
    by_size = rows.loc[rows[column].abs().sort_values().index]
    ends = dict.fromkeys(_measured(row, column) for _, row in by_size.iloc[[0, -1]].iterrows())
    return " to ".join(ends) + " %"


def _name(row: pd.Series) -> str:
    return f"{row['scene']}, {row['body']}, {row['nodes']} nodes"


def _small(value: float) -> str:
    """Two digits: 0.41, or 2.8 × 10⁻⁵ where that is shorter."""
    digits, _, power = f"{value:.2g}".partition("e")
    return f"{digits} × 10{str(int(power)).translate(RAISED)}" if power else digits


def _plain(value: float) -> str:
    return plain(value).replace("-", MINUS)
