"""Planes through surfaces that are not meshed yet: volumes of what they leave, angles, and what is refused."""

import numpy as np
import pytest

from studies.base.errors import StudyError
from studies.geometry import BallRegion, HalfSpace
from studies.geometry.surface.sheet import check_sheet, sheet_of
from tests.massspring.conftest import icosphere

RADIUS = 0.05


def plane(height: float, direction=(0.0, 0.0, 1.0)) -> HalfSpace:
    unit = np.asarray(direction) / np.linalg.norm(direction)
    return HalfSpace(tuple(height * unit), tuple(direction))


@pytest.mark.parametrize("height", [-0.03, 0.001, 0.02, 0.046])
def test_caps_of_a_ball_have_their_volumes_and_angles(height):
    sheet = sheet_of(plane(height, (1.0, 2.0, -3.0)), *icosphere(5, RADIUS))
    behind, front = sheet.pieces
    cap = (RADIUS - height) ** 2 * (2 * RADIUS + height) / (4 * RADIUS**3)
    assert front.share == pytest.approx(cap, rel=5e-3)
    assert behind.share + front.share == pytest.approx(1.0, rel=1e-12, abs=0)
    np.testing.assert_allclose(sheet.angles, np.degrees(np.arccos(abs(height) / RADIUS)), atol=3.0)
    around = np.linalg.norm(np.diff(sheet.trace, axis=1), axis=2).sum()
    assert around == pytest.approx(2 * np.pi * np.sqrt(RADIUS**2 - height**2), rel=5e-3)


def test_a_dent_is_missing_in_the_piece_round_it():
    """A ball whose top, from half its radius on, is turned in: a level plane below meets the dent."""
    points, triangles = icosphere(5, RADIUS)
    high = points[:, 2] > 0.5 * RADIUS
    points[high, 2] = RADIUS - points[high, 2]
    below, above = sheet_of(plane(0.2 * RADIUS), points, triangles).pieces
    turned, over, dent = (np.pi * height**2 * (3 - height) / 3 for height in (0.5, 0.8, 0.2))
    whole = 4 * np.pi / 3 - 2 * turned
    assert below.share + above.share == pytest.approx(1.0, rel=1e-12, abs=0)
    assert above.share == pytest.approx((over - 2 * turned + dent) / whole, rel=0.02)


@pytest.mark.parametrize(
    ("height", "within", "held", "sentence"),
    [
        (0.051, None, (), "misses the body"),
        (0.047, None, (), r"leaves a piece of 0\.2.* %"),
        (0.0, None, (HalfSpace((0.0, 0.0, 0.0), (1.0, 0.0, 0.0)),), "crosses the outline of a held region"),
        (0.0, HalfSpace((0.06, 0.0, 0.0), (1.0, 0.0, 0.0)), (), "is all of it; leave out within"),
        (0.0, HalfSpace((-0.06, 0.0, 0.0), (1.0, 0.0, 0.0)), (), "holds nothing of the section"),
        (0.0, BallRegion((0.07, 0.0, 0.0), 0.01), (), "lies outside the body"),
        (0.0, BallRegion((0.0, 0.0, 0.02), 0.01), (), "holds nothing of the plane"),
        (0.0, BallRegion((0.0, 0.0, 0.0), 0.051), (), "reaches the surface"),
    ],
)
def test_sheets_that_no_mesh_can_have(height, within, held, sentence):
    with pytest.raises(StudyError, match=sentence):
        check_sheet("ball", "cut", icosphere(4, RADIUS), plane(height), within, held)
