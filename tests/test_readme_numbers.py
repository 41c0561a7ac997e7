"""Every number that README states of a study is read off the published tables again."""

import re
from pathlib import Path

import pandas as pd
import pytest

from studies.geometry.organs.make_shape import make_shape
from studies.geometry.surface.family import true_volume
from studies.plots.campaigns.recovery import RETURNED
from studies.reference.solve import VARIANTS
from studies.report.publish import PUBLISHED
from studies.scenes import BALL_SQUEEZE, LIVER_PRESS
from studies.scenes.ball_squeeze import RADIUS
from studies.scenes.stress import STRESS_SCENES

ROOT = Path(__file__).parent.parent
WORDS = dict(zip(range(17), ("none", "one", "two", "three", "four", "five", "six", "seven", "eight", "nine", "ten",
                             "eleven", "twelve", "thirteen", "fourteen", "fifteen", "sixteen"),
                 strict=True))  # fmt: skip
NODAL = "tetrahedral, nodal volumes"
ONE_VOLUME = ("implicit_volume", "shake", "projection", "post_stabilization", "baumgarte", "penalty", "pressure",
              "pyramid", "xpbd whole iterations2", "implicit_springs")  # fmt: skip
PER_TETRAHEDRON = ("element", "element bulk_modulus1e+06 hard", "xpbd")


def said(pattern: str) -> tuple[str, ...]:
    """The groups of `pattern`, which README contains once."""
    text = " ".join((ROOT / "README.md").read_text(encoding="utf-8").split())
    found = re.findall(pattern, text)
    assert len(found) == 1, f"README says {len(found)} times: {pattern}"
    return found[0] if isinstance(found[0], tuple) else (found[0],)


def table(study: str) -> pd.DataFrame:
    """The published table of a study."""
    return pd.read_csv(ROOT / PUBLISHED / study / f"{study}.csv")


def recovered(rows: pd.DataFrame) -> list[str]:
    """Starts from which a body comes back, by the measure of the chart."""
    return rows.loc[rows["rest_distance [%]"] < RETURNED, "scene"].tolist()


def test_the_starts_that_a_body_recovers_from():
    several, starts, lost = said(r"With one volume constraint the ball recovers from (\w+) of the (\w+) starts, all "
                                 r"except the (\w+)\.")  # fmt: skip
    said(r"With springs alone it (never) does\.")
    nodal, mended = said(r"With nodal volumes it recovers from (\w+), and from (\w+) where the method `recovers`")
    rows = table("stress")
    names = [scene.name for scene in STRESS_SCENES]
    assert sorted(set(rows["scene"])) == sorted(names) and starts == WORDS[len(names)]
    one = rows[rows["body"] == "tetrahedral"]
    for method in ("implicit_volume", "shake"):
        back = recovered(one[one["method"] == method])
        assert several == WORDS[len(back)]
        assert set(names) - set(back) == {f"stress_{lost}"}
    assert recovered(one[one["method"] == "free"]) == []
    many = rows[rows["body"] == NODAL]
    chosen = many["recipe"].str.contains("recovers")
    assert nodal == WORDS[len(recovered(many[~chosen & (many["law"] == "van_gelder")]))]
    for law in ("van_gelder", "cotangent"):
        assert mended == WORDS[len(recovered(many[chosen & (many["law"] == law)]))]


def test_what_one_volume_leaves_of_the_force_under_any_law():
    least, most = map(int, said(r"one volume leaves a filled ball (\d+) to (\d+) % short of its force under any law"))
    rows = table("laws")
    short = -rows.loc[rows["body"] == "tetrahedral", "force_end [%]"]
    assert (round(short.min()), round(short.max())) == (least, most)


def test_how_near_cotangent_springs_come():
    share, nodes = said(r"one per node with cotangent springs comes within ([\d.]+) % at (\d+) nodes")
    rows = table("laws")
    (error,) = rows.loc[
        (rows["body"] == NODAL) & (rows["law"] == "cotangent") & (rows["nodes"] == int(nodes)), "force_error [%]"
    ]
    assert round(error, 1) == float(share)


@pytest.mark.parametrize("scene", ["ball_squeeze", "liver_press"])
def test_one_volume_is_one_answer_and_tetrahedra_lock(scene):
    said(r"all that keep \*(one)\* volume give the same answer and differ in cost and in what volume they leave; per "
         r"tetrahedron they lock")  # fmt: skip
    rows = table("methods")
    rows = rows[(rows["scene"] == scene) & (rows["body"] == "tetrahedral")]
    one = rows[rows["method"].isin(ONE_VOLUME)]
    short = one[one["dt [ms]"] < 100]  # the longest step of the implicit springs is an answer of its own
    assert set(one["method"]) == set(ONE_VOLUME)
    assert short["force_end [%]"].max() - short["force_end [%]"].min() < 1.0
    assert one["step_time [µs]"].max() > 2 * one["step_time [µs]"].min()
    assert one["volume_worst [%]"].max() > 1e6 * one["volume_worst [%]"].min()
    locked = rows[rows["method"].isin(PER_TETRAHEDRON)]
    assert set(locked["method"]) == set(PER_TETRAHEDRON) and (locked["force_end [%]"] > 0).all()
    assert locked["force_end [%]"].max() > 40 > 0 > one["force_end [%]"].max()


def test_the_body_and_the_step_of_the_headline():
    radius, volume, modulus, nodes = said(
        r"ball of (\d+) cm and liver of ([\d.]+) L, mu = ([\d.]+) kPa, (\d+) surface nodes, "
        r"dt = half the stability limit"
    )
    rows = table("volume_loss")
    assert set(rows["nodes"]) == {int(nodes)}
    shown = rows[rows["dt/dt_c"] > 0.25]
    assert len(shown) == 16 and ((shown["dt/dt_c"] > 0.4) & (shown["dt/dt_c"] <= 0.5)).all()
    for scene in (BALL_SQUEEZE, LIVER_PRESS):
        assert scene.tissue.shear_modulus == pytest.approx(1e3 * float(modulus))
    assert pytest.approx(RADIUS) == 1e-2 * float(radius)
    assert round(1e3 * true_volume(make_shape("liver", {})), 1) == float(volume)


def test_meshes_and_settings_of_every_reference():
    meshes, settings = said(r"Every reference comes from (\w+) meshes and (\w+) settings made better")
    rows = pd.read_csv(ROOT / PUBLISHED / "reference" / "uncertainty.csv")
    assert {len(levels.split()) for levels in rows["levels"].astype(str)} == {3} and meshes == WORDS[3]
    assert settings == WORDS[len(VARIANTS)]


def test_what_other_programs_reach_on_the_liver():
    best = said(r"implicit quadratic elements are the most accurate, (\d+\.\d) to (\d+\.\d) % off in force")
    faster, least, most = said(r"our even quadratic bodies are (\d+) times as fast and (\d+) to (\d+) % off")
    others = said(r"MuJoCo, Newton and PyBullet, on linear tetrahedra, are (\d+) to (\d+) % off")
    rows = table("peers")
    rows = rows[(rows["scene"] == "liver_press") & ~rows["method"].str.contains("half_step")]
    off, method = rows["force_end [%]"].abs(), rows["method"]
    ours, felupe = rows["body"].eq("quadratic") & method.eq("implicit_volume"), method.eq("felupe")
    assert best == tuple(f"{v:.1f}" for v in (off[felupe].min(), off[felupe].max()))
    assert off[felupe].max() < off[~felupe].min()
    assert (least, most) == tuple(f"{v:.0f}" for v in (off[ours].min(), off[ours].max()))
    linear = off[method.isin(["mujoco", "newton", "bullet"])]
    assert others == tuple(f"{v:.0f}" for v in (linear.min(), linear.max()))
    speeds = [rows.loc[which].sort_values("nodes")["real_time [s/s]"].to_numpy() for which in (ours, felupe)]
    assert faster == f"{(speeds[0] / speeds[1]).mean():.0f}"
