"""Findings in words: every number is read off the tables in results/published, and publishing writes them again."""

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from textwrap import fill

import pandas as pd

from studies.advice.campaign import published_rows
from studies.base.errors import StudyError
from studies.catalog.accuracy import ACCURACY
from studies.metrics.cells import MINUS, plain
from studies.metrics.judged import Judged, cheapest, nearest
from studies.metrics.wish import Wish, usual_wish
from studies.plots.campaigns.recovery import RETURNED

WIDTH = 120
"""Columns of a page."""
NODAL = "tetrahedral, nodal volumes"
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
    text: Callable[[Path], list[str]]
    """Folder of the published tables -> one paragraph per finding."""

    @property
    def marks(self) -> tuple[str, str]:
        """The lines of the page between which the list stands."""
        return f"<!-- {self.name}: begin -->", f"<!-- {self.name}: end -->"

    def written(self, published: Path) -> str:
        """The list in Markdown, at most WIDTH columns wide. Raises StudyError where a table is missing."""
        points = (f"- {text}" for text in self.text(published))
        return "\n".join(fill(text, WIDTH, subsequent_indent="  ", break_on_hyphens=False) for text in points)


def table(published: Path, study: str) -> pd.DataFrame:
    """The published table of a study. Raises StudyError where it is missing."""
    path = published / study / f"{study}.csv"
    if not path.is_file():
        raise StudyError(f"there is no table {path} to read the findings from; `organbench publish {study}` writes it")
    return pd.read_csv(path)


def headline(published: Path) -> list[str]:
    """What README states."""
    return [constraint(published), one_volume(published), recommended(published), other_programs(published)]


def answers(published: Path) -> list[str]:
    """What docs/findings.md adds: one answer for each study of methods, laws, literature and starts."""
    return [
        ways(published),
        laws(published),
        literature(published),
        other_programs(published, "../"),
        starts(published),
    ]


def constraint(published: Path) -> str:
    """What the constraint keeps, and what it costs."""
    rows = table(published, "volume_loss")
    rows = rows[rows["dt/dt_c"] > SECOND_LOOK]
    lost = rows.groupby("method")["volume_worst [%]"].max()
    times = table(published, "frame_rate").pivot(
        index=["scene", "body", "nodes"], columns="method", values="step_time [µs]"
    )
    more = 100 * (times["implicit_volume"] / times["free"] - 1)
    return (
        f"**The constraint keeps the volume and costs little.** With it the volume is never more than "
        f"{lost['implicit_volume']:.6f} % off; springs alone lose up to {lost['free']:.0f} %. A step takes "
        f"{more.min():.0f} to {more.max():.0f} % longer ([frame times](results/published/frame_rate/cost_ratio.png))."
    )


def one_volume(published: Path) -> str:
    """How far one kept volume is from the force."""
    rows = table(published, "volume_loss")
    rows = rows[(rows["dt/dt_c"] > SECOND_LOOK) & (rows["method"] == "implicit_volume")]
    short = {body: -rows.loc[rows["body"] == body, "force_end [%]"] for body in ("tetrahedral", "surface")}
    return (
        f"**The volume alone does not make the force right.** With one kept volume, the force of the filled bodies is "
        f"{_range(short['tetrahedral'])} % too small, that of the paper's surface bodies {_range(short['surface'])} % "
        f"([forces](results/published/volume_loss/force.png))."
    )


def recommended(published: Path) -> str:
    """In how many scenes a body is accurate enough, how fast these are, and where none is."""
    speeds, misses, count = list[float](), list[str](), 0
    for scene in ACCURACY.scenes:
        rows = [one for one in published_rows(published, scene) if one.compared]
        wish = usual_wish(scene)
        best = cheapest(rows, wish)
        chosen = best or nearest(rows, wish)
        if chosen is None:
            continue
        count += 1
        speeds.append(1.0 / chosen.cost.value)
        if best is None:
            misses.append(f"{scene.name} {_why_not(chosen, wish)}")
    return (
        f"**Quadratic bodies with many volumes are accurate without fitting.** The recommended bodies are [accurate "
        f"enough](docs/accuracy.md#accurate-enough) in {count - len(misses)} of {count} scenes, {min(speeds):.1f} to "
        f"{max(speeds):.1f} times as fast as real time on one core. The exceptions: {'; '.join(misses) or 'none'}."
    )


def _why_not(one: Judged, wish: Wish) -> str:
    """Which error misses its target, or which cannot be decided."""
    errors = {"force": (one.force, wish.force), "displacement": (one.displacement, wish.displacement)}
    bounds = {name: (error, bound) for name, (error, bound) in errors.items() if bound and error.known}
    for name, (error, bound) in bounds.items():
        if error.uncertainty > bound:
            return f"cannot be decided, as its reference is only known to ±{error.uncertainty:.2g} % in {name}"
    missed = [
        f"misses {bound:g} % in {name} by {abs(error.value) - bound:.1g} %"
        for name, (error, bound) in bounds.items()
        if abs(error.value) > bound
    ]
    return " and ".join(missed) or "does not keep the shape of the organ at rest"


def other_programs(published: Path, up: str = "") -> str:
    """What MuJoCo, FElupe, Newton and PyBullet reach on the pressed liver; up: from the page to README's folder."""
    rows = table(published, "peers")
    rows = rows[(rows["scene"] == "liver_press") & ~rows["method"].str.contains("half_step")]
    method, off = rows["method"], rows["force_end [%]"].abs()
    felupe, ours = method.eq("felupe"), method.eq("implicit_volume") & rows["body"].eq("quadratic")
    linear = method.isin(["mujoco", "newton", "bullet"])
    speed = [rows.loc[which].sort_values("nodes")["real_time [s/s]"].to_numpy() for which in (ours, felupe)]
    return (
        f"**Implicit elements are more accurate and slower.** On the pressed liver FElupe's quadratic elements are "
        f"{_range(off[felupe], 1)} % off in force. Our uniform quadratic bodies are {_range(off[ours])} % off and "
        f"{(speed[0] / speed[1]).mean():.0f} times as fast. MuJoCo, Newton and PyBullet, on linear tetrahedra, are "
        f"{_range(off[linear])} % off ([other programs]({up}results/published/peers/peers.png))."
    )


def ways(published: Path) -> str:
    """How alike the methods are that keep one volume, and how stiff one volume per tetrahedron is."""
    rows = table(published, "methods")
    rows = rows[(rows["body"] == "tetrahedral") & (rows["dt [ms]"] < LONGEST_STEP)]
    one, apart = (rows[rows["method"].isin(names)] for names in (TOGETHER, APART))
    spread = one.groupby("scene")["force_end [%]"].agg(lambda errors: errors.max() - errors.min()).max()
    step, volume = one["step_time [µs]"], one["volume_worst [%]"]
    return (
        f"**Which way to keep a volume** (`make study-methods`, [chart](../results/published/methods/methods.png)): "
        f"all {one['method'].nunique()} methods that keep *one* volume give the same force within {spread:.1f} %. They "
        f"differ in cost, {plain(step.min())} to {plain(step.max())} µs a step, and in the volume error, "
        f"{volume.min():.0e} to {volume.max():.1f} %. One volume per tetrahedron locks: the force is "
        f"{_range(apart['force_end [%]'])} % too large."
    )


def laws(published: Path) -> str:
    """What stiffness laws and nodal volumes are worth."""
    rows = table(published, "laws")
    short = -rows.loc[rows["body"] == "tetrahedral", "force_end [%]"]
    nodal = rows[(rows["body"] == NODAL) & (rows["law"] == "cotangent")].sort_values("nodes").iloc[-1]
    return (
        f"**Which stiffness law, how many volumes** (`make study-laws`, [chart](../results/published/laws/laws.png)): "
        f"with one volume the force of a filled ball is {_range(short)} % too small under any law. One volume per node "
        f"with cotangent springs brings it within {nodal['force_error [%]']:.1f} % at {nodal['nodes']} surface nodes."
    )


def literature(published: Path) -> str:
    """How fast and how far off the methods are that keep no volume by a constraint."""
    rows = table(published, "literature")
    response = rows[rows["method"] == "elastic_response"]
    linear = rows[rows["method"].isin(["elastic_response", "linear_modes"]) & (rows["scene"] != "ball_clamped")]
    held = response[response["scene"] == "ball_clamped"].iloc[0]
    return (
        f"**What else the literature offers** (`make study-literature`, "
        f"[chart](../results/published/literature/literature.png)): angular springs, chain mail, linear modes and a "
        f"precomputed elastic response. Where the organ hardly turns, the precomputed response is the best value: on "
        f"ball_clamped its force is {held['force_end [%]']:.0f} % off at {held['real_time [s/s]']:.0f} times real "
        f"time. Where the organ turns, both linear methods miss the force by {_range(linear['force_end [%]'])} %."
    )


def starts(published: Path) -> str:
    """From which distorted starts a ball recovers its rest shape."""
    rows = table(published, "stress")
    count = rows["scene"].nunique()
    recovers = rows["method"].str.contains("recovers")
    back = rows["rest_distance [%]"] < RETURNED
    one = rows["body"].eq("tetrahedral")

    def recovered(which: pd.Series) -> int:
        """Starts from which every body and law of these rows comes back."""
        return int(back[which].groupby(rows["scene"]).all().sum())

    keeps = one & rows["method"].eq("implicit_volume")
    lost = ", ".join(name.removeprefix("stress_") for name in rows.loc[keeps & ~back, "scene"])
    return (
        f"**From which distorted starts a ball recovers** (`make study-stress`, "
        f"[chart](../results/published/stress/recovery.png)): with one volume from {recovered(keeps)} of {count} (not "
        f"from: {lost}), with springs alone from {recovered(one & rows['method'].eq('free'))}, with nodal volumes from "
        f"{recovered(rows['body'].eq(NODAL) & ~recovers)}, and from {recovered(rows['body'].eq(NODAL) & recovers)} "
        f"with `ImplicitVolume(recovers=True)` ([theory](theory.md), section 8)."
    )


def _range(values: pd.Series, digits: int = 0) -> str:
    """Smallest and largest known value in words."""
    return f"{values.min():.{digits}f} to {values.max():.{digits}f}".replace("-", MINUS)


SENTENCES = (Sentences("README.md", "findings", headline), Sentences("docs/findings.md", "answers", answers))
