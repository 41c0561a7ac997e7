"""`python -m studies.lab.population.intervals [FOLDER [PAIRS.csv ...]]`: the rule of studies.metrics.interval by the
members in FOLDER/pairs.csv and the random scenes in FOLDER/scenes.csv, default the published ones, and intervals.md,
how it does on organs that it has not seen.

Rows of other files, those of campaigns, are added to FOLDER/scenes.csv.
"""

import argparse
import json
import math
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from studies import Run, Status
from studies.lab.commit import commit
from studies.metrics.interval import (
    OF_100,
    RESTS,
    RULE_FILE,
    SIGNS,
    Apart,
    bound,
    from_rest,
    group,
    scale,
    second_mesh,
    signs,
)
from studies.metrics.judged import DISPLACEMENT, FORCE
from studies.metrics.wish import usual_wish
from studies.scene.kind import load_of

PUBLISHED, PAIRS, SCENES = Path("results/published/population"), "pairs.csv", "scenes.csv"
NODES = 1194, 1594
"""Of the two meshes of `organbench run FILE.py`."""
ERRORS = dict(zip(Apart._fields, (FORCE, DISPLACEMENT), strict=True))
FLOORS = Apart(force=1.0, displacement=0.05)
"""Floors over the median change: two forces can be equal by chance, two displacements all over a surface hardly can."""
WEIGHTS = Apart(force=0.0, displacement=1.0)
"""Of the shape [1/%]. With it displacements of livers, which have thin margins, are inside as often as others."""
BAR = 1.0 / 3.0
"""Largest uncertainty of a reference that judges, over the target of the scene."""


def pairs_of(runs: Sequence[Run]) -> pd.DataFrame:
    """A row for each member whose two adaptive meshes ended well and have a reference: SIGNS, and |errors| [%], with
    NaN for the change and the errors that the reference does not decide."""
    ended = [run for run in runs if run.reference is not None and run.record.status == Status.OK]
    cases, rows = [run.case for run in ended], list[dict[str, Any]]()
    for fine in ended:
        other = second_mesh(fine.case, cases)
        if other is not None and (other.body.nodes, fine.case.body.nodes) == NODES:
            coarse, scene = ended[cases.index(other)], fine.case.scene
            if from_rest(coarse, fine) > RESTS:  # they have no interval
                continue
            both = list(zip(NODES, (coarse, fine), strict=True))
            organ = "scan" if scene.organ.shape == "file" else scene.organ.shape
            row = {"scene": scene.name, "organ": organ, "load": load_of(scene), **signs(coarse, fine)}
            for name, entry in ERRORS.items():
                decided = entry.uncertainty(fine) <= BAR * getattr(usual_wish(scene), name)
                row |= {f"{name}_{n}": abs(entry(run)) if decided else math.nan for n, run in both}
                row[name] = row[name] if decided else math.nan
            rows.append(row)
    return pd.DataFrame(rows)


def rule_of(pairs: pd.DataFrame) -> dict[str, Any]:
    """The rule by the members of a table of pairs, none for a load with too few."""
    seen = {name: np.fmax if than == "more" else np.fmin for name, (_, than) in SIGNS.items()}  # both pass over NaN
    rule: dict[str, Any] = {"nodes": list(NODES)}
    judged = pairs.loc[pairs[[f"{name}_{n}" for name in Apart._fields for n in NODES]].notna().any(axis=1)]
    rule["seen"] = {name: float(end.reduce(judged[name].to_numpy(float))) for name, end in seen.items()}
    rule["loads"], kinds = sorted(set(judged["load"])), pairs["load"].map(group).to_numpy(str)
    for name in Apart._fields:
        change, shape, rule[name] = pairs[name].to_numpy(float), pairs["shape"].to_numpy(float), {}
        for kind in sorted(set(kinds[np.isfinite(change)])):
            some = np.isfinite(change) & (kinds == kind)
            floor = getattr(FLOORS, name) * float(np.median(change[some]))
            entry = {"members": int(some.sum()), "floor": floor, "of_shape": getattr(WEIGHTS, name)}
            sizes = scale(entry, change[some], shape[some])
            factor = {str(n): quantile(pairs[f"{name}_{n}"].to_numpy(float)[some] / sizes) for n in NODES}
            if max(factor.values()) < math.inf:
                rule[name][kind] = entry | {"factor": factor}
    return rule


def quantile(scores: np.ndarray) -> float:
    """What the next score stays within with a probability of at least OF_100 %: of n the k-th smallest, k the next
    whole number to OF_100 % of n + 1 (Lei et al. 2018, algorithm 2); infinite for too few."""
    k = math.ceil(OF_100 * (len(scores) + 1) / 100)
    return float(np.sort(scores)[k - 1]) if k <= len(scores) else math.inf


def left_out(pairs: pd.DataFrame) -> pd.DataFrame:
    """Intervals of the finer mesh of the members of each organ by the rule that the other organs give, of an organ that
    alone has its load by that of its other half (members with even numbers, and odd): how many members, the share of
    errors inside [%], the median interval, and what OF_100 of 100 errors are within [%]."""
    organ, kind = pairs["organ"].to_numpy(str), pairs["load"].map(group).to_numpy(str)
    half, rows = pairs["scene"].str.split("_").str[-1].astype(int).to_numpy() % 2, []
    for name in Apart._fields:
        change, shape, error = (pairs[one].to_numpy(float) for one in (name, "shape", f"{name}_{NODES[1]}"))
        known, width = np.isfinite(change), np.full(len(pairs), np.nan)
        for load_, each, part in sorted(set(zip(kind[known], organ[known], half[known], strict=True))):
            alike = known & (kind == load_)
            others = alike & (organ != each)
            rule = rule_of(pairs.loc[others if others.any() else alike & (half != part)])
            some = alike & (organ == each) & (half == part)
            if load_ in rule[name]:
                width[some] = bound(rule[name][load_], change[some], shape[some], NODES[1])
        judged = np.isfinite(width)
        for each in [*dict.fromkeys(organ[judged]), "all"]:
            some = judged & ((organ == each) | (each == "all"))
            inside, within = 100.0 * np.mean(error[some] <= width[some]), np.quantile(error[some], OF_100 / 100.0)
            rows.append((name, each, int(some.sum()), inside, np.median(width[some]), within))
    return pd.DataFrame(rows, columns=["error", "organ", "members", "inside", "interval", "within"])


def intervals_of(pairs: pd.DataFrame) -> str:
    """`left_out` as a table."""
    heads = "error", "organ", "members", "inside [%]", "median interval [± %]", f"{OF_100} of 100 errors are within [%]"
    lines = ["| " + " | ".join(heads) + " |", "|---" * len(heads) + "|"]
    for error, organ, members, inside, *sizes in left_out(pairs).itertuples(index=False):
        cells = [error, organ, str(members), f"{inside:.0f}", *(f"{size:.2g}" for size in sizes)]
        lines.append(f"| {' | '.join(cells)} |")
    return "\n".join(lines)


def members_in(folder: Path) -> pd.DataFrame:
    """All rows in a folder on which the rule rests."""
    return pd.concat([pd.read_csv(path) for name in (PAIRS, SCENES) if (path := folder / name).is_file()])


def main(folder: Path, *others: Path) -> None:
    stored = [path for path in (folder / SCENES, *others) if path.is_file() or path in others]
    if stored:
        scenes = pd.concat(map(pd.read_csv, stored)).drop_duplicates("scene", keep="last")
        scenes.to_csv(folder / SCENES, index=False)
    pairs = members_in(folder)
    seeds = sorted(set(pairs["scene"].str.split("_").str[-2].astype(int)))
    rule = {"seeds": seeds, "commit": commit(), **rule_of(pairs)}
    RULE_FILE.write_text(json.dumps(rule, indent=2) + "\n", encoding="utf-8")
    (folder / "intervals.md").write_text(intervals_of(pairs) + "\n", encoding="utf-8")


if __name__ == "__main__":
    parser = argparse.ArgumentParser(prog="python -m studies.lab.population.intervals", description=__doc__)
    parser.add_argument("folder", type=Path, nargs="?", default=PUBLISHED)
    parser.add_argument("pairs", type=Path, nargs="*")
    given = parser.parse_args()
    main(given.folder, *given.pairs)
