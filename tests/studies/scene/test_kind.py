"""The kind of a scene follows from what it holds, whatever it is called."""

from dataclasses import replace

import pytest

from massspring import Capsule, Plane, Ramp, Trajectory
from studies.scene.kind import kind_of
from studies.scene.library import SCENES
from studies.scene.library.ball_clamped import BALL_CLAMPED
from studies.scene.library.ball_squeeze import BALL_SQUEEZE
from studies.scene.library.kidney_probe import KIDNEY_PROBE
from studies.scene.library.liver_press import LIVER_PRESS
from studies.scene.library.spleen_sag import SPLEEN_SAG
from studies.scene.library.stomach_press import STOMACH_PRESS
from studies.scene.scene import Lumen, Organ

KINDS = {
    "ball_squeeze": "solid, squeeze",
    "ball_clamped": "solid, squeeze",
    "ball_ringing": "solid, motion",
    "liver_press": "solid, press",
    "liver_probe": "solid, probe",
    "kidney_probe": "solid, probe",
    "spleen_sag": "solid, sag",
    "stomach_press": "hollow, press",
    "stomach_probe": "hollow, probe",
    "bladder_fill": "hollow, fill",
    "stomach_slide": "hollow, thin probe",
}
DOWN = Trajectory((0.0, 1.0), ((0.0, 0.0, 0.0), (0.0, 0.0, -0.01)))


@pytest.mark.parametrize("scene", SCENES, ids=lambda scene: scene.name)
def test_every_scene_is_of_the_kind_that_its_load_says(scene):
    assert str(kind_of(replace(scene, name="another", title="another"))) == KINDS[scene.name]


def test_what_does_not_move_is_no_load():
    still = tuple(replace(obstacle, path=Trajectory()) for obstacle in LIVER_PRESS.obstacles)
    assert kind_of(replace(LIVER_PRESS, obstacles=still)).load == "rest"
    assert kind_of(replace(LIVER_PRESS, obstacles=still, gravity=(0.0, 0.0, -9.81))).load == "sag"


def test_a_rod_probes_and_a_plane_squeezes_what_nothing_holds():
    rod = Capsule((0.0, 0.0, 0.1), (0.0, 0.0, 0.2), 0.01, DOWN)
    assert kind_of(replace(SPLEEN_SAG, obstacles=(rod,))).load == "probe"
    one = (Plane((0.0, 0.0, 0.1), (0.0, 0.0, -1.0), DOWN),)
    assert kind_of(replace(BALL_SQUEEZE, obstacles=one)).load == "squeeze"
    assert kind_of(replace(KIDNEY_PROBE, obstacles=one)).load == "press"
    assert kind_of(replace(KIDNEY_PROBE, obstacles=one + one)).load == "squeeze"


def test_a_lumen_that_grows_is_filled_and_a_wall_makes_hollow():
    filled = replace(STOMACH_PRESS, obstacles=(), lumen=Lumen(filling=Ramp((0.0, 1.0), (1.0, 1.1))))
    assert str(kind_of(filled)) == "hollow, fill"
    scan = Organ("file", {"path": "a.stl", "unit": "mm", "wall": 0.003})
    assert kind_of(replace(BALL_CLAMPED, organ=scan)).hollow
    assert not kind_of(replace(BALL_CLAMPED, organ=Organ("file", {"path": "a.stl", "unit": "mm"}))).hollow
