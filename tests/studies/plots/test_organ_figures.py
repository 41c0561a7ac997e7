"""Pictures of organs: cuts, patches, springs, and what the words say."""

import numpy as np
import pytest
from matplotlib.colors import to_rgb

from studies.geometry import HalfSpace, OrganMesh, organ
from studies.geometry.shape.regions import region_to_dict
from studies.plots.figures import organ_springs, organs
from studies.plots.style.cut import cut_face, cut_surface
from tests.studies.plots.made_up import CELLS, POINTS, RADIUS, TRIANGLES

CAP = {"top_cap": region_to_dict(HalfSpace((0.0, 0.0, 0.02), (0.0, 0.0, -1.0)))}


def octahedron(**changes):
    """A ball of six surface nodes whose triangle with x, y, z > 0 is held."""
    values = {
        "name": "ball",
        "points": POINTS,
        "triangles": TRIANGLES,
        "tetrahedra": CELLS,
        "surface_count": 6,
        "patches": {"top_cap": np.array([0, 2, 4])},
        "recipe": {"organ": "ball", "parameters": {"radius": RADIUS}, "regions": CAP},
    }
    return OrganMesh(**(values | changes))


@pytest.fixture(scope="module")
def hollow(mesh_cache):
    """A real hollow mesh: 50 mm ball, 10 mm wall."""
    return organ("ball", 150, parameters={"radius": RADIUS, "wall": 0.01})


@pytest.mark.parametrize("share", [-0.55, 0.3])
def test_half_a_body_and_its_cut_face_enclose_what_is_left(share):
    normal = np.array([0.48, 0.6, 0.64])
    height = share * RADIUS
    corners, source = cut_surface(POINTS, TRIANGLES, normal, height)
    face = cut_face(POINTS, CELLS, normal, height)
    assert (corners @ normal <= height + 1e-15).all() and face @ normal == pytest.approx(height, abs=1e-15)
    original = np.cross(*(POINTS[TRIANGLES[source]][:, k] - POINTS[TRIANGLES[source]][:, 0] for k in (1, 2)))
    assert (
        np.einsum("ij,ij->i", np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), original) > 0
    ).all()
    # Cones over the pieces from a point of the plane, to which the face adds nothing, against a sum of layers.
    apex = height * normal
    volume = np.linalg.det(corners - apex).sum() / 6
    levels = np.linspace(-RADIUS, height, 2001)
    area = [face_area(cut_face(POINTS, CELLS, normal, z)) for z in levels]
    assert volume == pytest.approx(np.trapezoid(area, levels), rel=1e-5)  # 2000 layers of a piecewise quadratic


def face_area(face):
    """Sum of the areas of convex polygons (p, 4, 3)."""
    return 0.5 * np.linalg.norm(np.cross(face[:, 2] - face[:, 0], face[:, 3] - face[:, 1]), axis=1).sum()


def test_the_middle_of_an_octahedron_is_a_square_and_of_a_shell_a_ring(hollow):
    normal = np.array([0.0, 0.0, 1.0])
    assert face_area(cut_face(POINTS, CELLS, normal, 1e-9)) == pytest.approx(2 * RADIUS**2, rel=1e-6)
    ring = face_area(cut_face(hollow.points, hollow.tetrahedra, normal, 1e-9))
    # Facets at 150 nodes cut 3 per cent off the area of each circle.
    assert ring == pytest.approx(np.pi * (RADIUS**2 - (RADIUS - 0.01) ** 2), rel=0.06)
    assert len(cut_face(POINTS, CELLS, normal, 2 * RADIUS)) == 0
    assert len(cut_surface(POINTS, TRIANGLES, normal, 2 * RADIUS)[0]) == len(TRIANGLES)


def test_organs_show_their_patch_in_its_colour():
    figure = organs.figure({"ball": octahedron()})
    colour, tissue = np.array(to_rgb(organs.PATCH_COLOURS[0])), np.array(to_rgb(organs.TISSUE))
    smooth, mesh = (np.asarray(axes.collections[0].get_facecolor())[:, :3] for axes in figure.axes[:2])
    assert np.argmax(colour) != np.argmax(tissue)
    share = (smooth.argmax(axis=1) == colour.argmax()).mean()
    assert 0.2 < share < 0.55  # a cap 30 mm high of a ball, from slightly above: 30 % of its surface
    assert (mesh.argmax(axis=1) == colour.argmax()).sum() == 1  # from behind: the held triangle among four
    assert "attached: top cap" in [text.get_text() for text in figure.legends[0].get_texts()]


def test_a_cut_shows_the_face_over_what_is_behind(hollow):
    for mesh in (hollow, octahedron()):
        axes = organs.figure({"ball": mesh}).axes[2]
        behind, face = axes.collections
        assert len(face.get_paths()) == len(cut_face(mesh.points, mesh.tetrahedra, *middle(mesh)))
        assert bool(behind.get_paths()) == mesh.hollow  # a solid hides its back
        assert face.get_zorder() == behind.get_zorder()  # the later one lies on top


def middle(mesh):
    normal = np.array([0.0, -1.0, 0.0])
    return normal, float((mesh.points @ normal).mean())


def test_springs_are_those_of_the_body():
    mesh = octahedron(tetrahedra=np.zeros((0, 4), int), points=POINTS[:6])
    figure = organ_springs.figure({"ball": mesh})
    body = organ_springs.body_of(mesh)
    for axes, (kind, _) in zip(figure.axes[1:], organ_springs.PANELS.values(), strict=True):
        lines = axes.collections[0].get_segments()
        assert len(lines) == (body.springs.kind == kind).sum() > 0
        drawn = sorted(np.linalg.norm(line[1] - line[0]) for line in map(np.asarray, lines))
        ends = organs.FRONT.see(body.rest)[body.springs.ends[body.springs.kind == kind].astype(int)][:, :, :2]
        assert drawn == pytest.approx(sorted(np.linalg.norm(ends[:, 1] - ends[:, 0], axis=1)))
