"""A region painted on the surface in a file is held alike on the bodies that are made of it."""

import numpy as np
import pytest

from studies.base.errors import StudyError
from studies.geometry import KIDNEY_REGIONS, organ, painted, scan
from studies.geometry.mesh.organ_mesh import counted_edges, triangle_areas
from studies.geometry.shape.regions import region_from_dict, region_to_dict
from studies.geometry.surface.distance import distance_to_surface
from studies.geometry.surface.painted import painted_region
from tests.campaigns import campaign
from tests.studies.geometry.boxes import box, split
from tests.studies.geometry.files import writers

MM = 1e-3
HILUM = "hilum"


def patch_area(mesh, name=HILUM):
    return triangle_areas(mesh.points, mesh.patch_triangles(name)).sum()


def outline(mesh, name=HILUM):
    """Nodes of the edges that one triangle of the patch has to itself."""
    edges, counts = counted_edges(mesh.patch_triangles(name))
    assert (np.bincount(edges[counts == 1].ravel())[np.unique(edges[counts == 1])] == 2).all(), "one closed line"
    return np.unique(edges[counts == 1])


def turned():
    """A rotation after which rows of nodes run along no border."""
    return np.linalg.qr(np.random.default_rng(5).normal(size=(3, 3)))[0]


@pytest.fixture(scope="module")
def kidney(mesh_cache):
    """An organ whose mesh knows nothing of its hilum, and the hilum."""
    return organ("kidney", 2000, regions={}, fill=False, exact=True)


@pytest.fixture(scope="module")
def region():
    return KIDNEY_REGIONS[HILUM]


@pytest.fixture(scope="module")
def path(kidney, region, tmp_path_factory):
    """The same in millimetres, its hilum painted on the nodes inside."""
    file = tmp_path_factory.mktemp("painted") / "kidney.vtp"
    held = {f"patch_{HILUM}": (region.level(kidney.points) < 0).astype(float)}
    file.write_bytes(writers.vtp(kidney.points / MM, kidney.triangles, "packed", held))
    return file


@pytest.mark.parametrize("nodes", [300, campaign(800)])
def test_a_painted_region_travels_to_the_new_surface(kidney, region, path, nodes):
    mesh = scan(path, nodes, unit="mm", fill=False)
    true = organ("kidney", 2000, fill=False, exact=True)
    assert patch_area(mesh) == pytest.approx(patch_area(true), rel=0.04)
    # Its outline is where it was painted: half an edge of the file is 1.3 mm, one of this mesh 4 to 7 mm.
    away = np.abs(region.level(mesh.points[outline(mesh)]))
    edge = np.sqrt(4 / np.sqrt(3) * triangle_areas(kidney.points, kidney.triangles).sum() / len(kidney.triangles))
    assert away.mean() < 0.25 * edge and away.max() < 0.75 * edge


def test_its_level_is_the_distance_to_the_border_along_the_surface():
    """A cap of a ball: the border is a circle, the distance an arc."""
    points, faces = split(*box((-1, -1, -1), (1, 1, 1)), times=5)
    points = 0.05 * points / np.linalg.norm(points, axis=1, keepdims=True) @ turned()
    region = painted_region(points, faces, points[:, 2] > 0.03, "ball")
    angle = np.linspace(0, np.pi, 200)
    arc = 0.05 * (angle - np.arccos(0.6))
    for turn in range(6):
        ring = np.array([[np.cos(turn), np.sin(turn)]]) * np.sin(angle)[:, None]
        meridian = 0.05 * np.column_stack([ring, np.cos(angle)])
        # Nodes are 2.4 mm apart and place the border to 0.7 mm; farther out the level is off by a sixth at most.
        for reach, atol in ((0.002, 0.001), (0.01, 0.0015)):
            near = np.abs(arc) < reach
            np.testing.assert_allclose(region.level(meridian)[near], arc[near], atol=atol)
        away = np.abs(arc) > 0.001
        assert (np.sign(region.level(meridian)) == np.sign(arc))[away].all()
    # A fraction of the 6,146 nodes represents all of it, also as JSON.
    assert len(region.samples) < 1200
    again = region_from_dict(region_to_dict(region))
    assert (again.level(meridian) == region.level(meridian)).all()


def test_without_a_new_surface_the_painted_nodes_stay(path, kidney, region):
    mesh = scan(path, unit="mm", fill=False)
    inside = np.flatnonzero(region.level(kidney.points) < 0)
    assert (distance_to_surface(mesh.points[mesh.patches[HILUM]], kidney.points, kidney.triangles) < 1e-9).all()
    assert len(mesh.patches[HILUM]) == len(inside)


def test_what_is_not_painted_is_one_sentence(path, kidney, tmp_path):
    with pytest.raises(StudyError, match=r"kidney\.vtp has the patches hilum; there is no 'end' among them"):
        painted(path, "end", "mm")
    bare = tmp_path / "bare.vtp"
    bare.write_bytes(writers.vtp(kidney.points, kidney.triangles))
    with pytest.raises(StudyError, match=r"bare\.vtp has no point data called patch_NAME"):
        painted(bare, "end", "m")
    for value, what in ((0.0, "nothing of the surface"), (1.0, "the whole surface")):
        held = {"patch_end": np.full(len(kidney.points), value)}
        bare.write_bytes(writers.vtp(kidney.points, kidney.triangles, "text", held))
        with pytest.raises(StudyError, match=f"the painted patch 'end' holds {what}; paint a part of it"):
            scan(bare, 300, unit="m")
