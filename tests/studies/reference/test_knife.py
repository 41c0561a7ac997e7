"""A knife in the deformed body: exact in a uniform deformation, refused where a plane is too far from it."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from skfem import MeshTet, MeshTet2

from studies.base.errors import StudyError
from studies.geometry import HalfSpace
from studies.reference.knife import MOST, pulled_back
from studies.reference.load import reference_for
from studies.scene.library.ball_incised import BALL_INCISED
from studies.scene.library.ball_squeeze import BALL_SQUEEZE

MESH = MeshTet2.from_mesh(MeshTet.init_tensor(*[np.linspace(-0.5, 0.5, 9)] * 3))
REST = MESH.doflocs.T
GRADIENT = np.array([[1.2, 0.1, 0.0], [-0.2, 0.9, 0.3], [0.05, 0.0, 1.1]])
KNIFE = HalfSpace((0.05, 0.02, 0.0), (0.3, 0.1, -1.0))
BLADE = HalfSpace((0.1, 0.0, 0.05), (1.0, 0.2, 0.1))


def solution(displacement, scene=BALL_INCISED):
    """What `pulled_back` asks of a reference, on a cube."""
    fields = {"nodes": REST, "displacement": np.array([0 * displacement, displacement, 2 * displacement])}
    return SimpleNamespace(scene=scene, mesh=MESH, size=3**0.5, field=fields.__getitem__)


def uniform() -> SimpleNamespace:
    return solution(REST @ (GRADIENT - np.eye(3)).T + [0.01, -0.02, 0.03])


@pytest.mark.parametrize("knife", [KNIFE, HalfSpace(KNIFE.point, (-0.3, -0.1, 1.0))])
def test_a_uniform_deformation_is_pulled_back_exactly(knife):
    pullback = pulled_back(uniform(), 1, "knife", knife, BLADE)
    assert pullback.plane_deviation < 1e-12 and pullback.front_deviation < 1e-12
    normal = GRADIENT.T @ knife.normal  # of n . (F X + c - p) = 0
    assert pullback.cut.plane.normal == pytest.approx(normal / np.linalg.norm(normal), abs=1e-12)
    random = np.random.default_rng(0).uniform(-1, 1, (400, 3))
    moved = random @ GRADIENT.T + [0.01, -0.02, 0.03]
    assert np.array_equal(pullback.cut.plane.level(random) > 0, knife.level(moved) > 0)
    in_plane = random - np.outer(pullback.cut.plane.level(random), pullback.cut.plane.normal)
    there = in_plane @ GRADIENT.T + [0.01, -0.02, 0.03]
    assert np.array_equal(pullback.cut.within.level(in_plane) > 0, BLADE.level(there) > 0)
    assert pullback.cut.at == BALL_INCISED.checkpoints[1]


def test_before_any_load_the_knife_is_the_cut():
    pullback = pulled_back(uniform(), 0, "knife", KNIFE)
    assert pullback.cut.plane.level(np.array([KNIFE.point])) == pytest.approx(0.0, abs=1e-12)
    assert pullback.cut.plane.normal == pytest.approx(KNIFE.normal / np.linalg.norm(KNIFE.normal), abs=1e-12)
    assert pullback.cut.within is None


def test_a_knife_that_bends_is_measured_and_refused():
    # Places on x = 0 in the deformed body were on x = -c z² at rest; no plane is nearer than c/8 to all of that.
    def bent(c):
        return solution(c * np.column_stack([REST[:, 2] ** 2, *np.zeros((2, len(REST)))]))

    knife = HalfSpace((0.0, 0.0, 0.0), (1.0, 0.0, 0.0))
    pullback = pulled_back(bent(0.06), 1, "knife", knife, most=0.1)
    assert 0.06 / 8 <= pullback.plane_deviation < 0.06 / 4
    assert pullback.cut.plane.normal == pytest.approx((1, 0, 0), abs=5e-3)
    assert pulled_back(bent(0.06), 1, "knife", knife).plane_deviation < MOST * 3**0.5
    with pytest.raises(StudyError, match=r"its plane is curved by 22\S* mm, 1\.3 % of the size"):
        pulled_back(bent(0.12), 1, "knife", knife)


def test_a_front_that_bends_is_measured_and_refused():
    bent = solution(0.2 * np.column_stack([REST[:, 1] ** 2, *np.zeros((2, len(REST)))]))
    knife, blade = HalfSpace((0.0, 0.0, 0.0), (0.0, 0.0, 1.0)), HalfSpace((0.02, 0.0, 0.0), (1.0, 0.0, 0.0))
    with pytest.raises(StudyError, match="its front is curved"):
        pulled_back(bent, 1, "knife", knife, blade)


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"plane": HalfSpace((2.0, 0.0, 0.0), (1.0, 0.0, 0.0))}, "misses the body"),
        ({"within": HalfSpace((-3.0, 0.0, 0.0), (1.0, 0.0, 0.0))}, "misses the body"),
        ({"checkpoint": 3}, "is at checkpoint 3, and there are 3"),
        ({"checkpoint": -1}, "is at checkpoint -1"),
        ({"solution": solution(0 * REST, BALL_SQUEEZE)}, "solved on an octant"),
    ],
)
def test_refusals(changes, message):
    given = {"solution": uniform(), "checkpoint": 1, "name": "knife", "plane": KNIFE, "within": BLADE} | changes
    with pytest.raises(StudyError, match=message):
        pulled_back(**given)


def test_the_middle_of_a_pulled_ball_was_its_middle(tmp_path):
    # Both caps are alike, so the plane halfway between them is the equator at rest.
    reference = reference_for(tmp_path, BALL_INCISED)
    pull = float(BALL_INCISED.held[1].path(BALL_INCISED.checkpoints[0])[2])
    assert pull > 0.002
    pullback = pulled_back(reference, 0, "knife", HalfSpace((0.0, 0.0, pull / 2), (0.0, 0.0, 1.0)))
    assert pullback.cut.plane.level(np.zeros((1, 3)))[0] == pytest.approx(0.0, abs=0.02 * pull)
    assert pullback.cut.plane.normal == pytest.approx((0, 0, 1), abs=2e-3)
    assert replace(pullback.cut, contact=True).plane == pullback.cut.plane
