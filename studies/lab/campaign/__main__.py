"""`python -m studies.lab.campaign --seed N --scenes K --results DIR`: trust, measured on K random scenes of a seed.

What was interrupted continues. pairs.csv is for studies.lab.population.intervals. Exit code 1: a body is silent and far
off.
"""

import argparse
import json
import math
import multiprocessing
import os
import resource
import signal
import sys
import time
from collections import Counter
from dataclasses import asdict, replace
from pathlib import Path
from typing import Any

import numpy as np

from studies import Scene, StudyError
from studies.base.atomic import write_whole
from studies.catalog.accuracy import BUDGETS, FINEST
from studies.lab.campaign.draw import MOST, member
from studies.lab.campaign.outcome import JUDGED, Outcome, judge, told, two_meshes
from studies.lab.commit import commit
from studies.lab.population.intervals import PAIRS, pairs_of
from studies.lab.refusal import refusal
from studies.metrics.interval import OF_100
from studies.metrics.judged import DISPLACEMENT, FORCE

CELLS = [f"{told}, {truth}" for told in ("silent", "doubted") for truth in ("right", "wrong", "far", "undecided")]
FINE, WORST_FIRST = ("silent, right", "doubted, right", "not ok", "refused"), [*CELLS, "crashed"]
MOST_DOUBTED = 0.15
"""Largest share of the right bodies that may be doubted."""


def run_member(path: Path, seed: int, number: int, scans: list[Path], most: float, seconds: float) -> None:
    """Runs a member in a process of its own, with at most so many seconds of processor time, and stores what it gives;
    nothing for one that has no scene. most: unknowns of its reference."""
    part = path.with_suffix(".part")
    given = part, seed, number, scans, most, seconds
    one = multiprocessing.get_context("fork").Process(target=_run, args=given)
    one.start()
    one.join()
    if one.exitcode != 0:
        ended = f"its process ended with {one.exitcode}"
        row = json.loads(part.read_text(encoding="utf-8")) if part.is_file() else _row(number, "", [])
        out_of_time = one.exitcode == -signal.SIGXCPU
        _store(part, row | {"fault": f"stopped after {seconds:g} s" if out_of_time else ended, "stopped": True})
    if part.is_file():
        os.replace(part, path)


def _run(part: Path, seed: int, number: int, scans: list[Path], most: float, seconds: float) -> None:
    """Bodies are stored before their reference is solved."""
    resource.setrlimit(resource.RLIMIT_CPU, (math.ceil(seconds), resource.RLIM_INFINITY))
    part.unlink(missing_ok=True)
    try:
        scene = _scene(seed, number, scans, most)
    except StudyError as error:
        print(f"member {number} is skipped: {error}", flush=True)
        return
    print(f"{number}: {scene.title}", flush=True)
    nodes = int(np.random.default_rng([seed, number, 1]).choice([*BUDGETS, FINEST]))
    _store(part, _row(number, scene.title, []))
    ended = told(part.parent, scene, nodes)
    _store(part, _row(number, scene.title, [one for one, _ in ended]))
    fault = judge(part.parent, scene, ended)
    _store(part, _row(number, scene.title, [one for one, _ in ended]) | {"fault": fault})


def _scene(seed: int, number: int, scans: list[Path], most: float) -> Scene:
    scene = member(seed, number, scans)
    assert scene.reference is not None  # a member has a plan
    return replace(scene, reference=replace(scene.reference, most=most))


def _row(number: int, title: str, bodies: list[Outcome]) -> dict[str, Any]:
    row = {"member": number, "commit": commit(), "title": title, "fault": "", "stopped": False}
    return row | {"seconds": time.process_time(), "bodies": [asdict(one) for one in bodies]}


def _store(path: Path, row: dict[str, Any]) -> None:
    write_whole(path, (json.dumps(row, indent=1) + "\n").encode())


def table_of(rows: list[dict[str, Any]], again: str) -> tuple[str, int]:
    """Counts of all bodies, and those that are not right with the command that repeats them; how many of them are
    silent and far off."""
    bodies = [(row, Outcome(**one)) for row in rows for one in row["bodies"]]
    heads = [*CELLS, "not ok", "refused", "crashed"]
    lines = ["| body | " + " | ".join(heads) + " |", "|---" * (1 + len(heads)) + "|"]
    for way in [*dict.fromkeys(one.way for _, one in bodies), "all"]:
        counts = Counter(one.kind for _, one in bodies if way in (one.way, "all"))
        lines.append(f"| {way} | " + " | ".join(str(counts[head]) for head in heads) + " |")
    far, doubted, right = counts["silent, far"], counts["doubted, right"], counts["silent, right"]
    lines.append(f"\nsilent and more than 3 targets off: {far} (allowed: 0)")
    lines.append(f"right but doubted: {doubted} of {doubted + right} (allowed: {100 * MOST_DOUBTED:.0f} %)")
    for name, quantity in (("force", FORCE.name), ("displacement", DISPLACEMENT.name)):
        inside = [held for _, one in bodies if (held := one.inside(name, quantity)) is not None]
        lines.append(f"{name}s inside their interval: {sum(inside)} of {len(inside)} (of 100: {OF_100})")
    stopped = [row for row in rows if row["stopped"]]
    lines.append(f"members that did not end: {len(stopped)} of {len(rows)}")
    lines += [f"  {row['member']}: {row['title']}; {row['fault']}" for row in stopped]
    lines.append(f"commits: {', '.join(sorted({row['commit'] for row in rows}))}")
    odd = [(row, one) for row, one in bodies if one.kind not in FINE]
    for row, one in sorted(odd, key=lambda pair: WORST_FIRST.index(pair[1].kind)):
        errors = ", ".join(f"{name} {value:+.2g} ± {bar:.1g} %" for name, (value, bar, _) in one.errors.items())
        why = "; ".join(filter(None, [errors, row["fault"], one.message, *one.doubts]))
        lines.append(f"{one.kind}: {row['title']}; {one.way}: {one.recipe}; {why}\n  {again} {row['member']}")
    return "\n".join(lines), far


def main(words: list[str]) -> int:
    parser = argparse.ArgumentParser(prog="python -m studies.lab.campaign", description=(__doc__ or "").split("\n")[0])
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--scenes", type=int, default=200, metavar="K")
    parser.add_argument("--results", type=Path, default=Path("results"), metavar="DIR")
    parser.add_argument("--scans", type=Path, metavar="FOLDER", help="surfaces, PLY in mm; default: none, skipped")
    parser.add_argument("--most", type=float, default=MOST, metavar="N", help="unknowns of references")
    parser.add_argument("--seconds", type=float, default=900.0, metavar="S", help="processor time of a member")
    parser.add_argument("--member", type=int, metavar="N", help="this one alone, again")
    given = parser.parse_args(words)
    scans = sorted(given.scans.glob("*.ply")) if given.scans else []
    root = given.results / f"campaign-{given.seed}"
    root.mkdir(parents=True, exist_ok=True)
    print(f"seed {given.seed}, commit {commit()}", flush=True)
    for number in range(given.scenes) if given.member is None else [given.member]:
        path = root / f"{number:04d}.json"
        if given.member is None and path.is_file():
            continue
        run_member(path, given.seed, number, scans, given.most, given.seconds)
    rows = [json.loads(path.read_text(encoding="utf-8")) for path in sorted(root.glob("*.json"))]
    options = f"--seed {given.seed} --results {given.results} --most {given.most:g} --seconds {given.seconds:g}"
    options += f" --scans {given.scans}" if given.scans else ""
    text, far = table_of(rows, f"{parser.prog} {options} --member")
    print(text)
    ended = (row["member"] for row in rows if any(one["way"] == JUDGED and one["errors"] for one in row["bodies"]))
    runs = [run for number in ended for run in two_meshes(root, _scene(given.seed, number, scans, given.most))]
    if runs:
        pairs_of(runs).to_csv(root / PAIRS, index=False, float_format="%.4g")
    return int(far > 0)


if __name__ == "__main__":
    with refusal("campaign"):
        sys.exit(main(sys.argv[1:]))
