"""Where masses may be shared by stiffness: in slow loads from rest to rest."""

from dataclasses import replace

import pytest

from massspring import Plane, Trajectory
from studies.scene.inertia import why_inertia_matters, why_not_heavier
from studies.scene.library import BALL_INCISED, BLADDER_FILL, SCENES
from studies.scene.library.ball_clamped import BALL_CLAMPED
from studies.scene.library.ball_ringing import BALL_RINGING
from studies.scene.library.ball_squeeze import BALL_SQUEEZE
from studies.scene.library.liver_press import LIVER_PRESS
from studies.scene.library.spleen_sag import SPLEEN_SAG
from studies.scene.library.stomach_slide import STOMACH_SLIDE
from studies.scene.library.stress import STRESS_SCENES

STATIC = [s for s in SCENES if s.reference is not None and s.reference.dt is None]
FALLING = replace(SPLEEN_SAG, held=())


def plane(*keys):
    """A plane that is at these heights [m] at 0, 1, 2, … s."""
    places = tuple((0.0, 0.0, z) for z in keys)
    return Plane((0.0, 0.0, 0.05), (0.0, 0.0, -1.0), Trajectory(tuple(float(t) for t in range(len(keys))), places))


@pytest.mark.parametrize("scene", STATIC, ids=lambda scene: scene.name)
def test_scenes_whose_reference_is_a_load_path_allow_any_masses(scene):
    assert why_inertia_matters(scene) is None


@pytest.mark.parametrize(
    ("scene", "reason"),
    [
        (BALL_RINGING, "rings"),
        (STRESS_SCENES[0], "out of shape"),
        (STOMACH_SLIDE, "thin probe"),
        (FALLING, "it falls"),
        (replace(BALL_RINGING, start=None), "motion in time"),
        (replace(BALL_SQUEEZE, obstacles=(plane(0.0, -0.02),)), "20 mm/s"),
        (replace(BALL_SQUEEZE, obstacles=(plane(0.0, -0.005, 0.0),)), "changes its direction"),
        (replace(BALL_CLAMPED, held=(replace(BALL_CLAMPED.held[1], path=plane(0.0, 0.005, 0.0).path),)), "changes its"),
    ],
    ids=lambda value: value if isinstance(value, str) else "",
)
def test_scenes_in_which_bodies_swing_or_are_hit_do_not(scene, reason):
    assert reason in str(why_inertia_matters(scene))


def test_a_plane_that_rests_on_its_way_does_not_turn():
    assert why_inertia_matters(replace(LIVER_PRESS, obstacles=(plane(0.0, -0.005, -0.005, -0.01),))) is None


@pytest.mark.parametrize(
    ("scene", "reason"),
    [
        (BALL_SQUEEZE, "nothing holds it"),
        (BALL_INCISED, "a cut"),
        (replace(BLADDER_FILL, gravity=(0.0, 0.0, -9.81)), "its weight"),
        (BLADDER_FILL, "None"),
        (replace(LIVER_PRESS, gravity=(0.0, 0.0, -9.81)), "its weight"),
        (LIVER_PRESS, "None"),
        (SPLEEN_SAG, "None"),
    ],
    ids=lambda value: value if isinstance(value, str) else "",
)
def test_bodies_with_a_swing_that_the_rule_does_not_know_are_no_heavier(scene, reason):
    assert reason in str(why_not_heavier(scene))
