"""An attachment is the same place on every mesh."""

import numpy as np
import pytest

from studies.geometry import BallRegion, HalfSpace, attach, ball, check_surface
from studies.geometry.mesh.organ_mesh import counted_edges, triangle_areas, unique_edges
from studies.geometry.organs import SHAPES
from studies.geometry.shape.regions import region_from_dict
from studies.geometry.surface.snap import crossing_edges, snap_region

RADIUS, CAP = 0.05, 0.035
CAPS = {
    "top": HalfSpace((0.0, 0.0, CAP), (0.0, 0.0, -1.0)),
    "bottom": HalfSpace((0.0, 0.0, -CAP), (0.0, 0.0, 1.0)),
}
COUNTS = (150, 300, 550)


def patch_area(mesh, name):
    return triangle_areas(mesh.points, mesh.patch_triangles(name)).sum()


@pytest.mark.parametrize("nodes", COUNTS)
@pytest.mark.parametrize(("organ", "name"), [("ball", "top"), ("ball", "bottom"), ("liver", "bare_area")])
def test_outline_is_one_closed_line_on_the_curve(bodies, organ, name, nodes):
    mesh = bodies[organ][nodes]
    region = region_from_dict(mesh.recipe["regions"][name])
    edges, counts = counted_edges(mesh.patch_triangles(name))
    edges = edges[counts == 1]
    assert np.abs(region.level(mesh.points[edges.ravel()])).max() < 1e-10  # metres; edges are 10 mm
    assert (np.bincount(edges.ravel())[np.unique(edges)] == 2).all()
    patch = mesh.patch_triangles(name)
    # A disc has one more node than edges less triangles: one piece, without holes.
    assert len(np.unique(patch)) - len(unique_edges(patch)) + len(patch) == 1
    assert not len(crossing_edges(region, mesh.points, unique_edges(mesh.triangles), 1e-10))
    assert set(np.unique(patch)) == set(mesh.patches[name])


def test_cap_area_converges_to_the_closed_form(balls):
    exact = 2 * np.pi * RADIUS * (RADIUS - CAP)
    for name in CAPS:
        ratio = np.array([patch_area(balls[nodes], name) / exact for nodes in COUNTS])
        # Facets inscribed in the cap: the area is short by about 6 / N, as that of the whole ball.
        assert (1 - ratio) * COUNTS == pytest.approx(5.8, abs=1.2), ratio


def test_without_snapping_the_cap_area_is_a_lottery(balls):
    """The test of the tests: the same patch by facets of meshes that know nothing of it misses by far more."""
    exact = 2 * np.pi * RADIUS * (RADIUS - CAP)
    miss = []
    for nodes in COUNTS:
        staircase = attach(ball(nodes, RADIUS, fill=False), CAPS)
        miss.append(abs(patch_area(staircase, "top") / exact - 1))
        assert miss[-1] > 2 * abs(patch_area(balls[nodes], "top") / exact - 1)
    assert max(miss) > 0.15


def test_fixed_nodes_stay():
    shape = SHAPES["ball"](RADIUS)
    mesh = ball(150, RADIUS, fill=False)
    fixed = np.zeros(150, bool)
    fixed[::7] = True
    points, _, _ = snap_region(shape, mesh.points, mesh.triangles, BallRegion((0.04, 0.0, 0.0), 0.03), fixed)
    assert (points[fixed] == mesh.points[fixed]).all() and (points[~fixed] != mesh.points[~fixed]).any()


def test_a_region_smaller_than_the_edges_gets_a_finer_surface():
    """A disc 16 mm wide on a ball of 150 nodes, whose edges are 16 mm: the surface is meshed finer there."""
    small = {"spot": BallRegion((0.0, 0.03, 0.04), 0.008)}
    mesh = ball(150, RADIUS, small)
    assert mesh.surface_count == 150
    check_surface(mesh.points[:150], mesh.triangles)
    assert len(mesh.patch_triangles("spot")) >= 3
    # The cap a sphere of radius r cuts from one of radius R around a point of it has the area pi r^2; facets lose some.
    assert 0.6 < patch_area(mesh, "spot") / (np.pi * 0.008**2) < 1.0
