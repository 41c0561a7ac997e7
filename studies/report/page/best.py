"""The first lines of the page: which body to take, how wrong it is, how fast, and what the paper's body does."""

from collections import Counter
from collections.abc import Callable, Collection, Mapping, Sequence
from typing import Any

from studies.base.counting import counted, readable
from studies.exchange.entry import sides_of
from studies.meshing.bounds import REFERENCE_SHAPE, SHAPE, SHAPE_VOLUME, enough
from studies.metrics.cells import DISTURBED_MARK, MISSING, plain, value_cell
from studies.metrics.interval import OF_100, untested
from studies.metrics.judged import Judged, Measured, by_cost
from studies.metrics.run import Run
from studies.metrics.table import DISTURBED, OFF_SHAPE, PROCESSOR
from studies.metrics.wish import Wish, usual_wish
from studies.report.summary import PAPER, choice_of, compared_bodies, paper_body
from studies.runs.case import Case
from studies.runs.recipe_text import body_words
from studies.scene.scene import Scene
from studies.store.paths import key_hash
from studies.store.record import Status
from studies.tools.advise.words import wish_words

Best = dict[str, Any]
"""Of a scene, JSON-able: the target in words, whether the body meets it, the body with its step over the limit, the id
of its case, each number as [value, uncertainty] or None; `paper`: the same of the paper's body, or None."""
NUMBERS = ("force", "displacement", "shape", "volume", "speed", "processor_speed")
HEADS = ("body, surface nodes, step / limit", "force [%]", "mean [%]", "shape [%]", "volume [%]", "speed [s/s]")
HEADS += ("by processor time [s/s]",)
SIGNED = ("force", "volume")
SHAPE_WORDS = f"shape within {SHAPE:g} % of the organ's size, its volume within {SHAPE_VOLUME:g} %"
"""The bounds that `cheapest` adds to every wish."""
MISSED = {"force": "force", "displacement": "displacement", "shape": "shape", "shape_volume": "volume of the shape"}
"""Bounds of `Judged.shares` in words."""
MISSES = "misses the target"
SPEEDS = {"speed": "real_time{} [s/s]", "processor_speed": "real_time_cpu{} [s/s]"}
"""Column of a table with each speed, {} for " floor"."""


def case_id(case: Case) -> str:
    """The same for cases with the same numbers, independent of additional recorded fields."""
    return key_hash(case.replaced(recorded=()).key)


def best_bodies(runs: Sequence[Run], run_id: Callable[[Run], str]) -> list[Best]:
    """Of every scene in which an error of a body by implicit_volume is known: the cheapest body within the usual
    target, else the nearest."""
    ids = {run.case.key: run_id(run) for run in runs}
    rows = (_best(bodies, lambda one: ids[one.case.key]) for bodies in compared_bodies(runs).values())
    return [row for row in rows if row is not None]


def best_beside(
    scene: Scene, others: Sequence[Judged], theirs: Mapping[Run, Judged | None], run_id: Callable[[Run], str]
) -> Best:
    """The best of `others`, cases of one scene, if there is any; and every entry of `theirs` with the number of others
    that are nearer to the reference."""
    wish, entries = usual_wish(scene), []
    for run, one in theirs.items():
        name = run.case.method.name
        entry: Best = {"name": name, "case": run_id(run), "status": str(run.record.status), "others": len(others)}
        if one is not None and one.compared:
            entry |= _row(one, run_id(run), f"{name}, {sides_of(run.case)} mesh, {run.case.body.nodes}")
            missed = [MISSED[name] for name, share in one.shares(wish).items() if share > 1.0]
            entry |= {"meets": not missed, "missed": missed}
            entry["nearer"] = sum(other.worst(wish) < one.worst(wish) for other in others)
        entries.append(entry)
    none = {"scene": scene.name, "target": _target(wish), "meets": False, "body": "", "paper": None, "order": [2.0]}
    return (_best(others, lambda one: case_id(one.case)) or none) | {"entries": entries}


def _target(wish: Wish) -> str:
    return f"{wish_words(wish)}, {SHAPE_WORDS}"


def _best(bodies: Sequence[Judged], id_of: Callable[[Judged], str]) -> Best | None:
    scene = bodies[0].case.scene if bodies else None
    choice = choice_of(scene, bodies) if scene else None
    if scene is None or choice is None:
        return None
    wish, chosen, meets = choice
    paper = paper_body(bodies)
    # Among studies: bodies within the target by their cost, others by how far they miss it.
    order = [0.0, *map(float, by_cost(chosen))] if meets else [1.0, chosen.worst(wish)]
    row = _row(chosen, id_of(chosen)) | {"scene": scene.name, "target": _target(wish), "meets": meets}
    return row | {"order": order, "paper": None if paper is None else _row(paper, id_of(paper))}


def _row(one: Judged, number: str, words: str = "") -> Best:
    numbers = {"force": one.force, "displacement": one.displacement, "shape": one.shape, "volume": one.shape_volume}
    numbers |= {"speed": _inverse(one.cost), "processor_speed": _inverse(one.processor_cost)}
    pairs = {
        name: [number.value, number.uncertainty if number.uncertainty == number.uncertainty else 0.0]
        if number.known
        else None
        for name, number in numbers.items()
    }
    words = words or f"{body_words(one.case.body)}, {one.case.dt_fraction:g}"
    row = {"body": words, "case": number, "meshes": max(1, len(one.members)), "bounds": one.bounds, **pairs}
    row["untested"] = untested(one.case.scene) if one.bounds else ""
    return row | {DISTURBED: bool(one.disturbed), PROCESSOR: one.processor}


def _inverse(cost: Measured) -> Measured:
    return Measured(1 / cost.value, cost.uncertainty / cost.value**2) if cost.known else cost


def joined_best(parts: Sequence[Sequence[Best]], rows: Sequence[Mapping[str, Any]]) -> list[Best]:
    """A row for each scene of all studies: the best body of any, and the paper's body of the first that has it; speeds
    that one study did not measure are those of the table's `rows`."""
    scenes: dict[str, list[Best]] = {}
    for row in (row for part in parts for row in part):
        scenes.setdefault(row["scene"], []).append(row)
    times = {row["case"]: _times(row) for row in rows if row.get(SPEEDS["speed"].format("")) is not None}
    best = []
    for group in scenes.values():
        chosen = min(group, key=lambda row: row["order"])
        paper = next((row["paper"] for row in group if row["paper"]), None)
        entries = [entry for row in group for entry in row.get("entries", ())]
        off = [row.get(OFF_SHAPE) for row in rows if row["scene"] == chosen["scene"]]
        best.append(_timed(chosen, times) | {"paper": _timed(paper, times) if paper else None, "entries": entries})
        best[-1]["reference"] = max(filter(None, off), default=None)
    return best


def _times(row: Mapping[str, Any]) -> Best:
    """What a row of a table says of times."""
    ends = {name: (row.get(column.format("")), row.get(column.format(" floor"))) for name, column in SPEEDS.items()}
    speeds = {name: None if speed is None else [speed, floor or 0.0] for name, (speed, floor) in ends.items()}
    return {**speeds, DISTURBED: bool(row.get(DISTURBED)), PROCESSOR: row.get(PROCESSOR)}


def _timed(row: Best, times: Mapping[str, Best]) -> Best:
    return row | times.get(row["case"], {}) if row["body"] and not row["speed"] else row


def own_first(best: Sequence[Best], own: Collection[str]) -> list[Best]:
    return sorted(best, key=lambda row: row["scene"] not in own)


def answers(best: Sequence[Best], own: Collection[str] = (), shown: str | None = None) -> dict[str, str]:
    """Three questions and their answers, for the scenes in `own` where a body is judged in one of them; nothing where
    none is. First of all what is missing from the shape of a body, and how near an entry is whose case is `shown`."""
    entries = [(row, entry) for row in best for entry in row.get("entries", ()) if entry["case"] == shown]
    theirs = {f"How near is {entry['name']}?": _near(row, entry) for row, entry in entries}
    bodies = [row for row in best if row["body"]]
    best = [row for row in bodies if row["scene"] in own] or bodies
    if not best:
        return theirs
    papers = [row["paper"] for row in best if row["paper"]]
    lost = "; ".join(words for row in best for words in _missing(row))
    return (
        ({"What is missing?": f"{_capital(lost)}."} if lost else {})
        | theirs
        | {
            "Which body?": _which(best),
            "How wrong?": f"{_capital(_errors(best))}{_meshes(best)}.{_beside(_errors(papers))}",
            "How fast?": f"{_capital(_speed(best) or 'no time is measured')}.{_beside(_speed(papers))}",
        }
    )


def _near(row: Best, entry: Best) -> str:
    where = f"In {readable(row['scene'])}"
    if "body" not in entry:
        ended = "the scene compares none of its errors" if entry["status"] == Status.OK else f"it is {entry['status']}"
        return f"{where} {ended}."
    verdict = "meets the target" if entry["meets"] else f"misses the target in {' and '.join(entry['missed'])}"
    rank = f" {entry['nearer']} of {counted(entry['others'], 'other case')} are nearer." if entry["others"] else ""
    return f"{where}: {_errors([entry])}. It {verdict} ({row['target']}).{rank}"


def _missing(row: Best) -> list[str]:
    """What the best body of a row and its reference lack of the shape of the organ, and how many nodes would do; empty
    if they keep the bounds, or if that is not known."""
    (shape, _), (volume, _) = (row.get(name) or (0.0, 0.0) for name in ("shape", "volume"))
    worst, lost = max(shape / SHAPE, abs(volume) / SHAPE_VOLUME), []
    if worst > 1.0:
        off = f"up to {plain(float(f'{shape:.2g}'))} % of the size off its organ, volume {volume:+.2g} %"
        allowed = f"allowed: {SHAPE:g} and {SHAPE_VOLUME:g} %"
        nodes = enough(int(row["body"].rsplit(", ", 2)[1]), worst)
        lost = [f"in {readable(row['scene'])} the best body is {off} ({allowed}); about {nodes:,} nodes would do"]
    off = row.get("reference") or 0.0
    if off > REFERENCE_SHAPE:
        lost.append(
            f"the reference of {readable(row['scene'])} is up to {off:.2g} % of the size off its organ (allowed: "
            f"{REFERENCE_SHAPE:g} %), which ± does not contain; give its plan a larger base"
        )
    return lost


def _which(best: Sequence[Best]) -> str:
    within = [row for row in best if row["meets"]]
    if len(best) == 1:
        row = best[0]
        start = f"In {readable(row['scene'])}: {_body(row['body'])}"
        if within:
            return f"{start}. It is the cheapest body within the target ({row['target']})."
        return f"{start}. No body here meets the target ({row['target']}); this body comes closest."
    bodies = Counter(_body(row["body"]) for row in within).most_common()
    named = "; ".join(f"{body} in {counted(count, 'scene')}" for body, count in bodies)
    start = f"A body meets the target in {len(within)} of {len(best)} scenes"
    nearest_in = [readable(row["scene"]) for row in best if not row["meets"]]
    missed = f" None meets it in {', '.join(nearest_in)}; the table names the nearest." if nearest_in else ""
    return f"{start}{': ' if named else ''}{named}.{missed}"


def _body(words: str) -> str:
    body, nodes, _ = words.rsplit(", ", 2)
    return f"{body}, {nodes} nodes"


def _errors(rows: Sequence[Best]) -> str:
    """Those of scenes with a reference, then those of scenes without (studies.metrics.interval)."""
    groups = ([row for row in rows if bool(row.get("bounds")) == bounds] for bounds in (False, True))
    return "; ".join(filter(None, map(_errors_of, groups)))


def _errors_of(rows: Sequence[Best]) -> str:
    force, displacement, shape = (_span(rows, name) for name in ("force", "displacement", "shape"))
    none = "; ".join(dict.fromkeys(words for row in rows if (words := row.get("untested"))))
    most = f" at most in {OF_100} of 100 such bodies" if any(row.get("bounds") for row in rows) else ""
    most += f" ({none})" if none else ""
    words = {
        f"force off by {force} %{most}": force,
        f"mean displacement error {displacement} %{most}": displacement,
        f"shape off by {shape} % of the organ's size at most": shape,
    }
    return ", ".join(part for part, span in words.items() if span)


def _meshes(rows: Sequence[Best]) -> str:
    """On how many meshes the errors are the largest; parts that are older do not say."""
    most = max(row.get("meshes", 1) for row in rows)
    return f", the largest on {most} neighbouring meshes" if most > 1 else ""


def _speed(rows: Sequence[Best]) -> str:
    speed = _span(rows, "speed")
    names = ", ".join(dict.fromkeys(name for row in rows if (name := row.get(PROCESSOR))))
    disturbed = f" {DISTURBED_MARK}" if any(row.get(DISTURBED) for row in rows) else ""
    core = f"one core{f' of {names}' if names else ''}{disturbed}"
    return f"{speed} s simulated in a second of computing on {core}" if speed else ""


def _beside(words: str) -> str:
    return f" The paper's body ({PAPER} surface nodes, one volume): {words}." if words else ""


def _capital(words: str) -> str:
    return words[:1].upper() + words[1:]


def _span(rows: Sequence[Best], name: str) -> str:
    """The number of one row with its uncertainty, or the range of sizes over several."""
    numbers = sorted((row[name] for row in rows if row[name]), key=lambda number: abs(number[0]))
    if len(numbers) < 2:
        signed = name == "force" and not any(row.get("bounds") for row in rows)
        return "".join(value_cell(*number, signed=signed) for number in numbers)
    low, high = (plain(float(f"{abs(number[0]):.2g}")) for number in (numbers[0], numbers[-1]))
    return low if low == high else f"{low} to {high}"


def scene_rows(best: Sequence[Best]) -> list[dict[str, Any]]:
    """Of each scene the cells of the best body, those of entries, and those of the paper's body, with their marks."""
    return [{"scene": readable(row["scene"]), "rows": _scene_cells(row)} for row in best]


def _scene_cells(row: Best) -> list[dict[str, Any]]:
    best = [_cells(row) | {"mark": "" if row["meets"] else MISSES, "soft": False}] if row["body"] else []
    theirs = [entry for entry in row.get("entries", ()) if "body" in entry]
    entries = [_cells(entry) | {"mark": "" if entry["meets"] else MISSES, "soft": False} for entry in theirs]
    paper = [_cells(row["paper"]) | {"mark": "the paper’s", "soft": True}] if row["paper"] else []
    return [*best, *entries, *paper]


def _cells(row: Best) -> dict[str, Any]:
    # Parts that are older have no volume.
    pairs = {name: number for name in NUMBERS if (number := row.get(name))}
    numbers = [value_cell(*pairs[name], signed=name in SIGNED) if name in pairs else MISSING for name in NUMBERS]
    if row.get("bounds"):
        numbers[:2] = [f"≤ {number.lstrip('+')}" if number != MISSING else MISSING for number in numbers[:2]]
    numbers[NUMBERS.index("speed")] += f" {DISTURBED_MARK}" if row.get(DISTURBED) else ""
    return {"case": row["case"], "body": row["body"], "numbers": numbers}
