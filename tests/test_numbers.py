"""Numbers that pages quote are those of the published tables.

A row: a page or several, words of it in which each # is a number and each @ a name, and what these are by the tables.
"""

import json
import re
from collections.abc import Iterable
from functools import cache
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from massspring import METHODS
from studies.catalog.accuracy import ACCURACY
from studies.geometry.organs import make_shape
from studies.geometry.surface.first_surface import true_volume
from studies.metrics.distribution import BOUND
from studies.metrics.judged import over_meshes
from studies.report.summary import Choice, choice_of
from studies.runs.status import folding
from studies.scene.library import BALL_SQUEEZE, LIVER_PRESS
from studies.scene.library.ball_squeeze import RADIUS
from studies.store.schema import Status
from studies.tools.advise.campaign import published_rows

ROOT = Path(__file__).parent.parent
TABLES = ROOT / "results/published"
FORCE, MEAN, VOLUME, DISTANCE = "force_end [%]", "mean_error [%]", "volume_worst [%]", "shape_error [%]"
OPENING, PIECE, SPEED, STEP = "opening_error [%]", "piece_worst [%]", "real_time [s/s]", "step_time [µs]"
LEAST = "min_j [1]"
OURS, NODAL = "implicit_volume", "tetrahedral, nodal volumes"
UNIFORM, ADAPTIVE = "quadratic, masses by stiffness", "adaptive quadratic, masses by stiffness"
MIXED = [(UNIFORM, 594), ("quadratic, mixed volumes, masses by stiffness", 594),
         ("quadratic, mixed volumes, masses by stiffness", 994), (ADAPTIVE, 994),
         ("adaptive quadratic, mixed volumes, masses by stiffness", 994)]  # fmt: skip
TOGETHER = ["baumgarte", "implicit_springs", "implicit_volume", "penalty", "post_stabilization", "pressure",
            "projection", "pyramid", "shake", "xpbd whole iterations2"]  # fmt: skip
"""Methods that keep the volume of the whole body."""
APART = ["element bulk_modulus1e+06 hard", "xpbd"]
"""Methods that keep the volume of every tetrahedron."""
LINEAR = ["bullet", "drake", "mujoco", "newton"]
TARGETS = {"stomach": (6.0, 3.0), "bladder": (6.0, 3.0)}
"""Of hollow organs, force and mean displacement [%]; of others 3 and 1."""
NU = {"mujoco": " (Poisson's ratio 0.45)"}
COPIED = {
    "docs/findings.md": ("summary.md", "accuracy/recommended.md"),
}
"""Page -> tables that it shows as they are published."""


@cache
def rows(study: str, name: str = "") -> pd.DataFrame:
    return pd.read_csv(TABLES / study / f"{name or study}.csv")


@cache
def page(name: str) -> str:
    """Its text on one line; links as README writes them."""
    text = " ".join((ROOT / name).read_text(encoding="utf-8").split())
    return text.replace("](../results/", "](results/") if name != "README.md" else text.replace("](docs/", "](")


def span(values: pd.Series) -> tuple[float, float]:
    """Smallest and largest size."""
    return values.abs().min(), values.abs().max()


def floor(column: str) -> str:
    return column.replace(" [", " floor [")


def tabled(name: str) -> list[str]:
    return [f"{name} at {c} %" for c in (30, 40, 50)]


def pressed(*bodies: str) -> float:
    """Largest error of their forces from 4 to 40 % compression [%]."""
    table = rows("silicone", "press_curves").query("0.039 < compression < 0.401")
    return max(100.0 * (table[f"body, {name}"] / table["reference"] - 1.0).abs().max() for name in bodies)


def of(table: pd.DataFrame, **settings: object) -> pd.DataFrame:
    """The rows with these settings; a list allows several."""
    for name, value in settings.items():
        table = table[table[name].isin(value if isinstance(value, list) else [value])]
    return table


def compared() -> pd.DataFrame:
    """The study volume_loss but for the steps of a second look."""
    table = rows("volume_loss")
    return table[table["dt/dt_c"] > 0.25]


def constraint_costs() -> Iterable[float]:
    """By how much a step is longer with the constraint [%]: least and most, and the nodes, small bodies first."""
    times = rows("frame_rate").pivot(index=["scene", "body", "nodes"], columns="method", values=STEP)
    more = 100 * (times[OURS] / times["free"] - 1)
    for nodes, shares in more.groupby("nodes"):
        yield from (*span(shares), nodes)


def one_volume() -> list[float]:
    table = of(compared(), method=OURS)
    short = [end for body in ("tetrahedral", "surface") for end in span(of(table, body=body)[FORCE])]
    bodies = of(rows("accuracy"), method=OURS).merge(table[["scene", "body"]].drop_duplicates())
    errors = bodies.pivot(index=["scene", "body"], columns="nodes", values=FORCE).abs()
    few, *_, many = errors.columns
    return [many, *short, few, many, (errors[many] > errors[few]).sum(), len(errors)]


@cache
def choices() -> dict[str, Choice]:
    """Scene -> the body that is recommended there."""
    return {
        scene.name: choice
        for scene in ACCURACY.scenes
        if (choice := choice_of(scene, over_meshes(one for one in published_rows(TABLES, scene) if one.compared)))
    }


def met() -> dict[str, float]:
    """Scene -> how much faster than real time the recommended body is, where one is accurate enough."""
    return {scene: 1 / choice.body.cost.value for scene, choice in choices().items() if choice.meets}


def errors_of(scene: str) -> dict[str, tuple[float, float, float]]:
    """Name of an error of the chosen body -> its size, its uncertainty, its target [%]."""
    wish, body = choices()[scene].wish, choices()[scene].body
    pairs = {"force": (body.force, wish.force), "displacement": (body.displacement, wish.displacement)}
    return {name: (abs(one.value), one.uncertainty, most) for name, (one, most) in pairs.items() if most and one.known}


def reach_beyond() -> list[float | str]:
    """Of each scene whose reference reaches beyond a target: its name, the error, and three numbers."""
    errors = [(scene, name, *numbers) for scene in met() for name, numbers in errors_of(scene).items()]
    return [part for one in errors if one[2] + one[3] > one[4] for part in one]


def open_scene() -> list[float | str]:
    """The scene without an accurate body, how many of its adaptive ones end well and how far off they are."""
    (scene,) = (scene for scene, choice in choices().items() if not choice.meets)
    ((size, bar, most),) = errors_of(scene).values()
    assert size - bar < most, "the reference does not decide"
    adaptive = of(quadratic(), scene=scene)
    adaptive = adaptive[adaptive["body"].str.startswith("adaptive")]
    well = of(adaptive, status="ok")
    assert set(adaptive["status"]) == {"ok", "folded"}
    return [scene, len(well), len(adaptive), *span(well[MEAN]), well[floor(MEAN)].max(), most]


def quadratic() -> pd.DataFrame:
    """The study of accuracy, where heavy masses are named as those by stiffness."""
    table = rows("accuracy")
    return table.assign(body=table["body"].str.replace("heavy masses", "masses by stiffness"))


def member_errors(organ: str, nodes: int) -> tuple[pd.DataFrame, tuple[float, float], pd.Series]:
    """Errors of force and displacement of the members that two meshes ran on, the targets, and who misses one."""
    some, targets = of(rows("population", "pairs"), organ=organ), TARGETS.get(organ, (3.0, 1.0))
    errors = some[[f"force_{nodes}", f"displacement_{nodes}"]]
    return errors, targets, (errors > list(targets)).any(axis=1)


def finest(organ: str) -> list[float]:
    """A line of the table of random organs: members judged, median, bound and worst of each error, targets, misses."""
    errors, targets, missed = member_errors(organ, 1594)
    known = errors.loc[:, errors.notna().any()]
    sizes = [(values.median(), values.quantile(BOUND), values.max()) for _, values in known.items()]
    return [*known.count(), len(errors), *np.ravel(sizes), *targets[-len(sizes) :], missed.sum()]


def misses(nodes: int, *organs: str) -> list[int]:
    return [int(member_errors(organ, nodes)[2].sum()) for organ in organs]


def timed_member(organ: str) -> float:
    """Computing over simulated time of the finest body."""
    some = of(rows("population"), nodes=1594)
    return 1 / some[some["scene"].str.startswith(organ)][SPEED].dropna().item()


def engines(*names: str) -> list[float]:
    some = of(rows("league"), status="ok", engine=list(names))
    return [*span(some[FORCE]), *span(some[MEAN])]


def ways() -> list[float]:
    table = rows("methods")
    table = table[(table["body"] == "tetrahedral") & (table["dt [ms]"] < 100)]
    together, apart = of(table, method=TOGETHER), of(table, method=APART)
    assert len(set(together["method"])) == len(TOGETHER) and (apart[FORCE] > 0).all()
    spread = together.groupby("scene")[FORCE].agg(np.ptp).max()
    return [len(TOGETHER), spread, *span(together[STEP]), *span(together[VOLUME]), *span(apart[FORCE])]


def laws() -> list[float]:
    drawn = of(rows("laws"), body="tetrahedral")
    single = of(drawn, status="ok")
    lost = len(drawn) - len(single), len(drawn)
    nodal = of(rows("laws"), body=NODAL, law="cotangent").sort_values("nodes")
    assert nodal["force_error [%]"].is_monotonic_decreasing, "refinement helps"
    last = nodal.iloc[-1]
    return [*span(single[FORCE]), single["law"].nunique(), *lost, last["force_error [%]"], last["nodes"]]


def literature() -> list[float]:
    linear = of(rows("literature"), method=["elastic_response", "linear_modes"])
    held = of(linear, scene="ball_clamped", method="elastic_response").iloc[0]
    return [held[FORCE], held[SPEED], *span(linear[linear["scene"] != "ball_clamped"][FORCE])]


def recovered(body: str, **methods: object) -> float:
    """From how many starts a ball comes back."""
    some = of(rows("stress"), body=body, **methods)
    return rows("stress")["scene"].nunique() - some[~(some["rest_distance [%]"] < 1.0)]["scene"].nunique()


def accuracy(scene: str, body: str, nodes: int, column: str) -> float:
    return of(rows("accuracy"), scene=scene, body=body, nodes=nodes)[column].item()


def stomachs(column: str, body: str, *scenes: str) -> pd.Series:
    return of(rows("accuracy"), scene=list(scenes), body=body)[column]


def five(scene: str, body: str, nodes: int) -> pd.DataFrame:
    """The rows of a recipe on its five neighbouring meshes."""
    near = of(quadratic(), scene=scene, body=body)
    near = near[(near["nodes"] / nodes - 1).abs() < 0.07]
    assert len(near) == 5
    return near


def near_liver(body: str, nodes: int, column: str) -> list[float]:
    """Of five bodies on neighbouring meshes on liver_probe the least and the largest, a force with its sign."""
    near = five("liver_probe", body, nodes)[column]
    return [near.min(), near.max()]


def worst_of(scene: str, body: str, nodes: int, *columns: str) -> list[float]:
    """The largest of five meshes, each with its sign, and how often faster than real time the timed one is."""
    near = five(scene, body, nodes)
    assert (near["status"] == "ok").all()
    return [*(near.loc[near[column].abs().idxmax(), column] for column in columns), near[SPEED].dropna().item()]


def counts(study: str, row: str, *columns: str) -> list[int]:
    table = rows(study, "counts").set_index(rows(study, "counts").columns[0])
    assert "unexplained" not in table
    return [int(table.loc[row, column]) for column in columns]


def sound(method: str) -> float:
    everything, well, refused = counts("breaking", method, "all", "ok", "refused")
    return 100 * well / (everything - refused)


def cutting(body: str, nodes: int, scene: str, *columns: str) -> list[float]:
    row = of(rows("cutting"), scene=scene, body=body, nodes=nodes)
    return [row[column].item() for column in columns]


MEMBERS = "liver", "kidney", "stomach", "spleen", "bladder"
WIDTHS = "median interval [± %]", "90 of 100 errors are within [%]"


def intervals(error: str, *columns: str, organ: str = "all") -> list[float]:
    """Numbers of a row of the table of intervals on organs left out."""
    lines = (TABLES / "population" / "intervals.md").read_text(encoding="utf-8").splitlines()
    heads, *cells = ([cell.strip() for cell in line.strip("|").split("|")] for line in lines if "---" not in line)
    (row,) = (dict(zip(heads, each, strict=True)) for each in cells if each[:2] == [error, organ])
    return [float(row[column]) for column in columns]


README, FINDINGS, LIMITS, PAPER = "README.md", "docs/findings.md", "docs/limits.md", "docs/paper.md"
SILICONE = "docs/silicone.md"
PEOPLE, BREAKING, CUTTING = "docs/population.md", "docs/breaking.md", "docs/cutting.md"
OPENED = (("ball_incised", 794), ("ball_incised", 994), ("liver_incised", 994), ("shell_opened", 994),
          ("stomach_opened", 1194))  # fmt: skip


VIRTUAL = [("tetrahedral", 350), (NODAL, 350), ("tetrahedral", 700)]


def halved_steps() -> tuple[float, float]:
    """Most by which half the step changes a force of the sweep, of all programs but Drake and of Drake."""
    forces = rows("league", "sweep").set_index(["engine", "settings", "scene"])[FORCE]
    changes = dict[str, list[float]]()
    for (engine, settings, scene), force in forces.items():
        chosen = json.loads(settings)
        if chosen.pop("step", None):
            changes.setdefault(engine, []).append(abs(force - forces[engine, json.dumps(chosen), scene]))
    drake = max(changes.pop("drake"))
    return max(map(max, changes.values())), drake


def opened(head: str, cell: str, *columns: str) -> tuple:
    """A line of the table of adaptive bodies that gape."""
    return (CUTTING, f"| {head} | {' | '.join([cell] * len(OPENED))} |", lambda: [
        number for scene, nodes in OPENED for number in cutting(ADAPTIVE, nodes, scene, *columns)
    ])  # fmt: skip


ROWS = [
    (README, "with one multiplier it is at most # % off; springs alone lose up to # %", lambda: (
        of(compared(), method=OURS)[VOLUME].max(), of(compared(), method="free")[VOLUME].max())),
    (FINDINGS, "keeps the volume: at most # % are lost, by springs alone up to # %.", lambda: (
        of(compared(), method=OURS)[VOLUME].max(), of(compared(), method="free")[VOLUME].max())),
    (README, "with 550 surface nodes, it is # to # % too small",
        lambda: span(of(compared(), method=OURS, body=["tetrahedral", "surface"])[FORCE])),
    (FINDINGS, "tetrahedral bodies is # to # % too small, that of surface bodies # to # %; from # to # nodes the error "
        "grows in # of # cases", lambda: one_volume()[1:]),
    (FINDINGS, "a step takes # to # % longer with # and # to # % longer with # surface nodes", constraint_costs),
    (FINDINGS, "In @ (@ # ± # %, target # %) the uncertainty reaches beyond the target.", reach_beyond),
    (FINDINGS, "@ is not decided: # of # adaptive bodies end well and are # to # ± # % off (target # %)", open_scene),
    (FINDINGS, "The slowest recommended body runs at # times real time", lambda: [min(met().values())]),
    (README, "of random livers that the reference can judge, 95 of 100 are within # % in force and # % in displacement",
        lambda: finest("liver")[4:8:3]),
    *((PEOPLE, f"| {organ} | #, # of # | #, #, # | #, #, # | #, # | # |", lambda organ=organ: finest(organ))
      for organ in ("liver", "kidney", "stomach")),
    *((PEOPLE, f"| {organ} | –, # of # | – | #, #, # | –, # | # |", lambda organ=organ: finest(organ))
      for organ in ("spleen", "bladder")),
    (PEOPLE, "The forces of kidney_0_005 differ by # %, and are # and # % off.", lambda: (
        of(rows("population", "pairs"), scene="kidney_0_005")[["force", "force_1194", "force_1594"]].iloc[0])),
    (PEOPLE, "and # random scenes", lambda: [len(rows("population", "scenes"))]),
    (PEOPLE, "These have # of the 310 members", lambda: [rows("population")["scene"].nunique()]),
    (PEOPLE, "**With 1,194 nodes** # livers and # spleens miss a target", lambda: misses(1194, "liver", "spleen")),
    (PEOPLE, "takes # s for the first liver, # s for a kidney, # s for a stomach, # s for a spleen and # s for a "
        "bladder", lambda: [timed_member(organ) for organ in MEMBERS]),
    (LIMITS, "a simulated second of one takes # s with 1,594 nodes", lambda: [timed_member("bladder")]),
    (PEOPLE, "# % of # forces are inside (livers #, kidneys #, stomachs # %), with a median of ± # % where 90 of 100 "
        "errors are within # %", lambda: (*intervals("force", "inside [%]", "members"),
        *(intervals("force", "inside [%]", organ=organ)[0] for organ in ("liver", "kidney", "stomach")),
        *intervals("force", *WIDTHS))),
    (PEOPLE, "# % of # displacements (livers #, kidneys #, stomachs #, spleens #, bladders # %), with ± # % for # %",
        lambda: (*intervals("displacement", "inside [%]", "members"),
                 *(intervals("displacement", "inside [%]", organ=organ)[0] for organ in MEMBERS),
                 *intervals("displacement", *WIDTHS))),
    (FINDINGS, "quadratic and mixed elements are within # % in force, linear ones # to # % off, in every program",
        lambda: (10 * np.ceil(engines("felupe", "sfepy", "ours-quadratic")[1] / 10),
                 *engines("ours-corotated", "ours-xpbd", *LINEAR)[:2])),
    (FINDINGS, "Ball of # cm radius and liver of # L, shear modulus # kPa, # surface nodes", lambda: (
        100 * RADIUS, 1e3 * true_volume(make_shape("liver", {})), BALL_SQUEEZE.tissue.shear_modulus / 1e3,
        *rows("volume_loss")["nodes"].unique())),
    (FINDINGS, "all # methods that keep *one* volume give the same force within # % of the reference. They differ in "
        "cost, # to # µs a "
        "step, and in the volume error, # to # %. One volume per tetrahedron locks: the force is # to # % too large.",
        ways),
    (FINDINGS, "at full load is # to # % too small under each of the # laws that allow one volume (# of # runs are "
        "*inverted* and not counted). One volume per node with cotangent springs brings the error along the path to # "
        "% at # surface nodes", laws),
    (FINDINGS, "on ball_clamped its force is # % off at # times real time. Where the organ turns, both linear methods "
        "miss the force by # to # %.", literature),
    (FINDINGS, "with one volume from # of # (not from the start *@*), with springs alone from #, with nodal volumes "
        "from #, and from # with", lambda: (
            recovered("tetrahedral", method=OURS), rows("stress")["scene"].nunique(), "line",
            recovered("tetrahedral", method="free"), recovered(NODAL, method=OURS),
            recovered(NODAL, method=f"{OURS} recovers"))),
    (LIMITS, "our bodies with flat sides lack # to # % of the", lambda: span(
        rows("accuracy").query("method == @OURS and not body.str.contains('quadratic')")["shape_volume [%]"])),
    (LIMITS, "filled stomach** has # times the force of the reference when pressed",
        lambda: (1 + accuracy("stomach_press", "surface", 550, FORCE) / 100,)),
    *((PAPER, words, lambda scene=scene, volumes=volumes, nodes=nodes, column=column: [
        accuracy(scene, f"tetrahedral{more}", nodes, column) for more in ("", f", {volumes} volumes")])
      for scene, volumes, nodes, column, words in (
          ("stomach_press", 275, 550, FORCE, "stomach_press, 550 nodes: from # to # %"),
          ("spleen_sag", 100, 300, MEAN, "(300 nodes: from # to # %"),
          ("liver_probe", 100, 300, MEAN, "liver_probe, 300 nodes: from # to # %"))),
    (BREAKING, "implicit_volume ends ok in # %, implicit_springs in # %, xpbd_neo_hookean in # %, all methods together "
        "in # %", lambda: [sound(name) for name in (OURS, "implicit_springs", "xpbd_neo_hookean", "all")]),
    *((where, words, lambda: [number / 100 for number in counts("breaking", "all", "ok", "refused")])
      for where, words in ((BREAKING, "# % end ok and # %"), (LIMITS, "# % end ok, # %"))),
    opened("opening, L2", "# ± # %", OPENING, floor(OPENING)),
    opened("force", "# ± # %", FORCE, floor(FORCE)),
    opened("mean displacement", "# ± # %", MEAN, floor(MEAN)),
    opened("times real time", "#", SPEED),
    opened("rest shape / size", "# %", DISTANCE),
    ("docs/league.md", "needs # to # s for", lambda: span(of(rows("league"), engine="ours-quadratic")["cost [s/s]"])),
    ("docs/league.md", "PyBullet by at most # percentage points and those of Drake by #.", halved_steps),
    *((SILICONE, f"| {who}{NU.get(who, '')} |{' #, #, # |' * len(loads)}{' – |' * (3 - len(loads))}",
        lambda who=who: of(rows("silicone"), who=who).iloc[:, 2:].to_numpy().ravel().tolist())
      for who, loads in rows("silicone").groupby("who")),
    *((SILICONE, f"| {name} | # | #, #, # | #, #, # | #, #, # | # | #, #, # |", lambda name=name: [
        of(rows("silicone", "press"), material=name)[column].item() for column in (
            "mu", *tabled("scatter"), *tabled("B"), *tabled("B by mu of A"), "b", *tabled("B with b"))])
      for name in rows("silicone", "press")["material"]),
    *((SILICONE, f"| {law} | {scope} | # | #, # | #, # | #, # | # |", lambda n=n:
        rows("silicone", "press_laws").iloc[n, 2:-1].tolist())
      for n, (law, scope) in enumerate(rows("silicone", "press_laws").fillna("–").iloc[:, :2].to_numpy())),
    *((SILICONE, f"| {shape:.2f} | #, #, #, # | # |",
        lambda n=n: rows("silicone", "press_modulus").iloc[n, 1:].tolist())
      for n, shape in enumerate(rows("silicone", "press_modulus").iloc[:, 0])),
    *((SILICONE, f"| {who} | # | #, #, #, # |", lambda who=who: [
        of(rows("silicone", "press_programs"), who=who)[column].item()
        for column in ("nodes", *(f"at {c} % [%]" for c in (10, 20, 30, 40)))])
      for who in rows("silicone", "press_programs").dropna(subset="nodes")["who"]),
    (SILICONE, "nodes are at most # % off from 4 to 40 % compression, mixed ones # %", lambda: (
        pressed("a volume per vertex", "a volume per vertex, finer mesh"), pressed("mixed volumes"))),
    (LIMITS, "with volumes of vertices are within # % from 4 to 40 %", lambda: (pressed("a volume per vertex"),)),
    (SILICONE, "One for all is best at 30 %, but up to # % off at 50 %", lambda: [
        rows("silicone", "press_laws").query("law == 'Mooney-Rivlin'")["max at 50 %"].max()]),
    (SILICONE, "fitted between 5 and 20 %, it is # times",
        lambda: (rows("silicone", "press")["mu if plates slide"].median(),)),
    (SILICONE, "within 2 % at 30 % for # of 15 materials", lambda: ((
        rows("silicone", "press")[["A at 30 %", "B at 30 %"]].mean(axis=1).abs() < 2.0).sum(),)),
    (LIMITS, "its force is up to # % off at 30 % and # % at 50 %", lambda: [
        rows("silicone", "press")[f"B at {c} %"].abs().max() for c in (30, 50)]),
    (CUTTING, "| paper's surface body, 350 surface nodes | – | #, #, # |",
        lambda: cutting("surface", 350, "kidney_bisected", FORCE, MEAN, OPENING)),
    *((CUTTING, f"| {words}, {nodes} | #, #, # | #, #, # |", lambda body=body, nodes=nodes: [
        number for scene in ("ball_cut_pressed", "kidney_bisected")
        for number in cutting(body, nodes, scene, FORCE, MEAN, OPENING)])
      for words, body, nodes in (
          ("one volume", "tetrahedral", 350), ("one volume", "tetrahedral", 700),
          ("cotangent, one volume per node", NODAL, 350), ("quadratic", UNIFORM, 594),
          ("adaptive quadratic", ADAPTIVE, 794), ("adaptive quadratic", ADAPTIVE, 994))),
    (CUTTING, "the volumes of the pieces are at most # of the volume off.", lambda: (
        max(of(rows("cutting"), scene="ball_bisected", body=[UNIFORM, ADAPTIVE])[PIECE]) / 100,)),
    *(("docs/accuracy.md", words, lambda column=column, nodes=nodes, body=body: near_liver(body, nodes, column))
      for words, body, nodes, column in (
          ("have force errors of # to # %", UNIFORM, 594, FORCE), ("mean errors of # to # %;", UNIFORM, 594, MEAN),
          ("1,266 nodes # to # %", ADAPTIVE, 1194, FORCE), ("2.2 % and # to # %", ADAPTIVE, 1194, MEAN))),
    *(("docs/accuracy.md", f"| {scene} |{' #, #, # |' * len(MIXED)}", lambda scene=scene: [
        number for body, nodes in MIXED for number in worst_of(scene, body, nodes, FORCE, MEAN)])
      for scene in ("ball_clamped", "liver_press", "liver_probe", "kidney_probe", "stomach_press", "stomach_probe")),
    (LIMITS, "lags** on both stomachs by # to # %", lambda: span(
        stomachs("force_error [%]", [UNIFORM, ADAPTIVE], "stomach_press", "stomach_probe"))),
    (LIMITS, "it still varies at the end by up to # and # %",
        lambda: [
            stomachs("sway [%]", [UNIFORM, ADAPTIVE], scene).max() for scene in ("stomach_press", "stomach_probe")]),
]  # fmt: skip


NUMBER, NAME = r"([+−-]?\d[\d,]*(?:\.\d+)?(?:e-?\d+)?)", r"([\w*]+)"


def is_shown(shown: str, number: float | str) -> bool:
    """Whether a page shows a number, rounded to the digits that it prints."""
    if isinstance(number, str):
        return shown == number
    digits, _, power = shown.replace(",", "").replace("−", "-").partition("e")
    unit = 10.0 ** (int(power or 0) - len(digits.partition(".")[2]))
    return abs(float(digits) * 10.0 ** int(power or 0) - number) <= 0.5001 * unit


@pytest.mark.parametrize(("pages", "words", "numbers"), ROWS, ids=[words[:40] for _, words, _ in ROWS])
def test_numbers_of_pages_are_those_of_the_published_tables(pages, words, numbers):
    pattern = re.escape(words).replace(r"\#", NUMBER).replace("@", NAME).replace(r"\ ", " ")
    by_tables = list(numbers())
    for name in [pages] if isinstance(pages, str) else pages:
        found = re.search(pattern, page(name))
        assert found, f"{name} does not say: {words}; correct this row with the page. By the tables: {by_tables}"
        wrong = [(shown, by) for shown, by in zip(found.groups(), by_tables, strict=True) if not is_shown(shown, by)]
        assert not wrong, f"{name}: {found.group()}; shown, and by the tables: {wrong}"


@pytest.mark.parametrize("name", COPIED)
def test_tables_of_pages_are_the_published_ones(name):
    text = (ROOT / name).read_text(encoding="utf-8")
    assert [file for file in COPIED[name] if (TABLES / file).read_text(encoding="utf-8").strip() not in text] == []


def test_times_of_cuts_with_virtual_nodes():
    part = (ROOT / CUTTING).read_text(encoding="utf-8").split("| ball_incised | nodes that move")[1]
    times = [line.split("|")[7].strip() for line in part.split("\n\n")[0].splitlines()[2:]]
    bodies = [(body + way, nodes) for body, nodes in VIRTUAL for way in ("", ", virtual nodes")]
    assert times == [f"{cutting(body, nodes, 'ball_incised', 'cut_ms [ms]')[0]:.2f}" for body, nodes in bodies]


@pytest.mark.parametrize("status", [Status.FOLDED, Status.INVERTED])
def test_no_published_row_is_ok_that_would_have_this_status_by_its_least_j(status):
    tables = [pd.read_csv(path) for path in TABLES.glob("*/*.csv") if path.stem != "stress"]
    ok = pd.concat([of(table, status="ok") for table in tables if LEAST in table], ignore_index=True)
    assert len(ok) > 100 and not [least for least in ok[LEAST] if folding(np.array([least]), shaped=False)[0] == status]


def test_methods_of_the_page_are_those_of_the_tuple():
    text = (ROOT / "docs/methods.md").read_text(encoding="utf-8").split("## Claims")[1].split("## ")[0]
    assert {method.name for method in METHODS} <= set(re.findall(r"^\| (\w+) (?:§ )?\|", text, re.M))


def test_scenes_of_the_first_table_share_the_tissue_and_the_step():
    assert BALL_SQUEEZE.tissue.shear_modulus == LIVER_PRESS.tissue.shear_modulus
    assert len(compared()) == 16 and (compared()["dt/dt_c"] <= 0.5).all()
