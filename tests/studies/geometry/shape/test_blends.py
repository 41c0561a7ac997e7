"""Level functions, their building blocks and regions against closed forms."""

import numpy as np
import pytest

from studies.base.errors import StudyError
from studies.geometry import BallRegion, EllipsoidRegion, HalfSpace
from studies.geometry.organs import SHAPES
from studies.geometry.shape.blends import canal, closed, ellipsoid, groove, local_min, smooth_max, smooth_min
from studies.geometry.shape.levelset import gradient, normals, project
from studies.geometry.shape.regions import region_from_dict, region_to_dict

BALL = SHAPES["ball"](0.05)


def test_canal_of_two_spheres_is_the_round_cone():
    x = np.random.default_rng(2).uniform(-3, 5, (400, 3))
    # Closed form: the nearest point of the axis lies where distance and radius balance (Quilez, "Round cone").
    a, b, ra, rb = np.zeros(3), np.array([0.0, 0.0, 2.0]), 1.0, 0.5
    p = np.column_stack([np.linalg.norm(x[:, :2], axis=1), x[:, 2]])
    sine = (ra - rb) / 2.0
    cosine = np.sqrt(1 - sine**2)
    k = p @ (-sine, cosine)
    exact = p @ (cosine, sine) - ra
    exact = np.where(k > 2.0 * cosine, np.linalg.norm(x - b, axis=1) - rb, exact)
    exact = np.where(k < 0, np.linalg.norm(x - a, axis=1) - ra, exact)
    assert canal(x, [(0.0, 0.0, 0.0, ra), (0.0, 0.0, 2.0, rb)]) == pytest.approx(exact, abs=1e-12)


def test_canal_is_the_smallest_distance_to_its_spheres():
    spheres = closed([(0, 0, 0, 1.0), (3, 1, 0, 1.5), (4, -1, 2, 1.0), (6, 2, 1, 0.7)])
    x = np.random.default_rng(3).uniform(-3, 8, (120, 3))
    s = np.linspace(0, 1, 20001)
    at = np.array(spheres, float)[None]
    for _ in range(len(spheres) - 1):  # de Casteljau
        at = (1 - s)[:, None, None] * at[:, :-1] + s[:, None, None] * at[:, 1:]
    at = at[:, 0]
    brute = (np.linalg.norm(x[:, None] - at[:, :3], axis=2) - at[:, 3]).min(axis=1)
    distance = canal(x, spheres)
    # Sampling misses the minimum by curvature * spacing^2 / 8, some 1e-7 here, and never lies below it.
    assert (distance <= brute + 1e-12).all() and (brute - distance).max() < 1e-6


def largest_jump_of_curvature(spheres, count):
    """Of the meridian of a tube along z, between neighbours of `count` rays round its end at the origin."""
    angle = np.linspace(0.05, np.pi / 2 + 0.9, count)
    ray = np.column_stack([np.sin(angle), np.zeros(count), -np.cos(angle)])
    low, high = np.zeros(count), np.full(count, 3.0)
    for _ in range(50):
        middle = 0.5 * (low + high)
        inside = canal(middle[:, None] * ray, spheres) < 0
        low, high = np.where(inside, middle, low), np.where(inside, high, middle)
    x, h = low[:, None] * ray, 1e-3
    normal_x, normal_z = (canal(x + step, spheres) - canal(x - step, spheres) for step in h * np.eye(3)[[0, 2]])
    along = np.column_stack([-normal_z, np.zeros(count), normal_x]) / np.hypot(normal_x, normal_z)[:, None]
    bent = (canal(x + h * along, spheres) - 2 * canal(x, spheres) + canal(x - h * along, spheres)) / h**2
    return np.abs(np.diff(bent)).max()


def test_closed_ends_have_no_jump_of_curvature():
    tube = [(0.0, 0.0, 0.0, 1.0), (0.0, 0.0, 2.0, 1.3), (0.0, 0.0, 4.0, 1.0)]
    smooth = [largest_jump_of_curvature(closed(tube), count) for count in (200, 400, 800)]
    rough = [largest_jump_of_curvature(tube, count) for count in (200, 400, 800)]
    # A quarter of the spacing quarters what a continuous curvature changes by; a jump stays.
    assert smooth[2] < 0.3 * smooth[0] and rough[2] > 0.8 * rough[0] > 0.3


def test_local_min_is_a_rounded_and_local_union():
    a, b = np.random.default_rng(4).uniform(-50, 50, (2, 500))
    both = local_min(a, b, 16.0)
    exact = -8.0 * np.log(np.exp(-a / 8.0) + np.exp(-b / 8.0))
    assert both == pytest.approx(exact, abs=1e-12)
    swollen = np.minimum(a, b) - both
    assert (swollen >= 0).all() and swollen.max() <= 8.0 * np.log(2.0) + 1e-12
    far = np.abs(a - b) > 48.0
    # Three widths off it has swollen by 8 exp(-6) = 0.02, where smooth_min still adds 1.3 (0.6 at 100).
    assert swollen[far].max() < 0.021 and (np.minimum(a, b) - smooth_min(a, b, 16.0))[far].max() > 0.6
    h = 1e-4
    rounding = (local_min(h, -h, 16.0) - 2 * local_min(0.0, 0.0, 16.0) + local_min(-h, h, 16.0)) / h**2
    hyperbola = (smooth_min(h, -h, 16.0) - 2 * smooth_min(0.0, 0.0, 16.0) + smooth_min(-h, h, 16.0)) / h**2
    assert rounding == pytest.approx(hyperbola, rel=1e-4)  # as round as the other one


def test_blends_have_their_limits():
    a, b = np.array([-3.0, 1.0, 50.0]), np.array([2.0, 1.0, -50.0])
    assert smooth_min(a, b, 0.0) == pytest.approx(np.minimum(a, b))
    assert smooth_max(a, b, 0.0) == pytest.approx(np.maximum(a, b))
    assert smooth_min(a, b, 2.0)[1] == pytest.approx(0.0) and smooth_max(a, b, 2.0)[1] == pytest.approx(2.0)
    x = np.random.default_rng(2).normal(size=(20, 3))
    assert ellipsoid(x, (0, 0, 0), (2, 2, 2)) == pytest.approx(np.linalg.norm(x, axis=1) - 2, rel=1e-12)
    tip = np.array([[3.0, 0, 0], [0, 0, 0]])
    level = ellipsoid(tip, (0, 0, 0), (3, 1, 2))
    assert level[0] == pytest.approx(0.0, abs=1e-12) and np.isfinite(level[1])
    press = groove(np.array([[0.0, 0, 0], [0.5, 2, 0], [9, 0, 0]]), (0, 0, 0), (1, 0, 0), width=2.0, depth=5.0)
    assert press == pytest.approx([5.0, 5.0 / np.e, 5.0 * np.exp(-16)])


def test_gradient_and_normals_are_those_of_the_ball():
    x = np.random.default_rng(0).normal(size=(30, 3))
    radial = x / np.linalg.norm(x, axis=1, keepdims=True)
    assert gradient(BALL.level, 0.05 * radial, 1e-7) == pytest.approx(radial, abs=1e-8)
    assert normals(BALL, 0.05 * radial) == pytest.approx(radial, abs=1e-8)


def test_projection_meets_two_surfaces_at_once():
    x = np.random.default_rng(1).uniform(-0.03, 0.03, size=(40, 3)) + np.array([0.04, 0.04, 0.0])
    on = project(BALL, x, (lambda p: p[:, 2] - 0.01,))
    assert np.abs(np.linalg.norm(on, axis=1) - 0.05).max() < 1e-13 and np.abs(on[:, 2] - 0.01).max() < 1e-13
    with pytest.raises(StudyError, match="could not be brought onto the surface"):
        project(BALL, x, (lambda p: p[:, 2] - 0.2,))  # a plane that misses the ball


def test_levels_of_regions_are_negative_inside_and_survive_json():
    x = np.array([[0.0, 0.0, 2.0], [0.0, 0.0, 0.5]])
    for region, level in (
        (HalfSpace((0, 0, 1), (0, 0, 4.0)), [1.0, -0.5]),
        (BallRegion((0, 0, 2), 1.0), [-1.0, 0.5]),
        (EllipsoidRegion((0, 0, 0), (5, 5, 1)), [1.0, -0.5]),
    ):
        again = region_from_dict(region_to_dict(region))
        assert region.level(x) == pytest.approx(level) and type(again) is type(region)
        assert (again.level(x) == region.level(x)).all()
