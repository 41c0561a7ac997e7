"""An exported scene, read with meshio, json and csv alone: it has all that another program needs."""

import csv
import json
import re
import shutil
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import meshio
import numpy as np
import pandas as pd
import pytest

from massspring import Capsule, Probe
from studies.exchange.description import description, judged_metrics
from studies.exchange.export import DIGITS, export, marks, paths_table, rounded
from studies.exchange.words import obstacle_words
from studies.runs.recipe_text import body_words
from studies.scene.library import CUT, SCENES
from studies.scene.library.ball_clamped import BALL_CLAMPED, CAP, PUSH, RADIUS
from studies.scene.library.ball_squeeze import BALL_SQUEEZE
from studies.tools.advise import campaign
from studies.tools.advise.answer import advise

NODES = 150
EXPORTED = [scene for scene in (*SCENES, *CUT) if len(scene.cuts) < 2]
"""Several cuts are refused."""
TABLE = Path(__file__).parents[3] / "results" / "published" / "accuracy" / "accuracy.csv"


@pytest.fixture(scope="module")
def folder(tmp_path_factory, mesh_cache):
    return tmp_path_factory.mktemp("export") / "scene"


@pytest.fixture
def exported(organbench, folder):
    """The clamped ball, by the command line, with the published table and no runs."""
    published = folder.parent / "results" / "published" / "accuracy"
    published.mkdir(parents=True, exist_ok=True)
    shutil.copy(TABLE, published)
    results = folder.parent / "results"
    code, out, err = organbench("export", "ball_clamped", "-o", folder, "--nodes", NODES, "--results", results)
    assert code == 0 and not err
    assert sorted(out.split()) == sorted(str(path) for path in folder.iterdir())
    return folder


def volume(points, cells):
    a, b, c, d = points[cells].transpose(1, 0, 2)
    return np.einsum("ij,ij->i", b - a, np.cross(c - a, d - a)) / 6


def test_meshes_fit_the_ball_and_each_other(exported):
    data = json.loads((exported / "scene.json").read_text())
    straight, curved = (meshio.read(exported / data["meshes"][kind]["file"]) for kind in ("straight", "curved"))
    (cells,), (quadratic,) = ([block.data for block in mesh.cells] for mesh in (straight, curved))
    assert [block.type for block in (*straight.cells, *curved.cells)] == ["tetra", "tetra10"]
    assert (volume(straight.points, cells) > 0).all() and (volume(curved.points, quadratic[:, :4]) > 0).all()
    assert volume(straight.points, cells).sum() == pytest.approx(data["meshes"]["straight"]["volumes"]["whole"])
    # Each middle node lies between the right corners, bent outward by the height of its arc at most.
    for middle, (i, j) in enumerate([(0, 1), (1, 2), (2, 0), (0, 3), (1, 3), (2, 3)], 4):
        ends = curved.points[quadratic[:, [i, j]]]
        length = np.linalg.norm(ends[:, 1] - ends[:, 0], axis=1)
        assert (np.linalg.norm(curved.points[quadratic[:, middle]] - ends.mean(axis=1), axis=1) < 0.3 * length).all()
    for mesh in (straight, curved):
        outer = mesh.point_data["outer"] == 1
        assert np.linalg.norm(mesh.points[outer], axis=1) == pytest.approx(RADIUS, rel=1e-6)
        assert (np.linalg.norm(mesh.points[~outer], axis=1) < 0.999 * RADIUS).all()


def test_held_nodes_are_the_caps_and_move_as_the_scene_says(exported):
    data = json.loads((exported / "scene.json").read_text())
    bottom, top = data["held"]
    for mesh in (meshio.read(exported / name) for name in ("straight.vtu", "curved.vtu", "surface.vtu")):
        z = mesh.points[:, 2]
        outer = mesh.point_data.get("outer", np.ones(len(z)))
        for region, height in ((bottom, -z), (top, z)):
            marked = mesh.point_data[region["point_data"]] == 1
            assert marked.sum() >= 5 and (height[marked] > (CAP - 1e-6) * RADIUS).all()
            assert not ((height > (CAP + 1e-6) * RADIUS) & (outer == 1) & ~marked).any()
    assert top["path"]["displacements"][-1] == pytest.approx([0, 0, -PUSH * RADIUS])
    assert "(0, 0, -0.0125) m at 3 s" in top["path"]["words"] and "does not move" in bottom["path"]["words"]
    with (exported / "paths.csv").open() as file:
        rows = {float(row["t"]): float(row["held_top_z"]) for row in csv.DictReader(file)}
    assert set(data["checkpoints"]) <= set(rows)
    assert {t: rows[t] for t in (0.0, 1.5, 3.0, 4.0)} == pytest.approx({0: 0, 1.5: -0.00625, 3: -0.0125, 4: -0.0125})


def test_the_surface_is_closed_and_shares_its_nodes(exported):
    surface, straight = (meshio.read(exported / f"{name}.vtu") for name in ("surface", "straight"))
    ((_, triangles),) = [(block.type, block.data) for block in surface.cells]
    assert np.array_equal(surface.points, straight.points[: len(surface.points)])
    edges = np.sort(triangles[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2), axis=1)
    assert (np.unique(edges, axis=0, return_counts=True)[1] == 2).all()
    a, b, c = surface.points[triangles].transpose(1, 0, 2)
    assert (np.einsum("ij,ij->i", np.cross(b - a, c - a), a + b + c) > 0).all()


def test_the_export_names_material_times_and_what_is_judged(exported):
    data = json.loads((exported / "scene.json").read_text())
    assert (data["schema"], data["version"]) == ("organbench-scene", 1)
    assert data["material"]["shear_modulus"] == 1800.0 and data["material"]["bulk_modulus"] == 5000 * 1800.0
    assert data["material"]["density"] == 1060.0 and data["damping"]["rate"] == 15.0
    assert data["checkpoints"] == [0.6, 1.2, 1.8, 2.4, 4.0] == pytest.approx(list(BALL_CLAMPED.checkpoints))
    judged = {metric["name"]: metric for metric in data["judged"]}
    assert {"force_end", "surface_error", "volume_worst"} <= set(judged) and "frequency_error" not in judged
    assert all(metric["unit"] and "[" in metric["definition"] for metric in judged.values())
    page = (exported / "README.md").read_text()
    assert "organbench judge ball_clamped FILE --nodes 150" in page and "{" not in page
    for phrase in ("metres", "mu = 1800 Pa", "held_top", *judged, "positive in compression"):
        assert phrase in page


def test_the_page_holds_what_our_own_bodies_reach(exported, tmp_path, organbench, mesh_cache, monkeypatch):
    page = (exported / "README.md").read_text()
    table = pd.read_csv(TABLE).query("scene == 'ball_clamped' and body == 'surface' and nodes == 550")
    (paper,) = re.findall(r"the paper's body: surface, 550 surface nodes \| (\S+) ± \S+ \| (\S+) ± ", page)
    assert [float(cell.replace("−", "-")) for cell in paper] == [
        pytest.approx(table[column].item(), abs=0.06) for column in ("force_end [%]", "mean_error [%]")
    ]
    chosen = advise("ball_clamped", results=exported.parent / "results", timing=False).chosen
    assert chosen is not None and f"| recommended: {body_words(chosen.case.body)} surface nodes | " in page
    words = ("export", "ball_clamped", "-o", tmp_path / "out", "--nodes", NODES, "--results", tmp_path)
    assert organbench(*words)[2] == "" and (tmp_path / "out" / "README.md").read_text() == page
    monkeypatch.setattr(campaign, "PACKAGE", tmp_path / "nowhere" / "studies")
    code, _, err = organbench(*words)
    assert code == 0 and "warning: README.md names no measured body: no results" in err
    assert "No measured body of ours was at hand" in (tmp_path / "out" / "README.md").read_text()


@pytest.mark.parametrize("scene", EXPORTED, ids=lambda scene: scene.name)
def test_every_scene_has_words_for_all_that_happens_and_numbers_as_people_write_them(scene):
    data, paths = description(scene, [], ""), paths_table(scene)
    assert json.dumps(data, allow_nan=False) and data["force"]["words"]
    assert len(data["obstacles"]) == len(scene.obstacles) and all(entry["words"] for entry in data["obstacles"])
    assert [metric["name"] for metric in data["judged"]] == [metric.name for metric in judged_metrics(scene)]
    assert ("lumen_volume_factor" in paths) == (scene.lumen is not None)
    text = json.dumps(rounded(data)) + paths.to_csv(float_format=f"%.{DIGITS}g")
    numbers = re.findall(r"-?\d+\.?\d*(?:e-?\d+)?", text)
    assert not [number for number in numbers if len(number.lstrip("-").replace(".", "")) > DIGITS + 4]
    assert not re.search(r"(?<![\d.e])-0(\.0)?(?![\d.])", text)
    assert np.allclose(rounded(data)["checkpoints"], scene.checkpoints, rtol=1e-11)


PLANE = BALL_SQUEEZE.obstacles[0]
OBSTACLES = {
    "plane through (0, 0, 0.05) m with normal (0, 0, -1)": PLANE,
    "no slip": replace(PLANE, friction="no_slip"),
    "coefficient 0.3": replace(PLANE, friction=0.3),
    "capsule of radius 0.01 m from (0, 0, 0) m to (0, 0, 1) m": Capsule((0, 0, 0), (0, 0, 1), 0.01),
    "thin probe": Probe((0, 0, 1)),
}


def test_words_of_obstacles_tell_shape_friction_and_path():
    assert all(words in obstacle_words(obstacle) for words, obstacle in OBSTACLES.items())


def test_nodes_of_the_surface_of_a_lumen_are_marked():
    wall = SimpleNamespace(hollow=True, outer_count=3, surface_count=5)
    found = marks(SimpleNamespace(points=np.zeros((7, 3)), mesh=wall, held_nodes=dict))
    assert {name: np.flatnonzero(values).tolist() for name, values in found.items()} == {
        "outer": [0, 1, 2],
        "lumen": [3, 4],
    }


REFUSED = {
    "unknown scene 'ball_squeze'; did you mean": ("ball_squeze",),
    "there is no file": ("none.py",),
    "defines neither STUDY nor SCENE": ("empty.py",),
    "is a file; give the name of a folder": ("ball_squeeze", "-o", "empty.py"),
    "holds other files; give a new folder": ("ball_squeeze", "-o", "full"),
    "nodes": ("ball_squeeze", "-o", "few", "--nodes", 3),
}


@pytest.mark.parametrize("message", REFUSED)
def test_what_cannot_be_exported_is_refused(refused, tmp_path, monkeypatch, message):
    monkeypatch.chdir(tmp_path)
    Path("empty.py").write_text("")
    Path("full").mkdir()
    Path("full/README.md").write_text("mine")
    assert message in refused("export", *REFUSED[message])
    assert Path("full/README.md").read_text() == "mine"


def test_an_export_replaces_an_earlier_one_but_no_program_that_was_edited(tmp_path, mesh_cache):
    export(BALL_SQUEEZE, tmp_path, NODES)
    (tmp_path / "solve.py").write_text("mine")
    for name in ("cut_straight.csv", "result.npz"):
        (tmp_path / name).write_text("")
    (tmp_path / "README.md").write_text("old")
    written, _ = export(BALL_SQUEEZE, tmp_path, NODES)
    assert (tmp_path / "solve.py").read_text() == "mine" and tmp_path / "solve.py" not in written
    assert (tmp_path / "README.md").read_text() != "old" and (tmp_path / "result.npz").exists()
    assert not (tmp_path / "cut_straight.csv").exists()
