"""Errors of a recipe on other organs, which `advise` takes from the table of the population."""

import re
from dataclasses import replace

import numpy as np
import pandas as pd
import pytest

from massspring import ImplicitVolume
from studies.base.errors import StudyError
from studies.catalog.accuracy import usual_mass
from studies.metrics.wish import usual_wish
from studies.runs.case import Case
from studies.runs.recipe_text import recipe_text
from studies.runs.recipes import QuadraticBody
from studies.scene.library import KIDNEY_PROBE, LIVER_PROBE, STOMACH_PROBE
from studies.scene.scene import Organ
from studies.tools.advise.campaign import shipped
from studies.tools.advise.population import organ_of, supported, unseen, words

CASE = Case(LIVER_PROBE, QuadraticBody(794, graded=True), ImplicitVolume(), dt_fraction=0.8)
FORCES = np.linspace(-4.0, 4.0, 41)


def table(path, case=CASE):
    """Forty-one livers and a lost one, a kidney, and another recipe."""
    rows = [(f"liver_0_{number:03d}", "ok", force, recipe_text(case)) for number, force in enumerate(FORCES)]
    rows += [("liver_0_041", "diverged", 99.0, recipe_text(case)), ("kidney_0_000", "ok", 77.0, recipe_text(case))]
    rows += [
        ("liver_0_000", "ok", 66.0, recipe_text(replace(case, dt_fraction=0.4))),
        ("liver_press", "ok", 55.0, "{}"),
    ]
    frame = pd.DataFrame(rows, columns=["scene", "status", "force_end [%]", "recipe"])
    frame["force_end floor [%]"], frame["mean_error [%]"], frame["mean_error floor [%]"] = 0.5, 1.0, 0.1
    path.parent.mkdir(parents=True, exist_ok=True)
    frame.to_csv(path, index=False)


@pytest.mark.parametrize("place", ["population", "published/population"])
def test_only_members_of_that_organ_with_that_recipe_count(tmp_path, place):
    table(tmp_path / place / "population.csv")
    summary = unseen(tmp_path, CASE)
    assert summary is not None and (summary.force.count, summary.force.lost, summary.organ) == (41, 1, "liver")
    assert summary.force.bound == pytest.approx(np.quantile(np.abs(FORCES), 0.95))
    assert "41 other organs" in words(summary) and "1 more failed" in words(summary) and "3.8 %" in words(summary)


def test_of_a_heavy_body_the_lighter_one_is_told_as_that(no_tables, tmp_path):
    light, heavy = (replace(CASE, body=replace(CASE.body, mass=mass)) for mass in ("stiffness", "heavy"))
    table(tmp_path / "population" / "population.csv", light)
    assert unseen(tmp_path, heavy).force == unseen(tmp_path, light).force
    assert "(liver, under a probe, masses by stiffness, 1 more failed)" in words(unseen(tmp_path, heavy))
    assert "masses" not in words(unseen(tmp_path, light))


def test_of_two_masses_that_of_the_recipe_counts_and_the_other_where_it_never_ran(no_tables, tmp_path):
    light, heavy = (replace(CASE, body=replace(CASE.body, mass=mass)) for mass in ("stiffness", "heavy"))
    table(tmp_path / "population" / "population.csv", heavy)
    assert "heavy masses" in words(unseen(tmp_path, light)) and "masses" not in words(unseen(tmp_path, heavy))
    assert unseen(tmp_path, replace(CASE, body=replace(CASE.body, mass="lumped"))) is None


def test_without_runs_on_the_population_there_is_no_summary(no_tables, tmp_path):
    assert unseen(tmp_path, CASE) is None
    table(tmp_path / "population" / "population.csv")
    assert unseen(tmp_path, replace(CASE, dt_fraction=0.1)) is None
    assert unseen(tmp_path, replace(CASE, scene=KIDNEY_PROBE)).force.count == 1
    scan = replace(KIDNEY_PROBE, organ=Organ("file", {"path": "scan.stl", "unit": "mm", "remesh": True}))
    assert unseen(tmp_path, replace(CASE, scene=scan)).organ == "kidney"


def test_the_smallest_body_that_keeps_the_targets_on_95_of_100_organs_is_supported(tmp_path):
    """Of livers the published table supports the larger alone; a bladder under a probe counts as a stomach."""
    found = {}
    for tissue, scene in {"liver": LIVER_PROBE, "kidney": LIVER_PROBE, "bladder": STOMACH_PROBE}.items():
        case, sample = supported(shipped(), scene, tissue)
        found[tissue] = case.body.nodes, sample.organ
        assert sample.meets(usual_wish(scene)) and case.scene == scene and case.body.mass == usual_mass(scene)
    assert found == {"liver": (1594, "liver"), "kidney": (1194, "kidney"), "bladder": (1194, "stomach")}
    assert re.fullmatch(r"47 of 50 random stomachs: force within .* %, mean displacement within .* %", sample.promise)


def test_the_two_bodies_that_ran_on_more_members_are_told_by_those(tmp_path):
    """Where the reference does not decide an error, the member does not count; other bodies have the table alone."""
    fine = replace(CASE, body=QuadraticBody(1594, graded="adaptive"))
    table(tmp_path / "population" / "population.csv", fine)
    pairs = pd.DataFrame({"scene": [f"liver_0_{n:03d}" for n in range(60)], "organ": "liver"})
    pairs = pairs.assign(force_1594=0.1, displacement_1594=[np.nan, *[0.3] * 59], force_1194=9.0, displacement_1194=9.0)
    pairs.to_csv(tmp_path / "population" / "pairs.csv", index=False)
    sample = unseen(tmp_path, fine)
    counted = sample.force.count, sample.displacement.count, sample.displacement.lost
    assert "59 other organs (liver, under a probe, 1 more that the reference does not decide)" in words(sample)
    assert sample.promise.startswith("56 of 59 random livers (1 more undecided): ")
    assert counted == (60, 59, 0) and (sample.force.bound, sample.displacement.bound) == pytest.approx((0.1, 0.3))
    table(tmp_path / "other" / "population" / "population.csv")
    pairs.to_csv(tmp_path / "other" / "population" / "pairs.csv", index=False)
    assert unseen(tmp_path / "other", CASE).force.count == 41
    pairs.assign(organ="kidney").to_csv(tmp_path / "population" / "pairs.csv", index=False)
    assert unseen(tmp_path, fine).force.count == 41, "an organ that the pairs lack has its table"


def test_a_table_that_lacks_a_column_is_named(tmp_path):
    table(tmp_path / "population" / "population.csv")
    path = tmp_path / "population" / "population.csv"
    pd.read_csv(path).drop(columns="recipe").to_csv(path, index=False)
    with pytest.raises(StudyError, match=r"population\.csv cannot be read"):
        unseen(tmp_path, CASE)
    fine = replace(CASE, body=QuadraticBody(1594, graded="adaptive"))
    table(path, fine)
    path.with_name("pairs.csv").write_text("scene\n")
    with pytest.raises(StudyError, match=r"pairs\.csv cannot be read"):
        unseen(tmp_path, fine)


def test_names_of_members_and_of_nothing_else_tell_their_organ():
    names = ("kidney_7_001", "liver_0_1234", "liver_press", "liver", "liver_0_x")
    assert [organ_of(name) for name in names] == ["kidney", "liver", None, None, None]
