"""Findings in words: every number is read off the tables in results/published, and publishing writes them again."""

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from textwrap import fill
from typing import Any

import pandas as pd

from studies.base.errors import StudyError
from studies.catalog.accuracy import ACCURACY
from studies.catalog.population import POPULATION, RANGES
from studies.meshing.bounds import SHAPE
from studies.metrics.cells import MINUS, plain
from studies.metrics.distribution import distribution
from studies.metrics.judged import Measured, over_meshes
from studies.metrics.wish import Wish, usual_wish
from studies.plots.campaigns.recovery import RETURNED
from studies.report.kept_volume import WORST
from studies.report.summary import Choice, choice_of
from studies.runs.recipe_text import body_words
from studies.scene.library import CUT
from studies.store.record import Status
from studies.tools.advise.campaign import published_rows

WIDTH = 120
"""Columns of a page."""
Row = dict[str, Any]
"""Name of a column -> its value."""
FORCE, VOLUME, STEP, SPEED = "force_end [%]", "volume_worst [%]", "step_time [µs]", "real_time [s/s]"
OPENING, MEAN, PIECE = "opening_error [%]", "mean_error [%]", "piece_worst [%]"
DISTANCE = "shape_error [%]"
OURS = "implicit_volume"
LINEAR = ("bullet", "drake", "mujoco", "newton")
"""Engines of the league on linear tetrahedra."""
NODAL, UNIFORM = "tetrahedral, nodal volumes", "quadratic, masses by stiffness"
SECOND_LOOK = 0.25
"""Steps over the stability limit up to here are for a second look, not for the comparison [1]."""
TOGETHER = ("baumgarte", "implicit_springs", "implicit_volume", "penalty", "post_stabilization", "pressure",
            "projection", "pyramid", "shake", "xpbd whole iterations2")  # fmt: skip
"""Methods that keep the volume of the whole body."""
APART = ("element bulk_modulus1e+06 hard", "xpbd")
"""Methods that keep the volume of every tetrahedron."""
LONGEST_STEP = 100.0
"""Of the implicit springs: so long that the answer changes [ms]."""


@dataclass(frozen=True)
class Sentences:
    """A list of findings, and the page that shows it between its marks."""

    page: str
    """Below the folder of README.md."""
    name: str
    """In the marks."""
    studies: tuple[str, ...]
    """Whose tables it reads."""
    text: Callable[[Path], list[str]]
    """Folder of the published tables -> one paragraph per finding."""

    @property
    def marks(self) -> tuple[str, str]:
        """The lines of the page between which the list stands."""
        return f"<!-- {self.name}: begin -->", f"<!-- {self.name}: end -->"

    def written(self, published: Path) -> str:
        """The list in Markdown, at most WIDTH columns wide. Raises StudyError where a table is missing."""
        points = [f"- {text}" for text in self.text(published)]
        if self.page.startswith("docs/"):  # links are written as from README
            points = [point.replace("](results/", "](../results/").replace("](docs/", "](") for point in points]
        return "\n".join(map(_wrapped, points))


def _wrapped(text: str) -> str:
    """A paragraph at most WIDTH columns wide; the lines of a table below it stay as they are."""
    words, *rows = text.split("\n")
    return "\n".join([fill(words, WIDTH, subsequent_indent="  ", break_on_hyphens=False), *rows])


def table(published: Path, study: str, name: str = "") -> list[Row]:
    """The rows of the published table of a study, or of the table `name`. Raises StudyError where it is missing."""
    path = published / study / f"{name or study}.csv"
    if not path.is_file():
        raise StudyError(f"there is no table {path} to read the findings from; `make publish` writes it")
    return [{str(name): value for name, value in row.items()} for row in pd.read_csv(path).to_dict("records")]


def column(rows: Iterable[Row], name: str) -> list[float]:
    """The values of a column without NaN."""
    return [float(row[name]) for row in rows if row[name] == row[name]]


def headline(published: Path) -> list[str]:
    """What README states."""
    return [
        constraint(published),
        one_volume(published),
        recommended(published),
        random_organs(published),
        cuts(published),
        other_programs(published),
    ]


def answers(published: Path) -> list[str]:
    """What docs/findings.md adds: one answer for each study of methods, laws, literature and starts."""
    return [
        ways(published),
        laws(published),
        literature(published),
        other_programs(published),
        starts(published),
    ]


def limits(published: Path) -> list[str]:
    """What docs/limits.md says of accuracy."""
    return [one_volume(published), exceptions(published), shapes(published), inverted(published)]


def constraint(published: Path) -> str:
    """What the constraint keeps, and what it costs."""
    rows = [row for row in table(published, "volume_loss") if row["dt/dt_c"] > SECOND_LOOK]
    lost = {name: max(column((row for row in rows if row["method"] == name), VOLUME)) for name in (OURS, "free")}
    times = {
        (row["scene"], row["body"], row["nodes"], row["method"]): row[STEP] for row in table(published, "frame_rate")
    }
    more = dict[int, list[float]]()
    for (*key, method), time in times.items():
        if method == OURS:
            more.setdefault(key[-1], []).append(100 * (time / times[*key, "free"] - 1))
    longer = " and ".join(f"{_range(shares)} % longer with {nodes:,}" for nodes, shares in sorted(more.items()))
    kept = [row for row in table(published, "", "kept_volume") if row["method"] == OURS]
    return (
        f"**The constraint keeps the volume.** In the study `volume_loss` (one kept volume, "
        f"{max(row['nodes'] for row in rows)} surface nodes) it is never more than {lost[OURS]:.6f} % off; springs "
        f"alone lose up to {lost['free']:.0f} %. In all studies it is at most {100 * max(column(kept, WORST)):.2g} % "
        f"off with steps of at most half the stability limit. With the constraint a step takes {longer} surface nodes "
        f"([frame times](results/published/frame_rate/cost_ratio.png))."
    )


def one_volume(published: Path) -> str:
    """How far one kept volume is from the force."""
    rows = [row for row in table(published, "volume_loss") if row["dt/dt_c"] > SECOND_LOOK and row["method"] == OURS]
    filled, surface = (
        [-force for force in column((row for row in rows if row["body"] == body), FORCE)]
        for body in ("tetrahedral", "surface")
    )
    bodies, errors = {(row["scene"], row["body"]) for row in rows}, dict[tuple[str, str], dict[int, float]]()
    for row in table(published, ACCURACY.name):
        body = row["scene"], row["body"]
        if row["method"] == OURS and body in bodies:
            errors.setdefault(body, {})[row["nodes"]] = abs(row[FORCE])
    few, *_, many = sorted({nodes for by_nodes in errors.values() for nodes in by_nodes})
    grown = sum(by_nodes[many] > by_nodes[few] for by_nodes in errors.values())
    return (
        f"**The volume alone does not make the force right.** If only the total volume of a ball or liver is "
        f"kept, the force of tetrahedral bodies with {many} surface nodes is {_range(filled)} % too small, and that of "
        f"the surface bodies of Jung et al. {_range(surface)} %. More nodes do not cure it: from {few} to {many} the "
        f"error grows in {grown} of {len(errors)} cases ([forces](results/published/volume_loss/force.png))."
    )


def recommended(published: Path) -> str:
    """In how many scenes a body is accurate enough and how sure that is, how fast these are, and where none is."""
    chosen, missed = _chosen(published)
    alone = [f"{scene} ({', '.join(_errors(choice))})" for scene, choice in chosen.items() if len(_errors(choice)) == 1]
    return (
        f"**Bodies of quadratic tetrahedra that keep one volume per vertex are accurate without fitted springs.** In "
        f"{len(chosen)} of {len(chosen) + len(missed)} scenes one of them, uniform or adaptive (finer where strains "
        f"are large), is [accurate enough](docs/accuracy.md#accurate-enough) on each of five neighbouring meshes, at "
        f"{_range(map(_speed, chosen.values()), 1)} times real time on one core. {_close(chosen)} Only one error can "
        f"be compared in {' and '.join(alone) or 'no scene'}. The rest: "
        f"{'; '.join(missed) or 'none'}."
    )


def exceptions(published: Path) -> str:
    """The scenes in which no body is accurate enough."""
    chosen, missed = _chosen(published)
    return (
        f"**In {len(missed)} of {len(chosen) + len(missed)} scenes no body is shown to be [accurate "
        f"enough](docs/accuracy.md#accurate-enough)**: {'; '.join(missed) or 'none'}. {_close(chosen)}"
    )


def shapes(published: Path) -> str:
    """The bodies that do not keep the shape of their organ."""
    everything = table(published, ACCURACY.name)
    rows = [row for row in everything if row["method"] == OURS]
    foreign = [row for row in everything if row["method"] == "implicit_elements"]
    flat = [-change for change in column((row for row in rows if "quadratic" not in row["body"]), "shape_volume [%]")]
    off = {
        f"{row['scene']} with {row['nodes']} nodes ({row['shape_error [%]']:.1f} %)": None
        for row in rows
        if "quadratic" in row["body"] and row["shape_error [%]"] > SHAPE
    }
    return (
        f"**Some bodies differ from the shape of their organ even at rest** and are never recommended. In the study "
        f"`accuracy` our bodies with flat sides lack {_range(flat, 1)} % of the volume. The coarse bodies of "
        f"*implicit_elements*, for comparison, lack up to {-min(column(foreign, 'shape_volume [%]')):.1f} % and are up "
        f"to {max(column(foreign, DISTANCE)):.1f} % of the organ's size from the true surface. These of our quadratic "
        f"bodies are farther than {SHAPE:g} % from it: {', '.join(off) or 'none'}."
    )


def inverted(published: Path) -> str:
    """The runs of the study `accuracy` that did not end well."""
    rows = [row for row in table(published, ACCURACY.name) if row["status"] != Status.OK]
    bodies = "; ".join(f"{row['scene']}, {row['body']}, {row['nodes']} nodes ({row['status']})" for row in rows)
    return f"**Some runs of the study `accuracy` fail**: {bodies or 'none'}."


def random_organs(published: Path) -> str:
    """How far off the finest body is on 95 of 100 organs of a population, as a table."""
    populations, (*_, coarser, nodes) = _populations(published), _sizes(published)
    finest = {organ: members[nodes] for organ, members in populations.items()}
    everyone = [row for rows in finest.values() for row in rows]
    bars = [max(column(everyone, _floor(name))) for name in (FORCE, MEAN)]
    missed = {organ: _missed(organ, members[coarser]) for organ, members in populations.items()}
    fewer = " and ".join(f"{count} {organ}s" for organ, count in missed.items() if count)
    rows = "\n".join(_organ_row(organ, rows) for organ, rows in finest.items())
    return (
        f"**Random organs**: lengths, wall, load and, in solid organs, stiffness are random. The table gives the 95th "
        f"percentile of the error of adaptive bodies with {nodes:,} surface nodes, on one mesh each (references within "
        f"{bars[0]:.1f} and {bars[1]:.1f} %; without a probe there is no force). In brackets: the upper end of its "
        f"resampled 95 % interval, which is too low for so few members. With {coarser:,} nodes {fewer or 'none'} miss "
        f"a target or fail. A simulated second of one member of each organ takes "
        f"{_range((1.0 / speed for speed in column(everyone, SPEED)), 1)} s on one core ([random "
        f"organs](docs/population.md)).\n\n"
        f"| organ | force [%] | mean displacement [%] | targets [%] | miss or fail | reference cannot decide |\n"
        f"|---|---|---|---|---|---|\n{rows}\n"
    )


def _organ_row(organ: str, rows: Sequence[Row]) -> str:
    """The line of an organ in the table of random organs."""
    wish, force = _wish(organ), _bound(rows, FORCE, ".1f")
    targets = f"{wish.force:g}, {wish.displacement:g}" if force else f"–, {wish.displacement:g}"
    unsure = sum(_is_undecided(organ, row) for row in rows)
    return (
        f"| {organ} | {force or '–'} | {_bound(rows, MEAN, '.2g')} | {targets} | {_missed(organ, rows)} of {len(rows)} "
        f"| {unsure} |"
    )


def _missed(organ: str, rows: Iterable[Row]) -> int:
    """How many members miss a target or fail."""
    return sum(_misses(organ, row) for row in rows)


def other_organs(published: Path) -> list[str]:
    """How many members of a population miss their target with each size of the adaptive body."""
    populations, lines = _populations(published), []
    for nodes in _sizes(published):
        missed = [
            f"{_missed(organ, members[nodes])} of {len(members[nodes])} {organ}s"
            for organ, members in populations.items()
        ]
        lines.append(f"with {nodes:,} nodes {', '.join(missed)}")
    return [
        f"**On other organs an error can be larger.** Of random organs these miss a target (force 3 %, mean "
        f"displacement 1 %; stomach and bladder 6 and 3 %; shape {SHAPE:g} % of the size) or fail: {'; '.join(lines)} "
        f"([random organs](docs/population.md))."
    ]


def _sizes(published: Path) -> list[int]:
    """Surface nodes of the adaptive bodies of the population, small to large."""
    rows = table(published, POPULATION)
    return sorted({int(row["nodes"]) for row in rows if row["body"].startswith("adaptive")})


def _populations(published: Path) -> dict[str, dict[int, list[Row]]]:
    """Organ -> surface nodes -> the rows of the members with an adaptive body."""
    populations: dict[str, dict[int, list[Row]]] = {}
    for row in table(published, POPULATION):
        if row["body"].startswith("adaptive"):
            organ = row["scene"].split("_")[0]
            populations.setdefault(organ, {}).setdefault(int(row["nodes"]), []).append(row)
    return populations


def _bound(rows: Sequence[Row], name: str, digits: str) -> str:
    """ "1.8 (2.3)": the 95th percentile of an absolute error of members, and the upper end of its interval; empty where
    none is known."""
    errors = distribution({str(row["scene"]): float(row[name]) for row in rows}, {})
    return f"{errors.bound:{digits}} ({errors.bound_interval[1]:{digits}})" if errors.count else ""


def _misses(organ: str, row: Row) -> bool:
    """Whether the run of a member failed, or one of its errors or its shape is beyond its target or not known."""
    failed = row["status"] != Status.OK or row[MEAN] != row[MEAN]
    return failed or row[DISTANCE] > SHAPE or _is_beyond(organ, row, 0)


def _is_undecided(organ: str, row: Row) -> bool:
    """Whether the uncertainty of the reference leaves open if a member misses its target."""
    return _is_beyond(organ, row, 1) and not _is_beyond(organ, row, -1)


def _is_beyond(organ: str, row: Row, sign: int) -> bool:
    """Whether an error of a member, plus `sign` times the uncertainty of its reference, is beyond its target."""
    wish = _wish(organ)
    bounds = {FORCE: wish.force, MEAN: wish.displacement}
    return any(abs(row[name]) + sign * row[_floor(name)] > bound for name, bound in bounds.items())


@cache
def _wish(organ: str) -> Wish:
    """The usual target of an organ of the population; it depends on its shape, which takes milliseconds to make."""
    return usual_wish(RANGES[organ].scene)


def _floor(name: str) -> str:
    """The column with the uncertainties of another one."""
    return name.replace(" [", " floor [")


def real_time(published: Path) -> list[str]:
    """In which scenes the recommended body is as fast as real time."""
    chosen, _ = _chosen(published)
    speeds = {name: _speed(choice) for name, choice in chosen.items()}
    slow = [f"{name} reaches {speed:.1f} times real time" for name, speed in speeds.items() if speed < 1.0]
    return [
        f"**Real time holds for one organ on one core**, without drawing, in {len(speeds) - len(slow)} of the "
        f"{len(speeds)} scenes with a recommended body; {'; '.join(slow) or 'none is slower'} "
        f"([speeds](docs/findings.md#recommended-bodies))."
    ]


def _chosen(published: Path) -> tuple[dict[str, Choice], list[str]]:
    """The recommended body of each scene that has one; the scenes without an accurate one, with why."""
    chosen, missed = dict[str, Choice](), list[str]()
    for scene in ACCURACY.scenes:
        choice = choice_of(scene, over_meshes(one for one in published_rows(published, scene) if one.compared))
        if choice is not None and choice.meets:
            chosen[scene.name] = choice
        elif choice is not None:
            nearest = f"in {scene.name} the nearest body ({body_words(choice.body.case.body)} nodes)"
            missed.append(f"{nearest} {_why_not(choice)}{_adaptive(published, scene.name)}")
    return chosen, missed


def _speed(choice: Choice) -> float:
    """Of the chosen body [s/s]."""
    return 1.0 / choice.body.cost.value


def _errors(choice: Choice) -> dict[str, tuple[Measured, float]]:
    """Name of an error of the chosen body that is known and bounded -> the error, and its target [%]."""
    body, wish = choice.body, choice.wish
    pairs = {"force": (body.force, wish.force), "displacement": (body.displacement, wish.displacement)}
    return {name: (error, bound) for name, (error, bound) in pairs.items() if bound and error.known}


def _close(chosen: dict[str, Choice]) -> str:
    """In which scenes the uncertainty of the reference reaches beyond the target."""
    scenes = [
        f"{scene} ({name} {abs(error.value):.2f} ± {error.uncertainty:.2f} %, target {bound:g} %)"
        for scene, choice in chosen.items()
        for name, (error, bound) in _errors(choice).items()
        if abs(error.value) + error.uncertainty > bound
    ]
    where = " and ".join(scenes) or "no scene"
    return f"In {where} the uncertainty of the reference reaches beyond the target."


def _adaptive(published: Path, scene: str) -> str:
    """How far off the adaptive bodies of a scene are that end well; nothing where there are none."""
    rows = (row for row in table(published, ACCURACY.name) if row["scene"] == scene)
    adaptive = [row for row in rows if row["body"].startswith("adaptive")]
    sound = [row for row in adaptive if row["status"] == Status.OK]
    if not sound:
        return ""
    off, bar = column(sound, MEAN), max(column(sound, _floor(MEAN)))
    return f" ({len(sound)} of {len(adaptive)} adaptive bodies end well and are {_range(off, 1)} ± {bar:.1f} % off)"


def _why_not(choice: Choice) -> str:
    """Which error misses its target, or which cannot be decided."""
    errors = _errors(choice)
    for name, (error, bound) in errors.items():
        if error.uncertainty > bound and abs(error.value) - error.uncertainty <= bound:
            return f"is undecided, because its reference is only known to ±{error.uncertainty:.2g} % in {name}"
    missed = [
        f"misses the target of {bound:g} % for {name} with {abs(error.value):.3g} %"
        for name, (error, bound) in errors.items()
        if abs(error.value) > bound
    ]
    return " and ".join(missed) or "does not keep the shape of the organ at rest"


def cuts(published: Path) -> str:
    """How far the finest adaptive body at real time is from the reference where a cut gapes, and where its faces
    touch."""
    adaptive = [row for row in table(published, "cutting") if row["body"].startswith("adaptive")]
    fast = [row for row in adaptive if row[SPEED] >= 1.0]
    finest = {row["scene"]: row for row in sorted(fast, key=lambda row: row["nodes"])}
    touching = {scene.name for scene in CUT if any(cut.contact for cut in scene.cuts)}
    gaping, closed = ([row for name, row in finest.items() if (name in touching) == way] for way in (False, True))
    off = {name: [abs(value) for value in column(gaping, name)] for name in (OPENING, FORCE)}
    distant = {name: row[DISTANCE] for name, row in finest.items() if row[DISTANCE] > SHAPE}
    shape = (
        f" The bodies of {' and '.join(distant)} are up to {max(distant.values()):.1f} % of the size off the true "
        f"surface (allowed: {SHAPE:g} %)."
        if distant
        else ""
    )
    floors = {name: max(column(finest.values(), _floor(name))) for name in (OPENING, FORCE)}
    return (
        f"**Organs can be cut.** In {len(gaping)} scenes, with adaptive bodies in real time, "
        f"the width of the cut is at most {max(off[OPENING]):.1f} % off and the force {max(off[FORCE]):.1f} % "
        f"(references within {floors[OPENING]:.1f} and {floors[FORCE]:.1f} %); where cuts are pressed shut, the "
        f"sliding of their faces is {_range(column(closed, OPENING), 1)} % off. Displacements are within "
        f"{max(column(finest.values(), MEAN)):.1f} %, volumes of pieces within {max(column(adaptive, PIECE)):.1g} % "
        f"([cut an organ](docs/cutting.md)).{shape}"
    )


def other_programs(published: Path) -> str:
    """What other programs and our quadratic body reach on the scenes of the league, on meshes of one size."""
    rows = [row for row in table(published, "league") if row["status"] == Status.OK]
    (nodes,) = {row["nodes"] for row in rows}

    def off(*engines: str) -> str:
        """The ranges of their errors in force and mean displacement."""
        subset = [row for row in rows if row["engine"] in engines]
        force, displacement = ([abs(value) for value in column(subset, name)] for name in (FORCE, MEAN))
        return f"{_range(force, 1)} and {_range(displacement, 1)} %"

    swept = table(published, "league", "sweep")
    defaults = [abs(row[FORCE]) for row in swept if row["settings"] == "{}" and row["engine"] in LINEAR]
    searched = " and ".join(dict.fromkeys(row["scene"] for row in swept))
    bar = max(column(rows, _floor(FORCE)))
    scenes = {row["scene"] for row in rows}
    near = [row for row in table(published, ACCURACY.name) if row["scene"] in scenes and row["body"] == UNIFORM]
    largest = [max(abs(value) for value in column(near, name)) for name in (FORCE, MEAN)]
    return (
        f"**Other programs on the same coarse meshes** ({len(scenes)} scenes, {nodes} "
        f"vertices, references within {bar:.1f} %, [league](docs/league.md)): errors in force and in mean displacement "
        f"are {off('felupe')} for FElupe's quadratic elements, {off('sfepy')} for SfePy's mixed ones, "
        f"{off('ours-quadratic')} for our uniform quadratic body (on five neighbouring meshes up to {largest[0]:.1f} "
        f"and {largest[1]:.1f} %), {off('ours-corotated', 'ours-xpbd')} for our linear elements (corotated, XPBD), "
        f"{off(*LINEAR)} for linear tetrahedra of PyBullet, Drake, MuJoCo and Newton. Settings of the others were "
        f"searched on {searched}; with default settings their linear tetrahedra are {_range(defaults)} % off in force "
        f"there."
    )


def ways(published: Path) -> str:
    """How alike the methods are that keep one volume, and how stiff one volume per tetrahedron is."""
    rows = [
        row for row in table(published, "methods") if row["body"] == "tetrahedral" and row["dt [ms]"] < LONGEST_STEP
    ]
    together = [row for row in rows if row["method"] in TOGETHER]
    apart = column((row for row in rows if row["method"] in APART), FORCE)
    forces = [column((row for row in together if row["scene"] == name), FORCE) for name in {r["scene"] for r in rows}]
    spread = max(max(force) - min(force) for force in forces)
    count = len({row["method"] for row in together})
    step, volume = column(together, STEP), column(together, VOLUME)
    return (
        f"**Which way to keep a volume** (`make study-methods`, [chart](results/published/methods/methods.png)): "
        f"all {count} methods that keep *one* volume give the same force within {spread:.1f} %. They "
        f"differ in cost, {plain(min(step))} to {plain(max(step))} µs a step, and in the volume error, "
        f"{min(volume):.0e} to {max(volume):.1f} %. One volume per tetrahedron locks: the force is "
        f"{_range(apart)} % too large."
    )


def laws(published: Path) -> str:
    """What stiffness laws and nodal volumes are worth."""
    rows = table(published, "laws")
    single = [row for row in rows if row["body"] == "tetrahedral"]
    short, count = [-force for force in column(single, FORCE)], len({row["law"] for row in single})
    nodal = max(
        (row for row in rows if (row["body"], row["law"]) == (NODAL, "cotangent")), key=lambda row: row["nodes"]
    )
    return (
        f"**Which stiffness law, how many volumes** (`make study-laws`, [chart](results/published/laws/laws.png)): "
        f"with one volume the force of the squeezed ball at full load is {_range(short)} % too small under each of the "
        f"{count} laws that allow one volume. One volume per node with cotangent springs brings the error along the "
        f"path to {nodal['force_error [%]']:.1f} % at {nodal['nodes']} surface nodes, but makes the clamped ball and "
        f"the "
        f"liver [too stiff](docs/paper.md#from-the-papers-one-volume-to-the-continuum)."
    )


def literature(published: Path) -> str:
    """How fast and how far off the methods are that keep no volume by a constraint."""
    rows = table(published, "literature")
    (held,) = (row for row in rows if (row["method"], row["scene"]) == ("elastic_response", "ball_clamped"))
    linear = [row for row in rows if row["method"] in ("elastic_response", "linear_modes")]
    turning = column((row for row in linear if row["scene"] != "ball_clamped"), FORCE)
    return (
        f"**What else the literature offers** (`make study-literature`, "
        f"[chart](results/published/literature/literature.png)): angular springs, chain mail, linear modes and a "
        f"precomputed elastic response. Where the organ hardly turns, the precomputed response is the best value: on "
        f"ball_clamped its force is {held['force_end [%]']:.0f} % off at {held['real_time [s/s]']:.0f} times real "
        f"time. Where the organ turns, both linear methods miss the force by {_range(turning)} %."
    )


def starts(published: Path) -> str:
    """From which distorted starts a ball recovers its rest shape."""
    rows = table(published, "stress")
    scenes = {row["scene"]: row["scene"].removeprefix("stress_") for row in rows}

    def lost(body: str, chosen: Callable[[str], bool]) -> list[str]:
        """Starts from which a body does not come back by these methods, under one law or another."""
        return sorted(
            {
                scenes[row["scene"]]
                for row in rows
                if row["body"] == body and chosen(row["method"]) and not row["rest_distance [%]"] < RETURNED
            }
        )

    one, none = lost("tetrahedral", OURS.__eq__), lost("tetrahedral", "free".__eq__)
    nodal, helped = lost(NODAL, OURS.__eq__), lost(NODAL, lambda method: "recovers" in method)
    count = len(scenes)
    return (
        f"**From which distorted starts a ball recovers** (`make study-stress`, "
        f"[chart](results/published/stress/recovery.png)): with one volume from {count - len(one)} of {count} (not "
        f"from the start *{', '.join(one)}*), with springs alone from {count - len(none)}, with nodal volumes from "
        f"{count - len(nodal)}, and from {count - len(helped)} with `ImplicitVolume(recovers=True)` "
        f"([theory](docs/theory.md#8-several-volumes))."
    )


def _range(values: Iterable[float], digits: int = 0) -> str:
    """Smallest and largest value in words."""
    numbers = list(values)
    return f"{min(numbers):.{digits}f} to {max(numbers):.{digits}f}".replace("-", MINUS)


LEAGUE = ("league", "league/sweep.csv")
"""What other programs are judged by."""
SENTENCES = (
    Sentences(
        "README.md",
        "findings",
        ("volume_loss", "frame_rate", "accuracy", POPULATION, "cutting", *LEAGUE),
        headline,
    ),
    Sentences(
        "docs/findings.md",
        "answers",
        ("methods", "laws", "literature", ACCURACY.name, *LEAGUE, "stress"),
        answers,
    ),
    Sentences("docs/limits.md", "limits", ("volume_loss", "accuracy"), limits),
    Sentences("docs/limits.md", "speed", ("accuracy",), real_time),
    Sentences("docs/limits.md", "random organs", (POPULATION,), other_organs),
)
