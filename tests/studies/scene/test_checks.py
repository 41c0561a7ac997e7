"""Scenes that cannot be meant are refused before anything is meshed; odd numbers are a warning each."""

from dataclasses import replace

import numpy as np
import pytest

from massspring import Capsule, Plane, Probe, Sphere, Trajectory
from studies.base.errors import StudyError
from studies.geometry import BallRegion, HalfSpace
from studies.geometry.organs import make_shape
from studies.scene.checks import WEIGHTLESS, check_scene, depth_at_start, surface_of
from studies.scene.cut import Cut
from studies.scene.library import SCENES, STOMACH_PRESS
from studies.scene.library.stress import STRESS_SCENES
from studies.scene.scene import ForceOutput, Held, Lumen, Organ, ReferencePlan
from tests.studies.tiny import SQUEEZE

PLAN, SOFT = ReferencePlan("octant", (0.9, 0.5)), SQUEEZE.tissue
MIDDLE = HalfSpace((0, 0, 0), (0, 0, 1))
ENDS = tuple(Held(f"{z}", HalfSpace((0, 0, z), (0, 0, -z))) for z in (-0.04, 0.04))
LEAF = HalfSpace((-0.01657, -0.00652, 0.00174), (0.9262, 0.3643, -0.0971))


def obstacles(*given, **more):
    return {"obstacles": given, **more}


def moved(z):
    return Trajectory((0.0, 1.0), ((0.0, 0.0, 0.0), (0.0, 0.0, z)))


def force(which=0, z=1.0, **more):
    return {"probed": ForceOutput("obstacle", which, (0.0, 0.0, z)), **more}


def cut(plane=MIDDLE, within=None, at=1.0, free=False, **more):
    return {"cuts": (Cut("slit", plane, within, at=at, free=free),), **more}


BROKEN = {
    "starts 5 mm inside the body (0.17 mm are allowed): move it back": obstacles(Sphere((0, 0, 0.055), 0.01)),
    "obstacle 0 starts 40 mm inside": obstacles(Sphere((0, 0, 0.02), 0.01)),
    "move it back, or turn its normal towards": obstacles(Plane((0, 0, -0.051), (0, 0, -1))),
    "obstacle 0 starts 50.5 mm inside": obstacles(Capsule((-0.08, 0, 0), (0.08, 0, 0), 0.0005)),
    "obstacle 0 starts 10 mm inside": obstacles(Probe((0, 0, 0.04))),
    "obstacle 0 is 12 m long, the body 0.173 m": obstacles(Capsule((-6, 0, 0.06), (6, 0, 0.06), 0.005)),
    "path of obstacle 0 is 8 m long": obstacles(Sphere((0, 0, 0.07), 0.01, moved(8.0))),
    "path of region 'top' is 3 m": {"held": (Held("top", HalfSpace((0, 0, 0.04), (0, 0, -1)), moved(3.0)),)},
    "begins 20 mm away from it": {"held": (Held("bottom", BallRegion((0, 0, -0.08), 0.01)),)},
    "two regions called 'pole'": {"held": tuple(replace(one, name="pole") for one in ENDS)},
    "obstacle 2, and has 2 obstacles": force(2, reference=PLAN),
    "obstacle 99, and has 2 obstacles": force(99),
    "unknown quantity of scene 'tiny_squeeze' 'volum'": {"quantities": ("volum",)},
    "its organ 'ball' is solid; leave it out": {"lumen": Lumen()},
    "a scene is called 5; give a text": {"name": 5},
    "checkpoints is None; give a tuple of times": {"checkpoints": None},
    "has a reference and no checkpoints; give the times": {"reference": PLAN, "checkpoints": ()},
    "checkpoints end at 99.0 s": {"checkpoints": (1.0, 99.0)},
    "shear modulus is 0.0018 Pa, the usual range is 100 to": {"tissue": replace(SOFT, shear_modulus=0.0018)},
    "kappa/mu = 9.67, a Poisson ratio of 0.45,": {"tissue": replace(SOFT, bulk_over_shear=29 / 3)},
    "bulk_over_shear of at least 100 (0.495)": {"tissue": replace(SOFT, bulk_over_shear=99.9)},
    "density is 1.06 kg/m³, the usual range is 500": {"tissue": replace(SOFT, density=1.06)},
    "the duration is inf s": {"duration": float("inf")},
    "the duration is nan s": {"duration": float("nan")},
    "the duration is -1.0 s; give a finite number above 0": {"duration": -1.0},
    "the duration is '8' s": {"duration": "8"},
    "duration is 8000000.0 s, the usual range is": {"duration": 8e6},
    "frames is 0; give a whole number from 1 on": {"frames": 0},
    "checkpoints end at 4.0 s and the scene at 1 s": {"reference": PLAN, "duration": 1.0},
    "checkpoints are (2.0, 1.0) s; give ascending": {"checkpoints": (2.0, 1.0)},
    "unknown organ 'livr'; did you mean 'liver'": {"organ": Organ("livr")},
    "radius of the ball is 'big'; give a number": {"organ": Organ("ball", {"radius": "big"})},
    "unknown parameter of the ball 'radios'": {"organ": Organ("ball", {"radios": 0.05})},
    "ball of radius 0.0 m cannot be meshed": {"organ": Organ("ball", {"radius": 0.0})},
    "0.001 s is not between two of the 10 frames": cut(at=1e-3, frames=10),
    "100 s is not between two of the": cut(at=100.0),
    "plane of cut 'slit' misses the body": cut(HalfSpace((0, 0, 0.051), (0, 0, 1))),
    "holds nothing of the section": cut(within=HalfSpace((-0.06, 0, 0), (1, 0, 0))),
    "the blade of cut 'slit' is all of it; leave out within": cut(within=HalfSpace((0.06, 0, 0), (1, 0, 0))),
    "holds nothing of the plane; move the ball onto it": cut(within=BallRegion((0, 0, 0.02), 0.01)),
    "disc of cut 'slit' reaches the surface": cut(within=BallRegion((0.045, 0, 0), 0.01)),
    "disc of cut 'slit' lies outside the body": cut(within=BallRegion((0.07, 0, 0), 0.01)),
    "leaves a piece that nothing holds": cut(held=ENDS[:1]),
    "leaves a piece of 0.25 % of the volume": cut(HalfSpace((0, 0, 0.047), (0, 0, 1)), free=True),
    "grazes the surface, at": cut(LEAF, free=True, organ=Organ("spleen"), obstacles=()),
    "crosses the outline of a held region": cut(HalfSpace((0, 0, 0), (1, 0, 0)), held=ENDS),
    "through the wall of a hollow organ": cut(organ=Organ("stomach"), obstacles=()),
    "wall of a hollow organ; let what fills it go": cut(organ=Organ("bladder"), obstacles=(), lumen=Lumen()),
    "only organs of the catalogue are cut so far": cut(organ=Organ("file", {"path": "no.stl"})),
    "has a thin probe, which feels no cut": cut(obstacles=(Probe((0, 0, 0.06)),)),
    "nothing would judge what is cut": cut(at=2.0, reference=ReferencePlan(), checkpoints=(1.0,)),
    "of an octant or a motion, which are not cut": cut(reference=PLAN),
    "two cuts called 'slit'": {"cuts": 2 * cut()["cuts"]},
}


@pytest.mark.parametrize("words", BROKEN)
def test_a_scene_that_cannot_be_meant_is_refused(words):
    """Of a squeezed ball of 5 cm about the origin, with one thing wrong."""
    with pytest.raises(StudyError) as refusal:
        check_scene(replace(SQUEEZE, **BROKEN[words]))
    assert words in str(refusal.value)


@pytest.mark.parametrize(
    ("make", "words"),
    [
        (lambda: force(z=0.0), "give a vector of length 1"),
        (lambda: force(z=2.0), "give a vector of length 1"),
        (lambda: cut(at=0.0), "give a time after the start"),
        (lambda: replace(SOFT, density=-1.0), "density = -1.0 .*; give a finite number"),
    ],
)
def test_a_part_that_cannot_be_meant_is_refused_where_it_is_made(make, words):
    with pytest.raises(StudyError, match=words):
        make()


SPHERE = Sphere((0.0, 0.0, 0.27), 0.2)
ODD = {
    "shear modulus is 5.0 Pa": {"tissue": replace(SOFT, shear_modulus=5.0)},
    "density is 2500.0 kg/m³": {"tissue": replace(SOFT, density=2500.0)},
    "duration is 8000.0 s": {"duration": 8000.0},
    "obstacle 0 is 0.4 m long, the body 0.173 m": obstacles(SPHERE),
    "path": obstacles(replace(SPHERE, radius=0.01, path=moved(-0.4))),
    "is pressed 119 mm into a body that is 100 mm thick there": obstacles(
        Plane((0.0, 0.0, 0.051), (0.0, 0.0, -1.0), moved(-0.12)), SQUEEZE.obstacles[0]
    ),
}


@pytest.mark.parametrize("words", ODD)
def test_a_number_that_is_hardly_meant_is_a_warning(words):
    (sentence,) = check_scene(replace(SQUEEZE, **ODD[words]))
    assert words in sentence


@pytest.mark.parametrize(("content", "told"), [("closed", [WEIGHTLESS]), ("open", [])])
def test_what_fills_a_lumen_has_no_weight(content, told):
    """The content of this stomach would be three times as heavy as its wall."""
    held = ForceOutput("held", 0, (0.0, 0.0, -1.0))
    hanging = replace(STOMACH_PRESS, obstacles=(), probed=held, lumen=Lumen(content), gravity=(0.0, 0.0, -9.81))
    assert check_scene(hanging) == told and WEIGHTLESS not in check_scene(STOMACH_PRESS)


def test_an_obstacle_that_goes_into_what_is_held_is_refused():
    """A ball of radius 50 mm held below z = -45 mm, and a probe that comes from the side at z = -49 mm."""

    def warnings_for(held, probe):
        return check_scene(replace(SQUEEZE, obstacles=(probe,), held=(held,)))

    cap = Held("foot", HalfSpace((0.0, 0.0, -0.045), (0.0, 0.0, 1.0)))
    path = Trajectory((0.0, 1.0), ((0.0, 0.0, 0.0), (-0.06, 0.0, 0.0)))
    probe = Sphere((0.1, 0.0, -0.049), 0.005, path)  # it ends at x = 40 mm, the cap at 21.8 mm
    assert warnings_for(cap, probe) == []
    deeper = replace(probe, path=replace(path, displacements=((0.0, 0.0, 0.0), (-0.083, 0.0, 0.0))))
    with pytest.raises(StudyError) as refusal:
        warnings_for(cap, deeper)
    sentence = str(refusal.value)
    deepest = 5.0 - (np.hypot(17.0, 49.0) - 50.0)  # [mm], where it ends, at (17, 0, -49) mm
    assert "into held region 'foot'" in sentence
    assert 0.0 < float(sentence.split("goes ")[1].split(" mm")[0]) == pytest.approx(deepest, abs=0.4)
    assert warnings_for(replace(cap, path=moved(-0.01)), deeper) == [], "it moves out of the way"


@pytest.mark.parametrize("scene", [SQUEEZE, *SCENES, *STRESS_SCENES], ids=lambda scene: scene.name)
def test_no_scene_of_the_catalogue_is_odd(scene):
    assert check_scene(scene) == []
    pushed = Plane((0.0, 0.0, 0.051), (0.0, 0.0, -1.0), moved(-0.12))
    assert check_scene(replace(SQUEEZE, obstacles=(pushed,))) == [], "it pushes the body before it"


@pytest.mark.parametrize(
    ("obstacle", "depth"),
    [
        (Sphere((0.0, 0.0, 0.058), 0.01), 0.002),
        (Sphere((0.0, 0.0, 0.063), 0.01), -0.003),
        (Plane((0.0, 0.0, 0.04), (0.0, 0.0, -1.0)), 0.01),
        (Capsule((0.02, 0.0, 0.2), (0.02, 0.0, 0.03), 0.001), 0.001 + 0.05 - np.hypot(0.02, 0.03)),
    ],
)
def test_the_depth_at_the_start_is_that_of_closed_forms(obstacle, depth):
    assert depth_at_start(obstacle, *surface_of(Organ("ball"), "")) == pytest.approx(depth, abs=1e-3)


def test_what_lies_in_a_lumen_is_not_inside_the_wall():
    surface = surface_of(Organ("ball", {"wall": 0.005}), "")
    balloon = Sphere((0.0, 0.0, 0.0), 0.02)
    assert depth_at_start(balloon, *surface, hollow=True) < 0 < depth_at_start(balloon, *surface)


@pytest.mark.parametrize("value", [np.float64(0.05), 0.05, 1])
def test_a_number_is_a_parameter_of_an_organ(value):
    assert make_shape("ball", {"radius": value, "wall": None}).size > 0
