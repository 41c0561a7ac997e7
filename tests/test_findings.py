"""The numbers that README and docs state of the studies are those of the published tables."""

import re
import shutil
from pathlib import Path

import h5py
import numpy as np
import pandas as pd
import pytest

from massspring import METHODS
from studies.base.errors import StudyError
from studies.catalog.accuracy import ACCURACY
from studies.geometry.organs import make_shape
from studies.geometry.surface.first_surface import true_volume
from studies.reference.solve import VARIANTS
from studies.report.sentences import APART, NODAL, SENTENCES, TOGETHER, random_organs, real_time
from studies.report.summaries import SUMMARIES
from studies.scene.library import BALL_SQUEEZE, LIVER_PRESS
from studies.scene.library.ball_squeeze import RADIUS

ROOT = Path(__file__).parent.parent
TABLES = ROOT / "results/published"
HEADLINE = SENTENCES[0]


def between(page: str, marks: tuple[str, str]) -> str:
    """What a page shows between its marks."""
    return (ROOT / page).read_text(encoding="utf-8").split(marks[0])[1].split(marks[1])[0].strip()


@pytest.fixture
def published(tmp_path):
    """A copy of the published tables, to be changed."""
    return shutil.copytree(TABLES, tmp_path / "published", ignore=shutil.ignore_patterns("*.png"))


def changed(published: Path, study: str, change) -> str:
    """The headline after a change of the table of a study."""
    path = published / study / f"{study}.csv"
    rows = pd.read_csv(path)
    change(rows)
    rows.to_csv(path, index=False)
    return " ".join(HEADLINE.written(published).split())


def page(name: str) -> str:
    """Its text on one line."""
    return " ".join((ROOT / name).read_text(encoding="utf-8").split())


@pytest.mark.parametrize("sentences", SENTENCES, ids=lambda sentences: sentences.name)
def test_findings_in_words_are_read_off_the_published_tables(sentences):
    assert between(sentences.page, sentences.marks) == sentences.written(TABLES)


@pytest.mark.parametrize("summary", SUMMARIES, ids=lambda summary: summary.name)
def test_tables_of_the_pages_are_the_published_ones(summary):
    assert between(summary.page, summary.marks) == (TABLES / summary.file).read_text(encoding="utf-8").strip()


def test_a_force_that_changes_changes_the_sentence(published):
    def shorten(rows):
        rows.loc[rows["body"] == "surface", "force_end [%]"] = -12.3

    assert "that of the surface bodies of Jung et al. 12 to 12 %" in changed(published, "volume_loss", shorten)


def test_a_scene_whose_reference_decides_nothing_is_not_called_missed(published):
    def spoil(rows):
        rows.loc[rows["scene"] == "ball_clamped", "mean_error floor [%]"] = 2.0

    text = changed(published, "accuracy", spoil)
    assert "In 7 of 9 scenes" in text
    assert re.search(r"in ball_clamped the nearest body \([^)]*\) is undecided, because", text)
    assert "its reference is only known to ±2 % in displacement" in text


def test_a_scene_without_an_accurate_body_says_by_how_much_it_misses(published):
    def spoil(rows):
        rows.loc[rows["scene"] == "kidney_probe", "force_end [%]"] = 3.5

    text = changed(published, "accuracy", spoil)
    assert "in kidney_probe the nearest body (" in text
    assert "misses the target of 3 % for force with 3.5 % (10 of 10 adaptive bodies end well and are" in text


def test_a_scene_in_which_the_uncertainty_reaches_beyond_the_target_is_named(published):
    def sharpen(rows):
        rows.loc[rows["scene"] == "liver_probe", "mean_error floor [%]"] = 0.05
        rows.loc[rows["scene"] == "bladder_fill", "mean_error floor [%]"] = 0.40

    named = "In bladder_fill (displacement 2.66 ± 0.40 %, target 3 %) the uncertainty of the reference reaches beyond"
    assert named in changed(published, "accuracy", sharpen)


def test_of_a_scene_that_is_missed_adaptive_bodies_that_end_well_are_counted(published):
    def spoil(rows):
        rows.loc[rows["scene"] == "spleen_sag", "mean_error [%]"] = 7.7

    assert "(8 of 10 adaptive bodies end well and are 7.7 to 7.7 ± 1.6 % off)" in changed(published, "accuracy", spoil)


def test_a_scene_that_is_slower_than_real_time_is_named(published):
    path = published / "accuracy" / "accuracy.csv"
    rows = pd.read_csv(path)
    rows.loc[rows["scene"] == "ball_squeeze", "real_time [s/s]"] /= 10.0
    rows.to_csv(path, index=False)
    (sentence,) = real_time(published)
    assert "in 6 of the 8 scenes" in sentence and "ball_squeeze reaches 0.5 times real time" in sentence


def test_other_programs_are_judged_on_every_scene_and_not_on_that_of_the_search_alone(published):
    def spoil(rows):
        chosen = (rows["engine"] == "felupe") & (rows["scene"] == "kidney_probe")
        rows.loc[chosen, ["force_end [%]", "mean_error [%]"]] = -44.4, 55.5

    assert "1.6 to 44.4 and 1.6 to 55.5 % for FElupe's quadratic elements" in changed(published, "league", spoil)


def test_a_missing_table_is_one_sentence(published):
    (published / "league" / "league.csv").unlink()
    with pytest.raises(StudyError, match=r"there is no table .*league.csv .*`make publish` writes it"):
        HEADLINE.written(published)


def test_the_words_of_the_answers_hold():
    """All methods that keep one volume stand in the table, and those that keep every tetrahedron's lock."""
    rows = pd.read_csv(TABLES / "methods" / "methods.csv")
    rows = rows[rows["body"] == "tetrahedral"]
    assert set(TOGETHER) | set(APART) <= set(rows["method"]) and not set(TOGETHER) & set(APART)
    assert (rows.loc[rows["method"].isin(APART), "force_end [%]"] > 0).all()
    laws = pd.read_csv(TABLES / "laws" / "laws.csv")
    nodal = laws[(laws["body"] == NODAL) & (laws["law"] == "cotangent")].sort_values("nodes")
    assert nodal["force_error [%]"].is_monotonic_decreasing, "refinement helps"


def test_the_ball_the_liver_and_the_step_of_the_first_table():
    text = page("docs/findings.md")
    radius, volume, modulus, nodes = re.findall(
        r"Ball of (\d+) cm radius and liver of ([\d.]+) L, shear modulus ([\d.]+) kPa, (\d+) surface nodes", text
    )[0]
    rows = pd.read_csv(TABLES / "volume_loss" / "volume_loss.csv")
    assert set(rows["nodes"]) == {int(nodes)}
    shown = rows[rows["dt/dt_c"] > 0.25]
    assert len(shown) == 16 and (shown["dt/dt_c"] <= 0.5).all()
    for scene in (BALL_SQUEEZE, LIVER_PRESS):
        assert scene.tissue.shear_modulus == pytest.approx(1e3 * float(modulus))
    assert pytest.approx(RADIUS) == 1e-2 * float(radius)
    assert round(1e3 * true_volume(make_shape("liver", {})), 1) == float(volume)


def test_numbers_that_the_list_of_limits_quotes():
    text = page("docs/limits.md")
    rows = pd.read_csv(TABLES / "accuracy" / "accuracy.csv").set_index(["scene", "body", "nodes"]).sort_index()
    stiff = 1 + rows.loc[("stomach_press", "surface", 550), "force_end [%]"].item() / 100
    assert f"has {stiff:.1f} times the force" in text
    bodies = rows.loc[("liver_probe", "adaptive quadratic, masses by stiffness")].reset_index()
    ranges = []
    for nodes in (994, 1194):
        near = bodies.loc[(bodies["nodes"] / nodes - 1).abs() < 0.07, "mean_error [%]"]
        assert len(near) == 5
        ranges.append(f"{near.min():.2f} to {near.max():.2f} %")
    sizes = f"{ranges[0]} with about 994 nodes and {ranges[1]} with about 1,194"
    assert sizes in text
    assert sizes in page("docs/findings.md")


def test_what_limits_say_of_forces_on_stomachs():
    text = page("docs/limits.md")
    rows = pd.read_csv(TABLES / "accuracy" / "accuracy.csv").set_index(["scene", "body"]).sort_index()
    stomachs = {
        (scene, kind): rows.loc[(scene, f"{kind}quadratic, masses by stiffness")]
        for scene in ("stomach_press", "stomach_probe")
        for kind in ("", "adaptive ")
    }

    def span(name, kind, *scenes):
        values = np.concatenate([stomachs[scene, kind][f"{name} [%]"].abs() for scene in scenes])
        return f"{values.min():.1f}", f"{values.max():.1f}"

    both = ("stomach_press", "stomach_probe")
    press, probe = (" to ".join(span("force_error", "", scene)) for scene in both)
    assert f"{press} % off on stomach_press and {probe} % on stomach_probe" in text
    assert f"that of adaptive ones {' to '.join(span('force_error', 'adaptive ', *both))} % on both" in text
    ends = [span("force_end", kind, *both)[1] for kind in ("", "adaptive ")]
    assert f"uniform bodies are at most {ends[0]} % off, adaptive ones {ends[1]} %" in text
    sways = {kind: stomachs["stomach_press", kind]["sway [%]"] for kind in ("", "adaptive ")}
    for kind, words in (("adaptive ", "adaptive meshes"), ("", "those of the recommended recipe")):
        count = f"more than 1 % on {(sways[kind] > 1.0).sum()} of {len(sways[kind])}"
        assert f"up to {sways[kind].max():.1f} % on {words} ({count})" in text


def test_random_livers_that_limits_name():
    text = page("docs/limits.md")
    members = pd.read_csv(TABLES / "population" / "population.csv").set_index(["scene", "nodes"])
    for member, form in (
        ("liver_0_000", "is {:+.1f} % off in force and {:.1f} %"),
        ("liver_0_060", "{:+.1f} and {:.1f} %"),
    ):
        found = members.loc[(member, 1194)]
        assert form.format(found["force_end [%]"], found["mean_error [%]"]) in text.split(member)[1][:90]


@pytest.mark.parametrize("scene", ["ball_squeeze", "ball_clamped", "liver_press", "ball_incised"])
def test_published_forces_are_as_far_from_those_of_the_second_code_as_limits_say(scene):
    checks = pd.read_csv(TABLES / "verify" / "verify.csv").set_index(["oracle", "quantity"])
    other = float(checks.loc[(f"judge_{scene}", "force_end"), "expected"])
    with h5py.File(ROOT / "studies" / "reference" / "published" / f"{scene}.h5") as file:
        off = 100 * abs(file["sample_force"][0, -1] / other - 1)
    bars = pd.read_csv(TABLES / "reference" / "uncertainty.csv").set_index(["scene", "quantity"])["uncertainty [%]"]
    assert f"{off:.2f} % ({scene}, ± {bars[scene, 'force_end']:.2f})" in page("docs/limits.md")


def test_settings_of_a_reference_change_as_little_as_pages_say():
    rows = pd.read_csv(TABLES / "reference" / "uncertainty.csv")
    rows = rows[rows["scene"].isin([scene.name for scene in ACCURACY.scenes])]
    rows = rows[rows["quantity"].isin(["force_end", "surface_mean"])]
    largest = f"{rows[['steps [%]', 'contact [%]', 'kappa [%]']].max().max():.2f} %"
    assert f"no setting changes force or mean displacement by more than {largest}" in page("docs/limits.md")
    assert f"refined settings change force and mean displacement by at most {largest} each" in page(
        "docs/population.md"
    )


@pytest.mark.parametrize(
    ("scene", "volumes", "nodes", "name", "form"),
    [
        ("stomach_press", 275, 550, "force_end [%]", "stomach_press, 550 nodes: from {:+.1f} to {:+.1f} %"),
        ("spleen_sag", 100, 300, "mean_error [%]", "(300 nodes: from {:.1f} to {:.1f} %"),
        ("liver_probe", 100, 300, "mean_error [%]", "liver_probe, 300 nodes: from {:.1f} to {:.1f} %"),
    ],
)
def test_what_some_volumes_change_is_what_the_page_on_the_paper_quotes(scene, volumes, nodes, name, form):
    rows = pd.read_csv(TABLES / "accuracy" / "accuracy.csv").set_index(["scene", "body", "nodes"])[name]
    one, some = (rows[scene, f"tetrahedral{more}", nodes] for more in ("", f", {volumes} volumes"))
    assert form.format(one, some).replace("-", "−") in page("docs/paper.md")


def test_hollow_organs_with_the_targets_of_solid_ones():
    rows = pd.read_csv(TABLES / "accuracy" / "accuracy.csv")
    rows = rows[rows["body"].str.startswith("adaptive") & ((rows["nodes"] / 1194 - 1).abs() < 0.07)]
    largest = rows.groupby("scene")[["force_end [%]", "mean_error [%]"]].agg(lambda values: values.abs().max())
    force, mean = largest.loc[["stomach_press", "stomach_probe"]].max()
    text = page("docs/accuracy.md")
    assert re.search(rf"at most {force:.1f} ± [\d.]+ and {mean:.1f} ± [\d.]+ %\)", text)
    assert f"not in bladder_fill ({largest.loc['bladder_fill', 'mean_error [%]']:.2f} ±" in text


def test_counts_of_trials_that_pages_quote():
    breaking, limits = page("docs/breaking.md"), page("docs/limits.md")
    methods = pd.read_csv(TABLES / "breaking" / "counts.csv").set_index("method")
    everything, sound = methods.loc["all"], 100 * methods["ok"] / (methods["all"] - methods["refused"])
    assert (
        f"implicit_volume ends ok in {sound['implicit_volume']:.0f} %, implicit_springs in "
        f"{sound['implicit_springs']:.0f} %, xpbd_neo_hookean in {sound['xpbd_neo_hookean']:.0f} %, all methods "
        f"together in {sound['all']:.0f} %"
    ) in breaking
    shares = [round(100 * everything[name] / everything["all"]) for name in ("ok", "refused")]
    assert everything["all"] == 10_000 and "unexplained" not in everything
    for text in (breaking, limits):
        assert [int(number) for number in re.search(r"(\d+) % end ok(?:,| and) (\d+) %", text).groups()] == shares
    solved = pd.read_csv(TABLES / "breaking_reference" / "counts.csv").set_index("choice").loc["all"]
    assert (
        f"Of {solved['all']} trials with seed 0 ([the counts](../results/published/breaking_reference/counts.csv) by "
        f"element, material, kappa/mu, load and body) {solved['ok']} end ok, {solved['refused']} are refused, "
        f"{solved['not-converged']} do not converge, {solved['inverted']} invert, and {solved['timed-out']} are timed "
        "out"
    ) in breaking
    assert "unexplained" not in solved
    cut = pd.read_csv(TABLES / "breaking_cuts" / "counts.csv").set_index("kind").loc["all"]
    counted = re.search(
        r"Of ([\d,]+) trials with seed 0 [^)]+\)[^)]+\) (\d+) end ok, (\d+) are refused, (\d+) are not", breaking
    )
    numbers = [int(number.replace(",", "")) for number in counted.groups()]
    assert numbers == [cut[name] for name in ("all", "ok", "refused", "not-meshed")]


def test_how_far_forces_are_from_those_of_the_second_judge():
    rows = pd.read_csv(TABLES / "verify" / "verify.csv")
    rows = rows[rows["oracle"].str.startswith("judge_") & (rows["quantity"] == "force_end")]
    assert (rows["met"] == "yes").all() and len(rows) == 4
    shown = [
        f"{100 * off:.2f} % ({name.removeprefix('judge_')})"
        for name, off in zip(rows["oracle"], rows["deviation"], strict=True)
    ]
    text = page("docs/theory.md")
    assert f"Forces then differed by {', '.join(shown[:3])} and {shown[3]}." in text


def test_numbers_that_the_page_on_cuts_quotes():
    """The table of adaptive bodies that gape, and that of faces that touch."""
    page = (ROOT / "docs/cutting.md").read_text(encoding="utf-8")
    rows = pd.read_csv(TABLES / "cutting" / "cutting.csv")
    adaptive = rows[rows["body"].str.startswith("adaptive")].set_index(["scene", "nodes"])

    def number(scene: str, nodes: str, column: str, digits: int) -> str:
        value = float(adaptive.loc[(scene, int(nodes.replace(",", ""))), f"{column}"])
        return f"{value:.{digits}f}".replace("-0.0", "0.0")

    lines = page.split("| | ball_incised, 794 |")[1].split("\n\n")[0].splitlines()
    bodies = [cell.strip().split(", ") for cell in ("ball_incised, 794 |" + lines[0]).strip(" |").split("|")]
    table = {line.split("|")[1].strip(): [cell.strip() for cell in line.split("|")[2:-1]] for line in lines[2:]}
    assert len(bodies) == 5
    for k, body in enumerate(bodies):
        for name, column, digits in (
            ("opening, L2", "opening_error [%]", 1),
            ("force", "force_end [%]", 1),
            ("mean displacement", "mean_error [%]", 2),
        ):
            bar = number(*body, column.replace(" [", " floor ["), digits)
            assert table[name][k].lstrip("+") == f"{number(*body, column, digits)} ± {bar} %"
        assert table["times real time"][k] == f"{float(number(*body, 'real_time [s/s]', 3)):.2g}"
        assert table["rest shape / size"][k] == f"{number(*body, 'shape_error [%]', 2)} %"


CUT_BODIES = {
    "paper's surface body, 350 surface nodes": ("surface", 350),
    "one volume, 350": ("tetrahedral", 350),
    "one volume, 700": ("tetrahedral", 700),
    "cotangent, one volume per node, 350": (NODAL, 350),
    "quadratic, 594": ("quadratic, masses by stiffness", 594),
    "adaptive quadratic, 794": ("adaptive quadratic, masses by stiffness", 794),
    "adaptive quadratic, 994": ("adaptive quadratic, masses by stiffness", 994),
}


@pytest.mark.parametrize("name", CUT_BODIES)
def test_the_table_of_cuts_that_are_pressed_shut(name):
    rows = pd.read_csv(TABLES / "cutting" / "cutting.csv").set_index(["scene", "body", "nodes"])

    def cell(scene):
        if (scene, *CUT_BODIES[name]) not in rows.index:
            return "–"
        force, mean, slip = rows.loc[
            (scene, *CUT_BODIES[name]), ["force_end [%]", "mean_error [%]", "opening_error [%]"]
        ]
        return f"{force:.1f}, {mean:.1f}, {slip:.0f}".replace("-0.0", "0.0").replace("-", "−")

    assert f"| {name} | {cell('ball_cut_pressed')} | {cell('kidney_bisected')} |" in page("docs/cutting.md")


def test_numbers_of_the_surface_body_on_the_page_of_cuts():
    rows = pd.read_csv(TABLES / "cutting" / "cutting.csv").set_index(["body", "scene"]).loc["surface"]
    ball, kidney = rows["cut_ms [ms]"][["ball_bisected", "kidney_bisected"]]
    force, mean = rows.loc["kidney_bisected", ["force_end [%]", "mean_error [%]"]]
    text = page("docs/cutting.md")
    assert f"| exchange | {ball:.2f} ms | {kidney:.2f} ms |" in text
    assert f"| at rest again | −{-force:.1f}, {mean:.1f} % |" in text


@pytest.mark.parametrize("scene", ["ball_incised", "ball_bisected"])
def test_times_of_cuts_with_virtual_nodes(scene):
    rows = pd.read_csv(TABLES / "cutting" / "cutting.csv").set_index(["scene", "body", "nodes"]).loc[scene]
    part = (ROOT / "docs/cutting.md").read_text(encoding="utf-8").split(f"| {scene} | nodes that move")[1]
    lines = [line.split("|")[1:-1] for line in part.split("\n\n")[0].splitlines()[2:]]
    column = {"ball_incised": 6, "ball_bisected": 5}[scene]
    bodies = [("tetrahedral", 350), (NODAL, 350), ("tetrahedral", 700)]
    pairs = [(body + way, nodes) for body, nodes in bodies for way in ("", ", virtual nodes")]
    assert [line[column].strip() for line in lines] == [f"{rows.loc[body, 'cut_ms [ms]']:.2f}" for body in pairs]


def test_volumes_of_the_pieces_that_the_page_on_cuts_quotes():
    rows = pd.read_csv(TABLES / "cutting" / "cutting.csv").set_index(["scene", "nodes"]).loc["ball_bisected"]
    worst, both = (
        [f"{rows.loc[nodes, name] / 100:.1e}".replace("e-0", "e-") for nodes in (994, 794, 594)]
        for name in ("piece_worst [%]", "piece_sum_worst [%]")
    )
    text = page("docs/cutting.md")
    assert f"at most {worst[0]} off after the correction time with 994 nodes, {worst[1]} with 794" in text
    assert f"{worst[2]} with the uniform 594; their sum is {both[0]}, {both[1]} and {both[2]} off" in text


def test_every_reference_has_three_meshes_or_more_and_three_refined_settings():
    rows = pd.read_csv(TABLES / "reference" / "uncertainty.csv")
    assert rows["meshes"].min() == 3
    assert len(VARIANTS) == 3


def test_random_organs_are_counted_as_the_table_of_the_population_counts_them(published):
    """README's bounds are those of population.md, which are computed from the runs; a member that gets worse, or whose
    reference gets worse, counts."""

    def counts(folder):
        """Of each organ: that miss or fail, members, and those that the reference cannot decide."""
        lines = re.findall(r"^\| (\w+) \|.* (\d+) of (\d+) \| (\d+) \|$", random_organs(folder), re.M)
        return {organ: [int(number) for number in numbers] for organ, *numbers in lines}

    summary = (TABLES / "population" / "population.md").read_text(encoding="utf-8")
    text = random_organs(TABLES)
    bounds = {}
    for row in re.findall(r"^\| (\w+) \| adaptive [^|]*, 1594 \| (.+) \|$", summary, re.M):
        cells = row[1].split(" | ")
        spreads = (re.findall(r"[\d.]+", cell) for cell in (cells[2], cells[5]) if cell != "–")
        bounds[row[0]] = [number for bound, _, high in spreads for number in (bound, high)]
        assert sum(map(int, cells[0].split(", "))) == counts(TABLES)[row[0]][1], "judged and failed"
    assert len(bounds) == 5 and [len(bound) for bound in bounds.values()] == [4, 4, 4, 2, 2]
    for organ, bound in bounds.items():
        quoted = re.findall(r"[\d.]+", re.findall(rf"^\| {organ} \|(.*?\|.*?)\|", text, re.M)[0])
        assert [float(number) for number in quoted] == pytest.approx([float(b) for b in bound], rel=0.06)
    assert [count[0] for count in counts(TABLES).values()] == [4, 0, 0, 1, 0]
    assert counts(TABLES)["kidney"] == [0, 100, 0]
    path = published / "population" / "population.csv"
    rows = pd.read_csv(path)
    kidney = (rows["scene"] == "kidney_0_000") & (rows["nodes"] == 1594)
    worse = {"mean_error [%]": 1.01, "status": "inverted", "shape_error [%]": 1.01, "mean_error floor [%]": 1.0}
    expected = ([1, 100, 1], [1, 100, 0], [1, 100, 0], [0, 100, 1])
    for (name, value), count in zip(worse.items(), expected, strict=True):
        rows.assign(**{name: rows[name].mask(kidney, value)}).to_csv(path, index=False)
        assert counts(published)["kidney"] == count, name


def test_counts_that_the_page_of_random_organs_quotes():
    """How often references are not known well enough, forces still vary at the end, and 1,194 nodes are too few."""
    rows = pd.read_csv(TABLES / "population" / "population.csv")
    rows = rows[rows["body"].str.startswith("adaptive")]
    rows["organ"] = rows["scene"].str.split("_").str[0]
    hollow = rows["organ"].isin(["stomach", "bladder"])
    targets = {"force_end": hollow.map({True: 6.0, False: 3.0}), "mean_error": hollow.map({True: 3.0, False: 1.0})}
    sizes = {name: rows[f"{name} [%]"].abs() for name in targets}
    bars = {name: rows[f"{name} floor [%]"] for name in targets}
    finest = rows["nodes"] == 1594

    def count(which):
        counts = which.groupby(rows["organ"]).sum()
        return {organ: int(number) for organ, number in counts.items() if number}

    coarse_bars = {name: count(finest & (bars[name] > targets[name] / 3.0)) for name in targets}
    assert coarse_bars == {"force_end": {"liver": 13}, "mean_error": {"kidney": 9, "liver": 35, "spleen": 10}}
    beyond, reaches = (
        finest & np.logical_or(*(sizes[name] + sign * bars[name] > targets[name] for name in targets))
        for sign in (-1.0, 1.0)
    )
    assert rows["scene"][beyond].tolist() == ["spleen_0_006", "liver_0_086"]
    assert count(reaches & ~beyond) == {"liver": 28, "spleen": 9}
    assert count(finest & (rows["sway [%]"] > 1.0)) == {"liver": 21, "stomach": 35}
    coarser = {name: count((rows["nodes"] == 1194) & (sizes[name] > targets[name])) for name in targets}
    assert coarser == {"force_end": {"liver": 3}, "mean_error": {"liver": 26, "spleen": 9}}
    near = (sizes["mean_error"] <= 1.0) & (sizes["mean_error"] + bars["mean_error"] > 1.0)
    assert count(finest & near)["spleen"] == 9
    within = {}
    for organ in ("liver", "kidney"):
        some = rows[finest & (rows["organ"] == organ)][["force_end [%]", "mean_error [%]"]].abs()
        within[organ] = int((some <= some.quantile(0.95)).all(axis=1).sum())
    assert within == {"liver": 92, "kidney": 90}
    text = page("docs/population.md")
    for words in (
        "95 of 100 livers are within 1.7 % in force, 95 within 0.95 % in mean displacement, and 92 within both",
        "it is 1.3 %, 0.32 % and 90 of 100",
        "29 are within 1 % with 1,594 nodes, nine of them by less than the uncertainty",
        "for 35 of 100 livers, 9 of 100 kidneys and 10 of 30 spleens, in force for 13 of 100 livers",
        "28 livers and 9 spleens may be on either side",
        "the force of 21 livers and 35 stomachs still varies by 1 to 2 %",
        "3 of 100 livers miss the target in force (up to 4.3 %) and 26 in mean displacement",
        "two of 310 bodies, spleen_0_006 and liver_0_086, and both are named",
    ):
        assert words in text


def test_times_of_random_organs_scaled_by_their_steps():
    rows = pd.read_csv(TABLES / "population" / "population.csv")
    rows = rows[rows["nodes"] == 1594].assign(organ=lambda rows: rows["scene"].str.split("_").str[0])
    timed = rows.dropna(subset="real_time [s/s]").set_index("organ")
    assert (timed["scene"] == timed.index + "_0_000").all() and len(timed) == 5
    text = page("docs/population.md")
    for organ, dt in rows.groupby("organ")["dt [ms]"]:
        least, most = (timed["dt [ms]"] / timed["real_time [s/s]"])[organ] / dt.agg(["max", "min"])
        assert re.search(rf"{organ}s (?:take )?{least:.1f} to {most:.1f} s", text), organ


def test_cost_of_our_quadratic_body_in_the_league():
    rows = pd.read_csv(TABLES / "league" / "league.csv").set_index("engine").loc["ours-quadratic"]
    assert f"needs {rows['cost [s/s]'].min():.1f} to {rows['cost [s/s]'].max():.1f} s for" in page("docs/league.md")


def test_methods_of_the_page_are_those_of_the_tuple():
    page = (ROOT / "docs/methods.md").read_text(encoding="utf-8").split("## Claims")[1].split("## ")[0]
    named = re.findall(r"^\| (\w+) \|", page, re.M)
    assert {method.name for method in METHODS} <= set(named)


def test_numbers_that_the_page_quotes_of_the_warning():
    lines = (TABLES / "population" / "trust.md").read_text(encoding="utf-8").splitlines()
    rows = {line.split(" | ")[0].strip("| "): [int(n) for n in re.findall(r"\d+", line)] for line in lines[2:]}
    counts = rows["all"]
    assert len(counts) == 10, "of the members on which the rule was chosen, of the others, of bodies with fewer nodes"
    beyond, named, within, doubted = (counts[k] + counts[k + 4] for k in range(4))
    share = f"{doubted / within:.0%}".replace("%", " %")
    text = page("docs/population.md")
    assert f"It names {named} of {beyond} and doubts {doubted} of {within} ({share})" in text
    later = f"of the {counts[4] + counts[6]} members drawn later {counts[4]} are beyond, and it names {counts[5]}"
    assert later in " ".join(text.split())
    for organ in ("liver", "spleen"):
        missed, alike = rows[organ][-2:]
        assert f"{missed} {organ}s miss the target, {alike} of them" in text
    brief = page("docs/accuracy.md")
    assert f"named {named} of {beyond} bad bodies and doubted {doubted} of {within} good ones ({share})" in brief
