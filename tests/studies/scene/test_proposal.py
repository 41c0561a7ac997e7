"""Hold and probe on a body: by rule, at a side, at a point; and the tissue that belongs to a name."""

from dataclasses import replace

import numpy as np
import pytest

from studies.base.errors import StudyError
from studies.geometry import BallRegion, OrganMesh, organ
from studies.geometry.mesh.organ_mesh import triangle_areas
from studies.geometry.organs import liver as liver_module
from studies.geometry.surface.distance import distance_to_surface
from studies.scene.chosen_place import GAP, RADIUS, SIDES
from studies.scene.proposal import HELD, proposal
from studies.scene.tissues import tissue_named
from tests.studies.geometry.boxes import box, split, together


def body_of(points, faces):
    return OrganMesh("egg", points, faces, np.empty((0, 4), np.int64), len(points))


def egg(taper=0.0):
    """60 x 50 x 40 mm; a taper makes the end at high x thinner."""
    points, faces = split(*box((-1, -1, -1), (1, 1, 1)), times=4)
    unit = points / np.linalg.norm(points, axis=1, keepdims=True)
    unit[:, 1:] *= 1 - taper * unit[:, :1]
    return 1e-3 * unit * (30, 22, 15), faces


def test_axes_hold_and_palpation_follow_the_rules():
    turn = np.linalg.qr(np.random.default_rng(2).normal(size=(3, 3)))[0]
    turn *= np.linalg.det(turn)
    points, faces = egg(taper=0.4)
    plan = proposal(body_of(points @ turn.T + 0.3, faces))
    axis = np.asarray(plan.axes[0])
    assert abs(axis @ turn[:, 0]) > 0.999 and plan.sides[0] == pytest.approx(0.060, rel=0.01)
    # The blunter end is at low x; a tenth of the surface is held there, and the normal looks to the middle.
    assert np.asarray(plan.hold.normal) @ turn[:, 0] > 0.999 and plan.held_share == pytest.approx(HELD, abs=0.01)
    assert (plan.hold.level(np.array([turn @ (-0.030, 0, 0) + 0.3])) < 0).all()
    point, normal = (np.asarray(v) for v in (plan.palpation.point, plan.palpation.normal))
    assert plan.hold.level(point[None])[0] > 0.4 * plan.sides[0]
    # The flattest side of the egg is that of its shortest axis; nothing of the body lies beyond.
    assert abs(normal @ turn[:, 2]) > 0.9 and ((points @ turn.T + 0.3 - point) @ normal).max() < 0.0015


@pytest.mark.parametrize("side", SIDES)
def test_a_side_is_held_and_the_other_one_palpated(side):
    points, faces = egg()
    axis = int(np.abs(SIDES[side]).argmax())
    other = next(name for name in SIDES if np.dot(SIDES[name], SIDES[side]) == -1)
    placing = proposal(body_of(points, faces), side, other)
    held = placing.hold.level(points) <= 0
    assert placing.held_share == pytest.approx(HELD, abs=0.01) and placing.held_where == f"the {side}"
    assert (points[held] @ SIDES[side]).min() > 0.3 * np.ptp(points[:, axis])
    point, normal = (np.asarray(v) for v in (placing.palpation.point, placing.palpation.normal))
    assert normal @ SIDES[other] > 0.98 and point @ SIDES[other] == pytest.approx(
        0.5 * np.ptp(points[:, axis]), rel=0.05
    )


def test_left_is_the_patients():
    """The thin lobe of a liver is on the left (studies.geometry.organs.liver); a mask has x to the right, y to the
    front (NIfTI)."""
    liver = organ("liver", 300, fill=False)
    assert "Axes: x to the patient's left, y to the back" in (liver_module.__doc__ or "")
    left, right = (proposal(liver, side).hold for side in ("left", "right"))
    spread = [np.ptp(liver.points[region.level(liver.points) <= 0][:, 2]) for region in (left, right)]
    assert left.point[0] > right.point[0] and spread[0] < 0.7 * spread[1]
    mask = replace(liver, points=liver.points * (-1, -1, 1), recipe={"file": "a.nii.gz"})  # turned by half a turn
    for side in ("left", "front"):
        there, here = (proposal(one, side).hold.point for one in (mask, liver))
        np.testing.assert_allclose(there * np.array((-1, -1, 1)), here, atol=1e-6)


def test_points_are_held_and_palpated_on_the_surface():
    points, faces = egg()
    placing = proposal(body_of(points, faces), (0.032, 0.0, 0.0), (-0.005, 0.0, 0.017))
    assert isinstance(placing.hold, BallRegion)
    assert placing.hold.center == pytest.approx((0.030, 0.0, 0.0), abs=1.5e-3)
    areas, centres = triangle_areas(points, faces), points[faces].mean(axis=1)
    assert areas[placing.hold.level(centres) <= 0].sum() / areas.sum() == pytest.approx(HELD, abs=0.01)
    point, normal = (np.asarray(v) for v in (placing.palpation.point, placing.palpation.normal))
    assert point == pytest.approx((-0.005, 0.0, 0.0148), abs=1.5e-3) and normal @ (0, 0, 1) > 0.97
    # The probe starts clear of the body.
    start = point + (RADIUS * 0.060 + GAP) * normal
    assert distance_to_surface(start[None], points, faces)[0] >= RADIUS * 0.060 * 0.999


def cup():
    """A box of 60 mm with a shaft, 8 mm wide and 40 mm deep, in its top."""
    outer, (deep, inward) = box((0.0, 0.0, 0.0), (0.06, 0.06, 0.06)), box((0.026, 0.026, 0.02), (0.034, 0.034, 0.059))
    return split(*together(outer, (deep, inward[:, ::-1])), times=3)


REFUSED = {
    "off the surface": ((0.03, 0.0, 0.0), (0.0, 0.0, 0.1), "--probe is 85 mm from the surface, which lies between"),
    "in metres": ((30.0, 0.0, 0.0), None, "--hold is 2.99.* mm from the surface"),
    "held": ((0.03, 0.0, 0.0), (0.028, 0.0, 0.0), "--probe is in the clamped region, or closer to it"),
}


@pytest.mark.parametrize("what", REFUSED)
def test_a_point_out_of_place_is_refused(what):
    hold, probe, sentence = REFUSED[what]
    with pytest.raises(StudyError, match=f"egg: {sentence}"):
        proposal(body_of(*egg()), hold, probe)


def test_a_point_that_the_probe_cannot_reach_is_refused():
    points, faces = cup()
    assert proposal(body_of(points, faces), "bottom", (0.03, 0.06, 0.04)).palpation.normal[1] > 0.99
    with pytest.raises(StudyError, match=r"a probe of [0-9.]+ mm radius does not get there, the body is in its way"):
        proposal(body_of(points, faces), "bottom", (0.03, 0.03, 0.02))


NAMED = {"VH_F_Spleen": "spleen", "kidney-left_2": "kidney", "LIVER": "liver", "myStomach": "stomach"}


def test_a_tissue_is_taken_from_a_name_that_tells_one():
    assert {name: tissue_named(name) for name in NAMED} == NAMED
    for name, sentence in {
        "body": "body does not name its organ; say which tissue it is: --tissue bladder, kidney",
        "gallbladder": "gallbladder does not name its organ",
        "liver_and_spleen": "names liver and spleen",
    }.items():
        with pytest.raises(StudyError, match=sentence):
            tissue_named(name)


def test_a_body_without_a_free_patch_is_an_error():
    points, faces = egg()
    inside_out = body_of(points, faces[:, ::-1])
    with pytest.raises(StudyError, match="egg: no freely reachable patch lies far from its clamped end"):
        proposal(inside_out)
