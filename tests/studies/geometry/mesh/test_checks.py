"""Every fault of a mesh has its sentence, and sound meshes have none."""

import numpy as np
import pytest

from studies.base.errors import StudyError
from studies.geometry import check_surface, check_tetrahedra
from studies.geometry.mesh.checks import check_one_part
from studies.geometry.mesh.organ_mesh import boundary_triangles, signed_volume, surface_first, tetrahedron_volumes
from studies.geometry.mesh.quality import dihedral_angles, tetrahedron_radius_ratio, triangle_radius_ratio

REGULAR = np.array([[1.0, 1, 1], [1, -1, -1], [-1, 1, -1], [-1, -1, 1]]) * 0.01
TET = np.array([[0, 2, 1, 3]])
FACES = boundary_triangles(TET)


def two(gap):
    """Two tetrahedra that share a node (gap 0) or nothing."""
    points = np.vstack([REGULAR, 2 * REGULAR[0] - REGULAR + gap])
    second = FACES[:, ::-1] + 4
    faces = np.vstack([FACES, second])
    if gap == 0:
        faces[faces == 4] = 0
        points, faces = np.delete(points, 4, axis=0), faces - (faces > 4)
    return points, faces


def test_sound_meshes_pass():
    check_surface(REGULAR, FACES)
    check_tetrahedra(REGULAR, TET)
    check_surface(*two(0.1))
    assert signed_volume(REGULAR, FACES) == pytest.approx(tetrahedron_volumes(REGULAR, TET).sum(), rel=1e-14)


def broken_surfaces():
    nan = REGULAR.copy()
    nan[2, 1] = np.nan
    flat = REGULAR * [1, 1, 0]
    turned = FACES.copy()
    turned[1] = turned[1, ::-1]
    # A second tetrahedron on the edge 0-1: four triangles meet there.
    hinged = np.vstack([REGULAR, 2 * REGULAR[:2].mean(axis=0) - REGULAR[2:]])
    pair = np.vstack([FACES, boundary_triangles(np.array([[0, 4, 1, 5]]))])
    return {
        "1 points are not finite, the first is number 2": (nan, FACES),
        "open, 3 edges have one triangle only": (REGULAR, FACES[1:]),
        "is inverted": (REGULAR, FACES[:, ::-1]),
        "not manifold, 1 edges have over two triangles": (hinged, pair),
        "not manifold, it is pinched at point 0": two(0),
        "turned in opposite directions": (REGULAR, turned),
        "1 faces are duplicated, the first is triangle 0": (REGULAR, np.vstack([FACES, FACES[:1]])),
        "4 faces are duplicated": (REGULAR, np.vstack([FACES, FACES[:, ::-1]])),
        "enclosed volume is zero": (flat, FACES),
        "uses one point twice": (REGULAR, np.vstack([FACES, [[0, 1, 1]]])),
        "uses point 9, but there are only 4 points": (REGULAR, np.vstack([FACES, [[0, 1, 9]]])),
        "1 points belong to no triangle": (np.vstack([REGULAR, [[0.0, 0, 0]]]), FACES),
        "no triangle found": (REGULAR, np.empty((0, 3), int)),
        "points have shape": (REGULAR[:, :2], FACES),
        "is degenerate": sliver_surface(),
    }


def sliver_surface():
    """The tetrahedron with one edge split so near its end that two triangles have no width."""
    a, b, _ = FACES[0]
    near = REGULAR[a] + 1e-6 * (REGULAR[b] - REGULAR[a])
    both = np.isin(FACES, (a, b)).sum(axis=1) == 2
    faces = np.vstack(
        [FACES[~both], np.where(FACES[both] == a, 4, FACES[both]), np.where(FACES[both] == b, 4, FACES[both])]
    )
    return np.vstack([REGULAR, near]), faces


@pytest.mark.parametrize(("sentence", "mesh"), broken_surfaces().items())
def test_broken_surface_gets_its_sentence(sentence, mesh):
    with pytest.raises(StudyError, match=sentence) as caught:
        check_surface(*mesh, name="scan.stl")
    assert str(caught.value).startswith("scan.stl: ") and "\n" not in str(caught.value)


def test_parts_are_counted():
    check_one_part(FACES, "a")
    with pytest.raises(StudyError, match="2 separate parts"):
        check_one_part(two(0.1)[1], "a")


def test_broken_bodies_get_their_sentences():
    with pytest.raises(StudyError, match=r"1 tetrahedra have a negative volume, the first is number 0 \(-"):
        check_tetrahedra(REGULAR, TET[:, [1, 0, 2, 3]])
    flat = REGULAR.copy()
    flat[0] = flat[1:].mean(axis=0) + 1e-7
    with pytest.raises(StudyError, match=r"(sliver|negative)"):
        check_tetrahedra(flat, TET)
    with pytest.raises(StudyError, match="duplicated"):
        check_tetrahedra(REGULAR, np.vstack([TET, TET]))
    with pytest.raises(StudyError, match="no tetrahedron found"):
        check_tetrahedra(REGULAR, np.empty((0, 4), int))


def test_quality_of_known_shapes():
    assert tetrahedron_radius_ratio(REGULAR, TET)[0] == pytest.approx(1.0, abs=1e-12)
    assert dihedral_angles(REGULAR, TET) == pytest.approx(np.full((1, 6), np.degrees(np.arccos(1 / 3))), abs=1e-9)
    assert tetrahedron_radius_ratio(REGULAR, TET[:, [1, 0, 2, 3]])[0] == pytest.approx(-1.0, abs=1e-12)
    assert triangle_radius_ratio(REGULAR, FACES) == pytest.approx(np.ones(4), abs=1e-12)
    corner = np.vstack([np.zeros(3), np.eye(3)])
    r_in, r_out = 1 / (3 + np.sqrt(3)), np.sqrt(3) / 2  # closed forms of the corner of a cube
    assert tetrahedron_radius_ratio(corner, np.array([[0, 1, 2, 3]]))[0] == pytest.approx(3 * r_in / r_out, rel=1e-12)
    right = triangle_radius_ratio(corner, np.array([[0, 1, 2]]))[0]
    assert right == pytest.approx(2 * (1 - 1 / np.sqrt(2)) / (1 / np.sqrt(2)), rel=1e-12)


def test_surface_first_renumbers_and_keeps_the_body():
    # A node in the middle, numbered first: it must come last.
    points = np.vstack([[[0.0, 0, 0]], REGULAR])
    body = np.column_stack([np.zeros(4, int), FACES[:, ::-1] + 1])
    body = body if (tetrahedron_volumes(points, body) > 0).all() else body[:, [0, 2, 1, 3]]
    new, faces, tetrahedra, count = surface_first(points, body)
    assert count == 4 and (new[4] == 0).all() and set(faces.ravel()) == {0, 1, 2, 3}
    check_surface(new[:count], faces)
    assert (tetrahedron_volumes(new, tetrahedra) == tetrahedron_volumes(points, body)).all()
