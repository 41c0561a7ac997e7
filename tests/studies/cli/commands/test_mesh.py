"""`organbench mesh` and `organbench mesh --check`: files in, files out, one sentence for bad input.

The advice of a check is tried: its command makes a clean body, or the output lists what was tried.
"""

import json
import os
import re
import shlex

import meshio
import nibabel
import numpy as np
import pytest

from studies.base.errors import StudyError
from studies.cli import mesh_files as commands
from studies.cli.commands.mesh import Made, closeness
from studies.geometry import organ, read_mesh, vary
from studies.geometry.mesh.organ_mesh import signed_volume
from studies.geometry.mesh.quality import curved_volume
from studies.geometry.organs import make_shape
from studies.geometry.surface.first_surface import true_volume
from studies.scene.scene import Organ
from tests.studies.geometry.boxes import box, split, together

EGG = split(*box((-1, -1, -1), (1, 1, 1)), times=3)
POINTS = EGG[0] / np.linalg.norm(EGG[0], axis=1, keepdims=True) * (30, 25, 20)
FACES = EGG[1]


@pytest.fixture
def egg(tmp_path):
    """A sound surface in millimetres."""
    return stored(tmp_path / "egg.ply", POINTS, FACES)


def stored(path, points, faces):
    meshio.write_points_cells(path, points, [("triangle", np.asarray(faces, np.int32))])
    return path


def test_the_number_that_is_named_has_been_tried():
    """The first number gives no mesh, the second a mesh that does not keep the shape; the third one keeps it."""
    few, many = (Made(organ("ball", nodes, fill=False, exact=True), None) for nodes in (60, 300))
    truth, counts = Organ("ball", {}), []

    def answers(*given):
        def make(count):
            counts.append(count)
            answer = given[min(len(counts), len(given)) - 1]
            if answer is None:
                raise StudyError("no surface is well shaped")
            return answer

        return make

    assert "nodes" not in closeness(many, truth, answers())
    assert closeness(few, truth, answers(None, few, many)).endswith(
        f"; {counts[2]:,} nodes keep it within 1 % and 0.5 %"
    )
    assert len(counts) == 3 and few.mesh.outer_count < counts[0] < counts[1] < counts[2]
    counts.clear()
    sentence = closeness(few, truth, answers(few))
    assert sentence.endswith(f"; {counts[-1]:,} nodes do not keep it within 1 % and 0.5 % either")


@pytest.mark.campaign
def test_an_organ_is_meshed_without_faults(organbench, tmp_path):
    target = tmp_path / "kidney.vtu"
    code, out, err = organbench("mesh", "kidney", "--nodes", 200, "--seed", 3, "-o", target)
    assert code == 0 and "warning" not in err
    shape, body = out.splitlines()[0], out[out.index("kidney") :]
    assert re.fullmatch(r"shape: up to 0\.\d+ % of the size off the true surface, volume [+-]0(\.0\d*)? %", shape)
    assert body.startswith("kidney: 200 outer nodes, 396 outer triangles, ")
    assert out.strip().endswith(f"written to {target} in metres")
    made = read_mesh(target)
    assert made.surface_count == 200 and "hilum" in made.patches
    code, out, _ = organbench("mesh", "--check", target)
    assert code == 0 and "no faults found" in out
    # Of the kidney with this seed.
    volume, usual = (true_volume(make_shape("kidney", given)) for given in (vary("kidney", 3), {}))
    assert made.volume == pytest.approx(volume, rel=1e-3) != pytest.approx(usual, rel=0.01)


def test_a_file_is_mended_remeshed_and_filled(organbench, tmp_path):
    speck = box((60, 60, 60), (62, 62, 62))
    path = stored(tmp_path / "scan.stl", *together((POINTS, FACES[:, ::-1]), speck))
    target = tmp_path / "scan.vtu"
    code, out, err = organbench("mesh", "--from", path, "--unit", "mm", "--nodes", 150, "-o", target)
    assert code == 0 and "150 outer nodes" in out
    assert "scan.stl: 1 of 2 separate parts are left out" in err and "inverted and has been flipped" in err
    made = read_mesh(target)
    assert made.volume == pytest.approx(1e-9 * signed_volume(POINTS, FACES), rel=1e-3)
    assert organbench("mesh", "--check", target)[0] == 0
    # What was lost is printed.
    assert "file to mesh: mean 0." in out and "mesh to file: mean 0." in out and "% of the diagonal) at (" in out
    assert re.search(r"volume: file \S+ mL, mesh \S+ mL \([+-]0\.0", out)


def test_curved_elements_on_request(organbench, tmp_path):
    target = tmp_path / "ball.vtu"
    code, out, _ = organbench("mesh", "ball", "--nodes", 150, "--order", 2, "--wall", 8, "-o", target)
    assert code == 0 and out.startswith("shape: up to 0.0")
    read = meshio.read(target)
    volume = curved_volume(read.points, read.cells_dict["tetra10"])
    # That of the curved body; flat sides between the same vertices enclose 4 % less.
    assert f"tissue {1e6 * volume:.4g} mL" in out
    assert f"lumen {1e6 * (4 / 3 * np.pi * 0.042**3):.3g}" in out


def test_findings_and_their_exit_code(organbench, tmp_path):
    path = stored(tmp_path / "open.ply", 1e-3 * POINTS, FACES[3:])
    code, out, err = organbench("mesh", "--check", path)
    assert (code, err) == (1, "")
    assert "so it has no inside and no volume" in out
    assert "-> organbench mesh --from FILE --close-holes" in out
    code, out, _ = organbench("mesh", "--check", path, "--json")
    report = json.loads(out)
    assert code == 1 and not report["clean"] and report["findings"][0]["code"] == "open"
    assert report["measures"]["open_edges"] == report["findings"][0]["count"] > 0
    closed = tmp_path / "closed.ply"
    assert organbench("mesh", "--from", path, "--close-holes", "-o", closed)[0] == 0
    assert organbench("mesh", "--check", closed)[0] == 0


def wrong_options(folder):
    """Arguments for an egg, or for no file, and the message expected."""
    egg = stored(folder / "egg.ply", POINTS, FACES)
    out, scan = ("-o", folder / "out.vtu"), ("mesh", "--from", egg, "--unit", "mm")
    return {
        "nothing to mesh": (("mesh", *out), "name what to mesh"),
        "both": (("mesh", "ball", "--from", egg, *out), "name what to mesh"),
        "unknown organ": (("mesh", "livr", *out), "did you mean 'liver'"),
        "unit": (("mesh", "--from", egg, *out), "does not say its unit; its longest side is 60"),
        "odd unit": (("mesh", "--from", egg, "--unit", "ft", *out), "unit 'ft' is not known"),
        "itself": ((*scan, "-o", egg), "egg.ply is the file that is read"),
        "suffix": ((*scan, "-o", folder / "out.xyz"), "choose one of these suffixes"),
        "filled stl": ((*scan, "--fill", "-o", folder / "out.stl"), "holds triangles only"),
        "curved stl": ((*scan, "--order", 2, "-o", folder / "out.stl"), "curved elements (--order 2) fill a body"),
        "curved scan": ((*scan, "--order", 2, *out), "true shape is not known, so it cannot be curved"),
        "seed": ((*scan, "--seed", 1, *out), "--seed varies synthetic organs"),
        "options": (("mesh", "ball", "--smooth", 2, "--close-holes", *out), "--smooth and --close-holes are for files"),
        "solid": (("mesh", "liver", "--wall", 3, *out), "the liver is solid; --wall is for ball"),
        "thick wall": ((*scan, "--nodes", 150, "--wall", 30, *out), "does not fit into it"),
        "wall of a file": ((*scan, "--wall", 3, *out), "set its number of nodes"),
        "few nodes": ((*scan, "--nodes", 10, *out), "10 surface nodes asked for"),
        "no nodes": (("mesh", "ball", "--nodes", 0, *out), "invalid value for '--nodes'"),
        "few nodes of an organ": (("mesh", "liver", "--nodes", 20, *out), "20 surface nodes asked for"),
        "folder": (("mesh", "ball", "--nodes", 150, "-o", folder / "egg.ply" / "out.vtu"), "was not written"),
        "missing": (("mesh", "--check", folder / "none.ply"), "there is no mesh file"),
    }


def no_mesh(folder):
    """Arguments for files that hold none, or half of one, and the message expected."""
    torn = stored(folder / "torn.ply", POINTS, FACES[3:])
    text = folder / "notes.stl"
    text.write_text("no mesh at all\n" * 20)
    huge = folder / "huge.stl"
    with open(huge, "wb") as file:
        file.write(bytes(80) + np.uint32(10_000_000).tobytes())
        file.truncate(84 + 500_000_000)
    out = ("-o", folder / "out.vtu")
    return {
        "open": (("mesh", "--from", torn, "--unit", "mm", "--nodes", 150, *out), "close the holes (--close-holes)"),
        "text": (("mesh", "--from", text, "--unit", "mm", *out), "notes.stl"),
        "text checked": (("mesh", "--check", text), "notes.stl"),
        "huge": (("mesh", "--from", huge, "--unit", "mm", *out), "say --yes to go on"),
        "huge checked": (("mesh", "--check", huge), "say --yes to go on"),
        "checked and made": (("mesh", "ball", "--check", torn), "--check FILE makes no mesh"),
    }


def test_bad_input_is_one_sentence_and_nothing_is_written(refused, tmp_path):
    cases = wrong_options(tmp_path) | no_mesh(tmp_path)
    before = sorted(os.listdir(tmp_path))
    for case, (words, message) in cases.items():
        assert message in refused(*words), case
        assert sorted(os.listdir(tmp_path)) == before, case


def test_on_a_terminal_it_asks_for_the_unit_and_before_large_files(organbench, egg, tmp_path, monkeypatch):
    prompts = []

    def prompt(question, default):
        prompts.append((question, default))
        return "mm"

    monkeypatch.setattr(commands.sys.stdin, "isatty", lambda: True, raising=False)
    monkeypatch.setattr(commands.typer, "prompt", prompt)
    target = tmp_path / "out.ply"
    assert organbench("mesh", "--from", egg, "-o", target)[0] == 0
    ((question, default),) = prompts
    assert "longest side is 60, the size of an organ in centimetres or millimetres" in question and default == "mm"
    assert np.ptp(read_mesh(target).points[:, 0]) == pytest.approx(0.06, rel=1e-6)
    monkeypatch.setattr(commands, "size_warning", lambda path: "it is large")
    monkeypatch.setattr(commands.typer, "confirm", lambda question: question != "it is large. Go on?")
    code, out, err = organbench("mesh", "--check", egg, "--unit", "mm")
    assert (code, out) == (2, "") and err.startswith("organbench: it is large; say --yes")
    code, _, err = organbench("mesh", "--check", egg, "--unit", "mm", "--yes")
    assert code == 0 and "warning: it is large" in err


TRIED = "tested; this gives a clean body of 550 surface nodes:"


def damaged():
    """By fault: points [mm], triangles, and the options that must stand in the command."""
    turned, spiky, folded = FACES.copy(), POINTS.copy(), POINTS.copy()
    turned[:40] = turned[:40, ::-1]
    spiky[FACES[0, 0]] = spiky[FACES[0, 1]] + 0.02 * (spiky[FACES[0, 0]] - spiky[FACES[0, 1]])
    folded[POINTS[:, 2].argmax()] += (18, 0, -3)
    fin = np.vstack([FACES, [[*FACES[0, :2], len(POINTS)]]])
    speck = box((60, 60, 60), (62, 62, 62))
    cup = FACES[POINTS[FACES].mean(axis=1)[:, 2] < 12]
    return {
        "open, turned, two parts": (*together((POINTS, turned[9:]), speck), ("--close-holes",)),
        "a sliver": (spiky, FACES, ()),
        "crossing itself": (folded, FACES, ()),
        "a fin": (np.vstack([POINTS, [[0, 0, 40]]]), fin, ()),
        "a cup": (POINTS, cup, ("--close-holes",)),
    }


QUICK = "open, turned, two parts"


@pytest.mark.parametrize(
    "fault", [pytest.param(name, marks=() if name == QUICK else pytest.mark.campaign) for name in damaged()]
)
def test_the_command_that_is_printed_works(organbench, tmp_path, monkeypatch, fault):
    points, faces, options = damaged()[fault]
    monkeypatch.chdir(tmp_path)
    stored(tmp_path / "my scan.ply", points, faces)
    code, out, _ = organbench("mesh", "--check", "my scan.ply", "--unit", "mm")
    assert code == 1 and TRIED in out
    words = shlex.split(out.splitlines()[-1])
    assert words[:4] == ["organbench", "mesh", "--from", "my scan.ply"] and set(options) <= set(words)
    advised = [line for line in out.splitlines() if line.startswith("   -> ")]
    assert advised and not any(line.startswith("   -> try") for line in advised)
    assert organbench(*words[1:])[0] == 0
    code, out, _ = organbench("mesh", "--check", "my scan_body.vtu")
    assert code == 0, out


@pytest.mark.campaign
def test_a_wall_too_thin_for_its_elements_is_kept_and_its_faults_are_named(organbench, tmp_path):
    """Of half a millimetre; filled it would be another organ."""
    shell = together((POINTS, FACES), (0.98 * POINTS, FACES[:, ::-1]))
    path = stored(tmp_path / "capsule.ply", *shell)
    code, out, _ = organbench("mesh", "--check", path, "--unit", "mm")
    assert code == 1 and TRIED not in out and "--solid" not in out
    assert "--nodes 550 --wall 0.481 makes a body, in which this is left: shell, tetrahedron slivers" in out


def test_advice_that_does_not_work_is_not_printed(organbench, tmp_path):
    """No option makes a body of an open triangle, or of a bowl with a double wall."""
    path = stored(tmp_path / "one.ply", 100 * np.eye(3), [[0, 1, 2]])
    code, out, _ = organbench("mesh", "--check", path, "--unit", "mm")
    assert code == 1 and TRIED not in out and "-> try" not in out and "FILE" not in out
    assert "tried: --nodes 550 --close-holes; --nodes 550 --smooth 3 --close-holes; --nodes 550 --solid 5; none" in out
    assert "the widest is 141 mm wide, at (33.33, 33.33, 33.33) mm" in out
    assert json.loads(organbench("mesh", "--check", path, "--unit", "mm", "--json")[1])["command"] is None


def test_what_lies_far_away_is_a_finding_and_a_refusal(organbench, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    name, message = "far_liver.vtu", "it lies 1e+06 m from the origin of its coordinates"
    meshio.write_points_cells(name, POINTS + np.array([1e9, 0, 0]), [("triangle", FACES)])
    code, out, _ = organbench("mesh", "--check", name, "--unit", "mm")
    assert code == 1 and message in out and TRIED not in out
    for words in (("mesh", "--from", name, "--nodes", 200), ("mesh", "--from", name), ("place", name)):
        code, _, err = organbench(*words, "--unit", "mm")
        assert code == 2 and message in err, words
    assert [path.name for path in tmp_path.iterdir()] == [name]


def test_an_organ_of_a_small_animal_gets_a_remark(organbench, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    stored("rat_heart.ply", 0.15 * POINTS, FACES)
    code, out, _ = organbench("mesh", "--check", "rat_heart.ply", "--unit", "mm")
    assert code == 0 and "remark: it is 9 mm long and encloses 0.21 mL" in out and "no faults found" in out
    code, _, err = organbench("mesh", "--from", "rat_heart.ply", "--unit", "mm", "-o", "body.vtu")
    assert code == 0 and "as organs of small animals do" in err


def test_grey_values_are_refused_by_all_three(organbench, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    grey = np.random.default_rng(0).integers(0, 239, (30, 30, 30)).astype(np.int16)
    nibabel.save(nibabel.Nifti1Image(grey, np.eye(4)), "liver_ct.nii.gz")
    for words in (("mesh", "--check"), ("mesh", "--nodes", 200, "--from"), ("place",)):
        code, out, err = organbench(*words, "liver_ct.nii.gz", "--part", "204")
        assert code == 2 and not out and "grey values" in err and "not a mask: segment it first" in err
