"""The page "your own organ" is followed line by line, on a synthetic organ written as a damaged scan."""

import importlib.util
import json
import re
import shlex
from pathlib import Path

import meshio
import numpy as np
import pytest

from studies.cli.commands import place
from studies.geometry import organ, read_mesh
from studies.meshing.rest_surface import rest_surfaces
from studies.meshing.scene_mesh import mesh_for
from studies.meshing.true_surface import ShapeErrors, shape_errors
from studies.runs.prepare import mesh_of
from studies.runs.recipes import TetrahedralBody
from studies.scene.chosen_place import DEPTH
from studies.scene.scene import ReferencePlan
from studies.scene.scene_file import file_in_python
from studies.scene.tissues import SPLEEN
from studies.tools.advise.campaign import shipped
from studies.tools.advise.population import supported
from tests.studies.geometry.boxes import box, together
from tests.studies.report.page.unpack import unpack_frames

PAGE = Path(__file__).parents[4] / "docs" / "own-organ.md"
COMMANDS = re.findall(r"^    organbench (.+)$", PAGE.read_text(encoding="utf-8"), re.MULTILINE)
CODES = {"mesh --check scan.ply": 1}
"""Exit codes other than 0."""
KIDNEY = 0.105
"""Its length [m]."""


@pytest.fixture(scope="module")
def kidney(mesh_cache):
    """The organ that hides in the scan."""
    return organ("kidney", 1000, fill=False, exact=True)


@pytest.fixture
def scan_file(kidney, tmp_path, monkeypatch):
    """A damaged scan of it in the current folder: millimetres, a speck, some triangles turned, a few missing."""
    faces = kidney.triangles.copy()
    faces[100:160] = faces[100:160, ::-1]
    low = kidney.points[faces].mean(axis=1)[:, 2].argsort()
    faces = np.delete(faces, low[:3], axis=0)
    speck = box((0.2, 0.2, 0.2), (0.203, 0.203, 0.203))
    points, faces = together((kidney.points, faces), speck)
    monkeypatch.chdir(tmp_path)
    meshio.write_points_cells("scan.ply", 1e3 * points, [("triangle", faces.astype(np.int32))])
    return tmp_path / "scan.ply"


SMALLER = {
    r"ReferencePlan\(\)": "ReferencePlan(base=150, at_contact=1, most=8e3, variants=())",
    r"nodes=\d+": "nodes=594",
    r"frames=240": "frames=60",
}
"""Changes to the scene file: it runs in two minutes, on small reference meshes, with bodies as coarse as can be."""


@pytest.mark.campaign
@pytest.mark.filterwarnings("ignore::UserWarning")
@pytest.mark.parametrize("whole", [False, True])
def test_the_page_is_followed(organbench, scan_file, kidney, whole):
    """Up to what the run would be, and to its report."""
    folder = scan_file.parent
    scene_file = folder / "my_scene.py"
    words = ["mesh", "mesh", "mesh", "place", "run", "run", "show", "table", "report"]
    assert [line.split()[0] for line in COMMANDS] == words
    for line in COMMANDS if whole else COMMANDS[: words.index("run") + 1]:
        if line == "run my_scene.py":
            make_smaller(scene_file)
        code, out, err = organbench(*shlex.split(line))
        assert code == CODES.get(line, 0), f"organbench {line}: {out}{err}"
        if line.startswith("place"):
            assert re.search(r"which takes about \d+ minutes\n$", out)
    body = read_mesh(folder / "body.vtu")
    assert len(body.tetrahedra) and body.volume == pytest.approx(kidney.volume, rel=5e-3)
    assert (folder / "my_scene.png").stat().st_size > 10_000
    if whole:
        check_page((folder / "results" / "report.html").read_text(encoding="utf-8"))
    # Held alike on every mesh: the outline of the region is on the edges.
    scene = loaded(scene_file).SCENE
    region = scene.regions["end"]
    for nodes in (150, 200) if whole else (150,):
        mesh = mesh_for(scene, nodes)
        level = region.level(mesh.points[: mesh.surface_count])[mesh.triangles]
        assert not ((level > 1e-8).any(axis=1) & (level < -1e-8).any(axis=1)).any()
        assert mesh.volume == pytest.approx(body.volume, rel=2e-3)


def make_smaller(scene_file):
    text = scene_file.read_text()
    for pattern, small in SMALLER.items():
        assert re.search(pattern, text), pattern
        text = re.sub(pattern, small, text)
    scene_file.write_text(text)


def check_page(text):
    """Three charts, and both bodies moving next to the reference."""
    for chart in ("volume", "force", "accuracy"):
        assert re.search(rf'<figure class="chart"[^>]*aria-label="[^"]*: {chart}"', text), chart
    data = json.loads(re.search(r'<script type="application/json" id="data">(.*?)</script>', text, re.DOTALL)[1])
    cases = [number for number, case in data["cases"].items() if case["scene"] == "scan"]
    assert len(cases) == 2
    for number in cases:
        replay = data["pieces"][f"case-{number}"]["replay"]
        shown = unpack_frames(replay["positions"])
        depth = np.linalg.norm(shown - shown[0], axis=-1).max(axis=1)
        # The probe goes in by DEPTH of the length; nodes next to its pole move less, the free end moves farther.
        assert len(shown) >= 40 and depth[0] == 0 and 0.8 * DEPTH < depth[-1] / KIDNEY < 3 * DEPTH
        assert replay["comparable"] and replay["reference"] and not replay["straight"]


def loaded(path):
    """A scene file as a module."""
    spec = importlib.util.spec_from_file_location("my_scene", path)
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def test_a_scene_file_holds_the_tissue_the_hold_and_the_advised_body(organbench, scan_file):
    """Of an open file, whose holes are closed for the scene too."""
    scan_file.rename("spleen_mask.ply")
    words = ("spleen_mask.ply", "--unit", "mm", "--nodes", 200, "--hold", "bottom", "--smooth", 1)
    code, out, err = organbench("place", *words, "--close-holes", "-o", "placed.py")
    assert code == 0, err
    tissue = "tissue: spleen, shear modulus 3.6 kPa, as the file is called; --tissue names another"
    assert out.startswith(f"{tissue}\n  source: {SPLEEN.source}\n")
    promise = re.search(
        r"\n  (53 of 56 random livers \(27 more undecided\): force within .* %, mean displacement within .* %)\n",
        out,
    )
    assert promise and promise[1] in (scan_file.parent / "placed.py").read_text()
    study = loaded(scan_file.parent / "placed.py").STUDY
    two, one = study.cases
    assert one.scene == two.scene and one.scene.tissue == SPLEEN
    assert one.scene.held[0].region.normal == (0, 0, 1) and "held at the bottom" in one.scene.title
    parameters = one.scene.organ.parameters
    assert parameters["holes"] is True and parameters["smooth"] == 1e-3 and parameters["unit"] == "mm"
    case, _ = supported(shipped(), one.scene, "spleen")
    assert (two.body, two.dt_fraction) == (case.body, case.dt_fraction) and two.timed
    shape = shape_errors(two.scene.organ, facets_at_rest(two), True)
    assert shape.worst < 1.0 and f"it is {shape} (allowed" in out
    assert re.search(rf"\n  volume: file [\d.]+ mL, body [\d.]+ mL \({100 * shape.volume:+.3f} %\)\n", out)
    assert one.body == TetrahedralBody(nodes=200) and [case.recorded for case in study.cases] == [("surface",)] * 2
    # What the estimate rests on.
    assert one.scene.reference == ReferencePlan()


@pytest.mark.parametrize("shares", [(0.5,), (3.0, 2.0, 0.5), (3.0, 2.5, 2.0)])
def test_thin_margins_ask_for_more_nodes_and_a_finer_reference(organbench, scan_file, monkeypatch, shares):
    """Bodies that exceed the bound of the shape by known factors, one after the other."""
    errors = iter([ShapeErrors(1e-2 * share, 0.0) for share in shares])
    monkeypatch.setattr(place, "mesh_of", lambda scene, body: mesh_for(scene, 150))
    monkeypatch.setattr(place, "shape_errors", lambda *_, **__: next(errors))
    code, out, err = organbench("place", "scan.ply", "--unit", "mm", "--close-holes", "--tissue", "kidney")
    assert code == 0
    case = loaded(scan_file.parent / "scene.py").CASES[0]
    first = supported(shipped(), case.scene, "kidney")[0].body.nodes
    finer = [first, 10 * round(0.15 * first), 10 * round(0.15 * 10 * round(0.15 * first))][: len(shares)]
    assert case.body.nodes == finer[-1] and "volume: file" in out
    assert case.scene.reference.base == (270 if len(shares) == 1 else 1000)
    minutes = int(re.search(r"takes about (\d+) minutes", out)[1])
    assert minutes == 3 if len(shares) == 1 else minutes > 4
    enough = re.search(r"about ([\d,]+) nodes would do", out)
    assert ("part of the shape is missing" in err) == (shares[-1] > 1) == (enough is not None)
    assert enough is None or 1.0 <= int(enough[1].replace(",", "")) / (shares[-1] * finer[-1]) < 1.1


def facets_at_rest(case):
    mesh = mesh_of(case.scene, case.body)
    return rest_surfaces(mesh.points, mesh.facets)


def test_a_mesh_file_elsewhere_is_named_by_its_whole_path(tmp_path):
    beside, elsewhere = tmp_path / "mine" / 'a "b".stl', tmp_path / "scan.stl"
    assert file_in_python(elsewhere, tmp_path / "mine") == f'Path("{elsewhere}")'
    assert file_in_python(beside, tmp_path / "mine") == r'Path(__file__).parent / "a \"b\".stl"'


def test_bad_input_is_one_sentence(refused, scan_file, tmp_path):
    cases = {
        ("place", "scan.ply", "--unit", "mm", "-o", "scene.txt"): "a scene file is Python",
        ("place", "scan.ply", "--unit", "mm", "--picture", "a.jpg"): "the picture is a PNG",
        ("place", "liver.ply", "--unit", "mm"): "there is no mesh file",
        ("place", "scan.ply", "--unit", "mm"): "scan does not name its organ; say which tissue it is: --tissue",
        ("place", "scan.ply", "--unit", "mm", "--tissue", "brain"): "unknown tissue 'brain'",
        ("place", "scan.ply", "--unit", "mm", "--hold", "topp"): "unknown side 'topp'; did you mean 'top'",
        ("place", "scan.ply", "--unit", "mm", "--probe", "1;2;3"): "'1;2;3' is not a place; give x,y,z in mm",
        ("place", "scan.ply", "--unit", "mm", "--probe", "1,nan,3"): "give finite numbers",
    }
    before = sorted(p.name for p in tmp_path.iterdir())
    for words, message in cases.items():
        assert message in refused(*words)
        assert sorted(p.name for p in tmp_path.iterdir()) == before
