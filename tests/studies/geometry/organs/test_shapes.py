"""The organs as functions of position: sizes from the literature, even walls, boxes, attachments, refusals."""

import inspect
import json
from dataclasses import replace

import numpy as np
import pytest
from skimage.measure import euler_number, label

from studies.base.errors import StudyError
from studies.geometry import LIVER_PRESS_DIRECTION, LIVER_PROBE_NORMAL, LIVER_PROBE_POINT
from studies.geometry.mesh.organ_mesh import signed_volume, triangle_areas, triangle_normals
from studies.geometry.organs import SHAPES, vary
from studies.geometry.shape.levelset import at_depth, gradient, normals, project
from studies.geometry.surface.first_surface import first_surface

ORGANS = tuple(name for name, make in SHAPES.items() if make().literature is not None)
HOLLOW = tuple(name for name in ORGANS if SHAPES[name]().wall is not None)
MM = 1e-3


@pytest.fixture(scope="module")
def fine():
    """Points and triangles of every organ's outer surface, edges about 4 mm."""
    return {name: first_surface(replace(SHAPES[name](), cell=4 * MM)) for name in ORGANS}


@pytest.mark.parametrize("name", ORGANS)
def test_volume_is_that_of_the_literature(fine, name):
    shape = SHAPES[name]()
    surface = first_surface(replace(at_depth(shape, shape.wall), cell=4 * MM)) if shape.wall else fine[name]
    # Facets 4 mm wide cut off 0.2 to 1 per cent; the spread between people is far larger.
    assert signed_volume(*surface) * 1e6 == pytest.approx(shape.literature.volume_ml, rel=0.15)


def check_topology(shape, cell):
    """On a grid, organ and lumen: one piece, one outside, the Euler number of a ball; room in the box."""
    axes = [np.arange(a, b, cell) for a, b in zip(shape.low, shape.high, strict=True)]
    grid = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1)
    level = shape.level(grid.reshape(-1, 3)).reshape(grid.shape[:3])
    for depth in (0.0, *([shape.wall] if shape.wall else [])):
        inside = level < -depth
        assert label(inside, connectivity=1, return_num=True)[1] == 1
        assert label(~inside, connectivity=1, return_num=True)[1] == 1
        assert euler_number(inside, connectivity=1) == 1
    rim = np.ones(level.shape, bool)
    rim[2:-2, 2:-2, 2:-2] = False
    assert not ((level < 0) & rim).any()  # two cells to spare, as Shape promises
    return level


def check_variant(name, seed, spread):
    """A random organ is closed, of genus 0 inside and out, in its box, with a wall that fits and attachments."""
    shape = SHAPES[name](**vary(name, seed, spread))
    level = check_topology(shape, cell=5 * MM)
    assert shape.probe is not None and abs(shape.level(np.array([shape.probe.point]))[0]) < 1e-12
    if shape.wall:
        # The wall is nowhere thicker than the organ, whose thickest part is at the lowest level.
        assert shape.wall < 0.25 * -level.min()


@pytest.mark.parametrize("name", ORGANS)
def test_organs_and_random_ones_are_organs(name):
    check_topology(SHAPES[name](), cell=4 * MM)
    for seed, spread in ((0, 0.2), (1, 0.2), (4, 0.3)):
        check_variant(name, seed, spread)


@pytest.mark.parametrize("name", ORGANS)
def test_random_parameters_are_plausible_and_repeatable(name):
    assert vary(name, 3) == vary(name, 3) == json.loads(json.dumps(vary(name, 3)))
    assert vary(name, 3) != vary(name, 4) and vary(name, 3, 0.0) == default_parameters(name)
    default = default_parameters(name)
    ratio = np.array([[vary(name, seed)[key] / default[key] for key in default] for seed in range(200)])
    assert ratio.min() > 0.8 and ratio.max() < 1.2
    assert ratio.min(axis=0).max() < 0.9 and ratio.max(axis=0).min() > 1.1
    # Shares 0.7 and 0.3 of two equal spreads: the correlation of two lengths is 0.49 / (0.49 + 0.09) = 0.84.
    free = [k for k, key in enumerate(default) if key != "wall"]
    together = np.corrcoef(ratio.T)
    assert np.abs(together[np.ix_(free, free)] - np.eye(len(free)) * 0.155 - 0.845).max() < 0.1  # 200 draws: +- 0.03
    if "wall" in default:
        wall = list(default).index("wall")
        assert np.abs(np.delete(together[wall], wall)).max() < 0.25


def default_parameters(name):
    return {key: p.default for key, p in inspect.signature(SHAPES[name]).parameters.items()}


@pytest.mark.parametrize("hollow", HOLLOW)
def test_walls_are_even(fine, hollow):
    shape = SHAPES[hollow]()
    points = fine[hollow][0]
    inner = points - shape.wall * normals(shape, points)
    # The level of one tube is the exact distance; in the creases where two blend it grows more slowly inwards.
    miss = np.abs(shape.level(inner) + shape.wall) / shape.wall
    assert np.median(miss) < 0.05 and np.quantile(miss, 0.95) < 0.15 and miss.max() < 0.5
    slope = np.linalg.norm(gradient(shape.level, inner, 1e-6), axis=1)
    assert np.quantile(np.abs(slope - 1.0), 0.95) < 0.15


@pytest.mark.parametrize("name", ORGANS)
def test_probe_is_on_the_surface_and_looks_out(name):
    shape = SHAPES[name]()
    point, normal = np.array(shape.probe.point), np.array(shape.probe.normal)
    assert abs(shape.level(point[None])[0]) < 1e-12
    assert normals(shape, point[None])[0] == pytest.approx(normal, abs=1e-6)
    assert np.linalg.norm(shape.press) == pytest.approx(1.0, abs=1e-12)
    # Nothing of the organ stands in the way of an instrument 40 mm thick.
    side = np.linalg.qr(np.column_stack([normal, np.eye(3)]))[0][:, 1:]
    ring = np.array([np.cos(t) * side[:, 0] + np.sin(t) * side[:, 1] for t in np.linspace(0, 2 * np.pi, 13)])
    path = point + 0.02 * normal + np.vstack([np.zeros(3), 0.0195 * ring])
    away = path[:, None] + np.linspace(0.0, 0.2, 41)[:, None] * normal
    assert (shape.level(away.reshape(-1, 3)) > 0).all()


@pytest.mark.parametrize(
    ("organ", "patch", "area"),
    # [cm^2]. Bare area: a tenth of a liver's face under the diaphragm; hila 3 x 5 cm; the round ends of tubes 22 to
    # 35 mm wide: half spheres have 8 to 19.
    [
        ("liver", "bare_area", (30, 50)),
        ("kidney", "hilum", (10, 22)),
        ("spleen", "hilum", (5, 15)),
        ("stomach", "cardia", (10, 20)),
        ("stomach", "pylorus", (10, 20)),
        ("bladder", "neck", (6, 16)),
    ],
)
def test_attachments_have_plausible_areas(fine, organ, patch, area):
    points, triangles = fine[organ]
    inside = (SHAPES[organ]().regions[patch].level(points) < 0)[triangles].mean(axis=1)
    assert area[0] < 1e4 * (inside * triangle_areas(points, triangles)).sum() < area[1]


@pytest.mark.parametrize(("organ", "axis"), [("bladder", 0), ("kidney", 2)])
def test_what_is_symmetric_is_symmetric(organ, axis):
    shape = SHAPES[organ]()
    x = np.random.default_rng(1).uniform(shape.low, shape.high, (500, 3))
    mirrored = x * np.where(np.arange(3) == axis, -1.0, 1.0)
    assert shape.level(x) == pytest.approx(shape.level(mirrored), abs=1e-14)


def test_the_liver_is_a_wedge_with_a_notch_and_grooves():
    shape = SHAPES["liver"]()

    def inside(x, y, z):
        return shape.level(np.array([[x, y, z]]) * MM)[0] < 0

    # Between the front margin and the back of the visceral face there is air: the face is hollow.
    assert inside(-45, -38, -57) and inside(-45, 60, 4) and not inside(-45, 11, -26.5)
    points, _ = first_surface(shape)
    heights = [np.ptp(points[np.abs(points[:, 0] - x) < 0.008][:, 2]) for x in (-0.03, 0.05, 0.10)]
    assert heights[0] > 1.5 * heights[1] > 2.0 * heights[2] > 0  # thin out to the tip of the left lobe
    # Across the falciform line, on the front, the middle is further back than both sides (y points to the back).
    sides = project(shape, np.array([[x, -0.06, 0.02] for x in (0.003, 0.017, 0.031)]))
    assert sides[1, 1] > 0.5 * (sides[0, 1] + sides[2, 1]) + 1e-3
    # Along the lower margin the notch cuts in: the lowest level there rises above that of its neighbours' line.
    z = np.linspace(-0.1, 0.05, 1501)
    lowest = []
    for x in (-0.01, 0.017, 0.044):
        columns = [np.column_stack([np.full_like(z, x), np.full_like(z, y), z]) for y in np.linspace(-0.07, -0.03, 21)]
        levels = [(column[:, 2], shape.level(column)) for column in columns]
        lowest.append(min(height[level < 0].min() for height, level in levels if (level < 0).any()))
    assert lowest[1] > 0.5 * (lowest[0] + lowest[2]) + 2e-3


def test_a_plane_meets_the_liver_head_on_where_it_is_smooth():
    shape, press = SHAPES["liver"](), np.array(LIVER_PRESS_DIRECTION)
    assert (shape.probe.point, shape.probe.normal) == (LIVER_PROBE_POINT, LIVER_PROBE_NORMAL)
    assert LIVER_PROBE_NORMAL[1] < -0.8
    points, triangles = first_surface(shape)
    near = points[np.linalg.norm(points - points[np.argmin(points @ press)], axis=1) < 0.012]
    # Smooth over the 2.4 cm that touch first; on the thin margin it would be -0.55 to -0.02.
    assert len(near) > 20 and (normals(shape, near) @ press).max() < -0.8
    # The bare area looks the way the plane pushes: pressed against, not torn off.
    held = (shape.regions["bare_area"].level(points) < 0)[triangles].all(axis=1)
    patch = triangle_normals(points, triangles[held]).sum(axis=0)
    assert patch @ press > 0.9 * np.linalg.norm(patch)


REFUSED = {
    "kidney: length = -110.0 mm is not a length": lambda: SHAPES["kidney"](length=-110.0),
    "spleen: notch = nan mm is not a length": lambda: SHAPES["spleen"](notch=float("nan")),
    "stomach: a wall of 40 mm leaves no lumen": lambda: SHAPES["stomach"](wall=40.0),
    "bladder: a wall of 12 mm leaves no lumen": lambda: SHAPES["bladder"](wall=12.0),
    "liver: depth = inf mm is not a length": lambda: SHAPES["liver"](depth=float("inf")),
    "a wall of 0.06 m does not fit into a ball of radius 0.05 m": lambda: SHAPES["ball"](wall=0.06),
    "a wall of 0.0 m does not fit": lambda: SHAPES["ball"](wall=0.0),
    "unknown organ 'kidny'; did you mean 'kidney'": lambda: vary("kidny", 0),
    "the seed -1 is not a whole number": lambda: vary("kidney", -1),
    "a spread of 0.5 is outside 0 to 0.3": lambda: vary("kidney", 0, 0.5),
}


@pytest.mark.parametrize("sentence", REFUSED)
def test_impossible_organs_get_a_sentence(sentence):
    with pytest.raises(StudyError, match=sentence):
        REFUSED[sentence]()
