"""Scenes that cannot be meant: one sentence and exit code 2 before anything is meshed, dry run or not."""

from dataclasses import replace

import numpy as np
import pytest

from massspring import Capsule, Plane, Sphere, Trajectory
from studies.geometry import HalfSpace
from studies.geometry.organs import make_shape
from studies.scene.checks import check_scene, depth_at_start, surface_of
from studies.scene.library import SCENES
from studies.scene.library.stress import STRESS_SCENES
from studies.scene.scene import Held, Organ
from studies.sweep.local import Local
from tests.studies.tiny import SQUEEZE, tiny_case

STUDY = """from dataclasses import replace
from massspring import Capsule, Plane, Probe, Sphere, Trajectory
from studies.catalog import Chart
from studies.geometry import BallRegion, HalfSpace
from studies.scene.cut import Cut
from studies.scene.scene import ForceOutput, Held, Organ, ReferencePlan
from studies.scene.scene import Lumen
from tests.studies.tiny import SQUEEZE, tiny_case, tiny_study

PLAN = ReferencePlan("octant", (0.9, 0.5))
SOFT = SQUEEZE.tissue
CHARTS = ()
SCENE = replace(SQUEEZE, {changes})
STUDY = tiny_study(cases=(tiny_case(scene=SCENE),), charts={charts})
"""
"""A squeezed ball of 5 cm about the origin, with one thing wrong."""
MOVED = "Trajectory((0.0, 1.0), ((0.0, 0.0, 0.0), (0.0, 0.0, {})))"
BROKEN = {
    "sphere inside": (
        "obstacles=(Sphere((0, 0, 0.055), 0.01),)",
        "obstacle 0 starts 5 mm inside the body (0.17 mm are allowed): move it back",
    ),
    "sphere wholly inside": ("obstacles=(Sphere((0, 0, 0.02), 0.01),)", "obstacle 0 starts 40 mm inside the body"),
    "plane turned round": (
        "obstacles=(Plane((0, 0, -0.051), (0, 0, -1)),)",
        "obstacle 0 starts 101 mm inside the body (0.17 mm are allowed): move it back, or turn its normal towards",
    ),
    "rod through the body": (
        "obstacles=(Capsule((-0.08, 0, 0), (0.08, 0, 0), 0.0005),)",
        "obstacle 0 starts 50.5 mm inside the body",
    ),
    "probe inside": ("obstacles=(Probe((0, 0, 0.04)),)", "obstacle 0 starts 10 mm inside the body"),
    "rod of 12 m": (
        "obstacles=(Capsule((-6, 0, 0.06), (6, 0, 0.06), 0.005),)",
        "obstacle 0 is 12 m long, the body 0.173 m: are all lengths in metres?",
    ),
    "path of 8 m": (
        f"obstacles=(Sphere((0, 0, 0.07), 0.01, {MOVED.format(8.0)}),)",
        "the path of obstacle 0 is 8 m long, the body 0.173 m",
    ),
    "region moved by 3 m": (
        f"held=(Held('top', HalfSpace((0, 0, 0.04), (0, 0, -1)), {MOVED.format(3.0)}),)",
        "the path of region 'top' is 3 m long",
    ),
    "region off the body": (
        "held=(Held('bottom', BallRegion((0, 0, -0.08), 0.01)),)",
        "region 'bottom' contains no part of the body, which begins 20 mm away from it",
    ),
    "two regions of one name": (
        "held=tuple(Held('pole', HalfSpace((0, 0, z), (0, 0, -z))) for z in (-0.04, 0.04))",
        "has two regions called 'pole'",
    ),
    "force at no obstacle": (
        "reference=PLAN, probed=ForceOutput('obstacle', 2, (0, 0, 1))",
        "probes the force at obstacle 2, and has 2 obstacles, counted from 0",
    ),
    "force at no obstacle, no reference": (
        "probed=ForceOutput('obstacle', 99, (0, 0, 1))",
        "probes the force at obstacle 99, and has 2 obstacles, counted from 0",
    ),
    "force along nothing": ("probed=ForceOutput('obstacle', 0, (0.0, 0.0, 0.0))", "give a vector of length 1"),
    "twice the force": ("probed=ForceOutput('obstacle', 0, (0.0, 0.0, 2.0))", "give a vector of length 1"),
    "unknown quantity": ("quantities=('volum',)", "unknown quantity of scene 'tiny_squeeze' 'volum'; did you mean"),
    "lumen of a solid organ": ("lumen=Lumen()", "has a lumen, and its organ 'ball' is solid; leave it out"),
    "name that is a number": ("name=5", "a scene is called 5; give a text"),
    "density below 0": (
        "tissue=replace(SOFT, density=-1.0)",
        "a tissue has density = -1.0 [kg/m³]; give a finite number",
    ),
    "checkpoints of another kind": ("checkpoints=None", "checkpoints is None; give a tuple of times [s]"),
    "checkpoints after the end": ("checkpoints=(1.0, 99.0)", "its checkpoints end at 99.0 s and the scene at"),
    "tissue in MPa": (
        "tissue=replace(SOFT, shear_modulus=0.0018)",
        "the shear modulus is 0.0018 Pa, the usual range is 100 to 100,000: is it in Pa?",
    ),
    "density in g/cm³": (
        "tissue=replace(SOFT, density=1.06)",
        "the density is 1.06 kg/m³, the usual range is 500",
    ),
    "endless": ("duration=float('inf')", "the duration is inf s; give a finite number above 0"),
    "no duration": ("duration=float('nan')", "the duration is nan s; give a finite number above 0"),
    "backwards": ("duration=-1.0", "the duration is -1.0 s; give a finite number above 0"),
    "duration in words": ("duration='8'", "the duration is '8' s; give a finite number above 0"),
    "duration in µs": ("duration=8e6", "the duration is 8000000.0 s, the usual range is 0.001 to 1,000"),
    "no frames": ("frames=0", "frames is 0; give a whole number from 1 on"),
    "compared after its end": (
        "reference=PLAN, duration=1.0",
        "its checkpoints end at 4.0 s and the scene at 1 s",
    ),
    "checkpoints backwards": ("checkpoints=(2.0, 1.0)", "the checkpoints are (2.0, 1.0) s; give ascending times"),
    "unknown organ": ("organ=Organ('livr')", "scene 'tiny_squeeze': unknown organ 'livr'; did you mean 'liver'"),
    "parameter in words": ("organ=Organ('ball', {'radius': 'big'})", "the radius of the ball is 'big'; give a number"),
    "unknown parameter": ("organ=Organ('ball', {'radios': 0.05})", "unknown parameter of the ball 'radios'"),
    "ball without a size": ("organ=Organ('ball', {'radius': 0.0})", "a ball of radius 0.0 m cannot be meshed"),
}
MIDDLE = "HalfSpace((0, 0, 0), (0, 0, 1))"
ENDS = "tuple(Held(f'{z}', HalfSpace((0, 0, z), (0, 0, -z))) for z in (-0.04, 0.04))"
CUTS = {
    "cut at the start": (f"cuts=(Cut('slit', {MIDDLE}, at=0.0),)", "cut 'slit' is made at 0.0 s; give a time after"),
    "cut before the first frame ends": (
        f"frames=10, cuts=(Cut('slit', {MIDDLE}, at=1e-3),)",
        "cut 'slit' at 0.001 s is not between two of the 5 frames",
    ),
    "cut after the last frame": (
        f"cuts=(Cut('slit', {MIDDLE}, at=100.0),)",
        "cut 'slit' at 100 s is not between two of the",
    ),
    "plane off the body": (
        "cuts=(Cut('slit', HalfSpace((0, 0, 0.051), (0, 0, 1)), at=1.0),)",
        "the plane of cut 'slit' misses the body; move it",
    ),
    "blade off the section": (
        f"cuts=(Cut('slit', {MIDDLE}, HalfSpace((-0.06, 0, 0), (1, 0, 0)), at=1.0),)",
        "the blade of cut 'slit' holds nothing of the section; move it",
    ),
    "blade round the section": (
        f"cuts=(Cut('slit', {MIDDLE}, HalfSpace((0.06, 0, 0), (1, 0, 0)), at=1.0),)",
        "the blade of cut 'slit' is all of it; leave out within",
    ),
    "ball off the plane": (
        f"cuts=(Cut('slit', {MIDDLE}, BallRegion((0, 0, 0.02), 0.01), at=1.0),)",
        "the blade of cut 'slit' holds nothing of the plane; move the ball onto it",
    ),
    "disc through the surface": (
        f"cuts=(Cut('slit', {MIDDLE}, BallRegion((0.045, 0, 0), 0.01), at=1.0),)",
        "the disc of cut 'slit' reaches the surface; give a smaller one, or a half space",
    ),
    "disc outside": (
        f"cuts=(Cut('slit', {MIDDLE}, BallRegion((0.07, 0, 0), 0.01), at=1.0),)",
        "the disc of cut 'slit' lies outside the body; move it",
    ),
    "piece that nothing holds": (
        f"held={ENDS}[:1], cuts=(Cut('slit', {MIDDLE}, at=1.0),)",
        "cut 'slit' leaves a piece that nothing holds; hold it, or let it go: free=True",
    ),
    "crumb": (
        "cuts=(Cut('slit', HalfSpace((0, 0, 0.047), (0, 0, 1)), at=1.0, free=True),)",
        "cut 'slit' leaves a piece of 0.25 % of the volume; move the plane",
    ),
    "grazing plane": (
        "organ=Organ('spleen'), obstacles=(), cuts=(Cut('slit', "
        "HalfSpace((-0.01657, -0.00652, 0.00174), (0.9262, 0.3643, -0.0971)), at=1.0, free=True),)",
        "cut 'slit' grazes the surface, at",
    ),
    "across a held outline": (
        f"held={ENDS}, cuts=(Cut('slit', HalfSpace((0, 0, 0), (1, 0, 0)), at=1.0),)",
        "cut 'slit' crosses the outline of a held region; move one of them away",
    ),
    "hollow organ": (
        f"organ=Organ('stomach'), obstacles=(), cuts=(Cut('slit', {MIDDLE}, at=1.0),)",
        "cut 'slit' goes through the wall of a hollow organ; let what fills it go: opens_lumen=True",
    ),
    "filled lumen": (
        f"organ=Organ('bladder'), obstacles=(), lumen=Lumen(), cuts=(Cut('slit', {MIDDLE}, at=1.0),)",
        "cut 'slit' goes through the wall of a hollow organ; let what fills it go: opens_lumen=True",
    ),
    "organ of a file": (
        f"organ=Organ('file', {{'path': 'no.stl'}}), cuts=(Cut('slit', {MIDDLE}, at=1.0),)",
        "cuts an organ of a file; only organs of the catalogue are cut so far",
    ),
    "thin probe": (
        f"obstacles=(Probe((0, 0, 0.06)),), cuts=(Cut('slit', {MIDDLE}, at=1.0),)",
        "has a thin probe, which feels no cut; leave one of them out",
    ),
    "reference before the cut": (
        f"reference=ReferencePlan(), checkpoints=(1.0,), cuts=(Cut('slit', {MIDDLE}, at=2.0),)",
        "has its last checkpoint at 1 s and its cut at 2 s, so nothing would judge what is cut",
    ),
    "reference of an octant": (
        f"reference=PLAN, cuts=(Cut('slit', {MIDDLE}, at=1.0),)",
        "is cut, and its reference is of an octant or a motion, which are not cut",
    ),
    "two cuts": (f"cuts=2 * (Cut('slit', {MIDDLE}, at=1.0),)", "has two cuts called 'slit'; give each its own name"),
}
CHARTS = {
    "no module": ("nowhere.at_all:draw", "there is no function 'nowhere.at_all:draw' (ModuleNotFoundError"),
    "no function": ("studies.plots.volume_history:drow", "there is no function 'studies.plots.volume_history:drow'"),
    "no callable": ("studies.plots.volume_history:__name__", "is not a function; give one of the runs and a path"),
}


@pytest.fixture
def nothing_runs(monkeypatch):
    """No task is handed to a process, so nothing is meshed."""
    monkeypatch.setattr(Local, "map", lambda *words, **more: pytest.fail("it began to run"))


@pytest.mark.usefixtures("nothing_runs")
@pytest.mark.parametrize(("number", "fault"), list(enumerate([*BROKEN, *CUTS])))
def test_a_scene_that_cannot_be_meant_is_one_sentence_before_any_mesh(refused, tmp_path, number, fault):
    """Every third fault in a dry run, in a run, and in a run of one case, which have the same checks."""
    changes, sentence = (BROKEN | CUTS)[fault]
    file, results = tmp_path / "broken.py", tmp_path / "results"
    file.write_text(STUDY.format(changes=changes, charts="()"), encoding="utf-8")
    words = [("--dry-run",), (), ("--case", tiny_case().name)][number % 3]
    assert sentence in refused("run", file, "--results", results, *words)
    assert not results.exists()


@pytest.mark.usefixtures("nothing_runs")
@pytest.mark.parametrize("fault", CHARTS)
def test_a_chart_without_a_function_is_one_sentence_before_any_mesh(refused, tmp_path, fault):
    drawing, sentence = CHARTS[fault]
    text = STUDY.format(changes="name='tiny_squeeze'", charts=f"(Chart('a.png', {drawing!r}),)")
    file = tmp_path / "broken.py"
    file.write_text(text)
    for words in (("--dry-run",), ()):
        assert sentence in refused("run", file, "--results", tmp_path / "results", *words)


def warnings_for(**changes) -> list[str]:
    return check_scene(replace(SQUEEZE, **changes))


def test_numbers_that_are_hardly_meant_are_a_warning_each():
    soft, sphere = SQUEEZE.tissue, Sphere((0.0, 0.0, 0.27), 0.2)
    for changes, words in (
        ({"tissue": replace(soft, shear_modulus=5.0)}, "the shear modulus is 5.0 Pa, the usual range is 100 to"),
        ({"tissue": replace(soft, density=2500.0)}, "the density is 2500.0 kg/m³"),
        ({"duration": 8000.0}, "the duration is 8000.0 s"),
        ({"obstacles": (sphere,)}, "obstacle 0 is 0.4 m long, the body 0.173 m"),
        (
            {"obstacles": (replace(sphere, radius=0.01, path=Trajectory((0.0, 1.0), ((0, 0, 0), (0, 0, -0.4)))),)},
            "path",
        ),
    ):
        (sentence,) = warnings_for(**changes)
        assert words in sentence
    assert warnings_for() == []


def test_a_plane_pressed_through_a_body_that_cannot_give_way_is_a_warning():
    path = Trajectory((0.0, 1.0), ((0.0, 0.0, 0.0), (0.0, 0.0, -0.12)))
    plane = Plane((0.0, 0.0, 0.051), (0.0, 0.0, -1.0), path)
    (sentence,) = warnings_for(obstacles=(plane, SQUEEZE.obstacles[0]))
    assert "is pressed 119 mm into a body that is 100 mm thick there" in sentence
    assert warnings_for(obstacles=(plane,)) == [], "it pushes the body before it"


def test_an_obstacle_that_goes_into_what_is_held_is_a_warning():
    """A ball of radius 50 mm held below z = -45 mm, and a probe that comes from the side at z = -49 mm."""
    cap = Held("foot", HalfSpace((0.0, 0.0, -0.045), (0.0, 0.0, 1.0)))
    path = Trajectory((0.0, 1.0), ((0.0, 0.0, 0.0), (-0.06, 0.0, 0.0)))
    probe = Sphere((0.1, 0.0, -0.049), 0.005, path)  # it ends at x = 40 mm, the cap at 21.8 mm
    assert warnings_for(obstacles=(probe,), held=(cap,)) == []
    deeper = replace(probe, path=replace(path, displacements=((0.0, 0.0, 0.0), (-0.083, 0.0, 0.0))))
    (sentence,) = warnings_for(obstacles=(deeper,), held=(cap,))
    deepest = 5.0 - (np.hypot(17.0, 49.0) - 50.0)  # [mm], where it ends, at (17, 0, -49) mm
    assert "obstacle 0 goes" in sentence and "into held region 'foot'" in sentence
    depth = float(sentence.split("goes ")[1].split(" mm")[0])
    assert 0.0 < depth == pytest.approx(deepest, abs=0.4)
    moving = Held("foot", cap.region, path=Trajectory((0.0, 1.0), ((0.0, 0.0, 0.0), (0.0, 0.0, -0.01))))
    assert warnings_for(obstacles=(deeper,), held=(moving,)) == [], "it moves out of the way"


@pytest.mark.parametrize("scene", [*SCENES, *STRESS_SCENES], ids=lambda scene: scene.name)
def test_no_scene_of_the_catalogue_is_odd(scene):
    assert check_scene(scene) == []


def test_the_depth_at_the_start_is_that_of_closed_forms():
    surface = surface_of(Organ("ball"), "")
    assert depth_at_start(Sphere((0.0, 0.0, 0.058), 0.01), *surface) == pytest.approx(0.002, abs=1e-4)
    assert depth_at_start(Sphere((0.0, 0.0, 0.063), 0.01), *surface) == pytest.approx(-0.003, abs=1e-4)
    assert depth_at_start(Plane((0.0, 0.0, 0.04), (0.0, 0.0, -1.0)), *surface) == pytest.approx(0.01, abs=1e-4)
    rod = Capsule((0.02, 0.0, 0.2), (0.02, 0.0, 0.03), 0.001)
    assert depth_at_start(rod, *surface) == pytest.approx(0.001 + 0.05 - np.hypot(0.02, 0.03), abs=2e-3)


def test_what_lies_in_a_lumen_is_not_inside_the_wall():
    surface = surface_of(Organ("ball", {"wall": 0.005}), "")
    balloon = Sphere((0.0, 0.0, 0.0), 0.02)
    assert depth_at_start(balloon, *surface, hollow=True) < 0 < depth_at_start(balloon, *surface)


def test_a_study_that_expects_failures_is_not_held_up(organbench, tmp_path):
    """A population draws its scenes at random: one that cannot start is a failed case of it."""
    file = tmp_path / "mine.py"
    text = STUDY.format(changes=BROKEN["sphere inside"][0], charts="(), expects=('failed',)")
    file.write_text(text, encoding="utf-8")
    code, out, err = organbench("run", file, "--results", tmp_path / "results", "--dry-run")
    assert (code, err) == (0, "") and "1 case would run" in out


@pytest.mark.parametrize("value", [np.float64(0.05), 0.05, 1])
def test_a_number_is_a_parameter_of_an_organ(value):
    assert make_shape("ball", {"radius": value, "wall": None}).size > 0
