"""Real organs: every surface in shared/meshes becomes a body of 550 nodes that is near to it."""

import json
import warnings

import meshio
import numpy as np
import pytest

from studies.base.errors import StudyError
from studies.geometry import check_surface, check_tetrahedra, scan
from studies.geometry.api.scans import raw_surface
from studies.geometry.mesh.organ_mesh import signed_volume
from studies.geometry.mesh.quality import dihedral_angles, tetrahedron_radius_ratio
from studies.geometry.surface.distance import distance_to_surface
from tests.studies.geometry.boxes import box, split, together
from tests.studies.geometry.real import NAMES, real_surface

MM = 1e-3
SPLEEN = "spleen_hra_550"


def hausdorff_share(mesh, points, triangles):
    """Sampled two-sided Hausdorff distance of the outer surface to another, over the diagonal of the other's box."""
    here = mesh.points[: mesh.outer_count], mesh.outer_triangles
    away = distance_to_surface(samples(*here), points, triangles).max()
    back = distance_to_surface(samples(points, triangles), *here).max()
    return max(away, back) / np.linalg.norm(np.ptp(points[np.unique(triangles)], axis=0))


def samples(points, triangles):
    """Nodes, centroids of triangles and middles of edges (m, 3)."""
    corners = points[triangles]
    middles = ((corners + np.roll(corners, 1, axis=1)) / 2.0).reshape(-1, 3)
    return np.vstack([points[np.unique(triangles)], corners.mean(axis=1), middles])


def write(path, points, triangles):
    meshio.write_points_cells(path, points, [("triangle", triangles)])
    return path


@pytest.mark.parametrize("name", [SPLEEN, *(pytest.param(n, marks=pytest.mark.campaign) for n in NAMES if n != SPLEEN)])
def test_real_organs_at_550_nodes(name):
    path = real_surface(name)
    points, triangles = raw_surface(path)
    source = points * MM, triangles
    with warnings.catch_warnings():
        warnings.simplefilter("error")  # these surfaces need no repair
        mesh = scan(path, 550, unit="mm")
    assert mesh.surface_count == 550 and len(mesh.triangles) == 1096
    surface = mesh.points[:550], mesh.triangles
    check_surface(*surface)
    check_tetrahedra(mesh.points, mesh.tetrahedra)
    # The required bounds; measured: 1.0 to 1.7 % and -1.8 to -1.5 %, most of it the polyhedron's chords.
    assert hausdorff_share(mesh, *source) < 0.03
    assert abs(mesh.volume / signed_volume(*source) - 1) < 0.04
    assert dihedral_angles(mesh.points, mesh.tetrahedra).min() > 8.0
    assert tetrahedron_radius_ratio(mesh.points, mesh.tetrahedra).min() > 0.1
    assert json.loads(json.dumps(mesh.recipe)) == mesh.recipe
    assert str(path.parent) not in json.dumps(mesh.recipe) and len(mesh.recipe["sha256"]) == 64


def test_hausdorff_distance_is_two_sided_and_sampled(balls):
    mesh = balls[150]
    points, faces = mesh.points[:150], mesh.triangles
    diagonal = np.linalg.norm(np.ptp(points, axis=0))
    assert hausdorff_share(mesh, points + np.array([0.001, 0, 0]), faces) == pytest.approx(0.001 / diagonal, rel=0.02)
    speck = box((0.2, 0, 0), (0.21, 0.01, 0.01))
    beyond = hausdorff_share(mesh, *together((points, faces), speck))
    assert beyond * np.hypot(0.26, 0.1) == pytest.approx(0.16, rel=0.1)


@pytest.fixture(scope="module")
def block(tmp_path_factory):
    """An egg of 60 x 50 x 40 mm in a file in millimetres."""
    points, faces = split(*box((-1, -1, -1), (1, 1, 1)), times=3)
    points *= (30, 25, 20) / np.linalg.norm(points, axis=1, keepdims=True)
    return write(tmp_path_factory.mktemp("block") / "block.vtu", points, faces), points, faces


def volume_of(block):
    """[m^3]."""
    return signed_volume(block[1] * MM, block[2])


def test_same_file_same_mesh(block, tmp_path, monkeypatch):
    path = block[0]
    one = scan(path, 200, unit="mm")
    monkeypatch.setenv("ORGANBENCH_CACHE", str(tmp_path / "other"))
    other = scan(path, 200, unit="mm")
    assert (one.points == other.points).all() and (one.tetrahedra == other.tetrahedra).all()
    assert one.volume == pytest.approx(volume_of(block), rel=0.04)


def test_without_nodes_the_triangles_stay(block):
    path, points, faces = block
    mesh = scan(path, unit="mm", fill=False)
    assert (mesh.points == points * MM).all() and (mesh.triangles == faces).all() and not len(mesh.tetrahedra)
    filled = scan(path, unit="mm")
    assert (filled.points[: len(points)] == points * MM).all() and len(filled.tetrahedra)
    with pytest.raises(
        StudyError, match="smoothing, a wall and a filled shell need a new surface; set its number of nodes"
    ):
        scan(path, unit="mm", smooth=0.002)


def test_warnings_name_flipped_triangles_and_parts_that_are_left_out(block, tmp_path):
    _, points, faces = block
    speck = box((90, 90, 90), (95, 95, 95))
    both = together((points, faces[:, ::-1]), speck)
    with pytest.warns(UserWarning, match="inverted") as records:
        mesh = scan(write(tmp_path / "odd.stl", *both), 200, unit="mm", fill=False)
    messages = [str(warning.message) for warning in records]
    assert any("odd.stl: 1 of 2 separate parts are left out (1" in text for text in messages)
    assert mesh.volume == pytest.approx(volume_of(block), rel=0.04)


@pytest.mark.campaign
def test_a_surface_that_crosses_itself_becomes_a_body(block, tmp_path):
    points, faces = block[1].copy(), block[2]
    top = points[:, 2].argmax()
    points[top] += (18, 0, -3)  # over its neighbours and into the body
    path = write(tmp_path / "crossing.vtu", points, faces)
    with pytest.raises(StudyError, match=r"pairs of triangles cut through each other, .* could not be filled; make a"):
        scan(path, unit="mm")
    mesh = scan(path, 200, unit="mm")
    check_tetrahedra(mesh.points, mesh.tetrahedra)
    assert mesh.volume == pytest.approx(volume_of(block), rel=0.06)


@pytest.mark.campaign
@pytest.mark.filterwarnings("ignore:.*(is missing from the mesh|has a part here that the)")
def test_handles_are_kept_and_a_warning_counts_them(tmp_path):
    round_it, round_tube = 24, 12
    i, j = (grid.ravel() for grid in np.meshgrid(np.arange(round_it), np.arange(round_tube), indexing="ij"))
    a, b = 2 * np.pi * i / round_it, 2 * np.pi * j / round_tube
    far = 25 + 9 * np.cos(b)
    points = np.column_stack([far * np.cos(a), far * np.sin(a), 9 * np.sin(b)])
    own, on, aside, both = (
        (i + di) % round_it * round_tube + (j + dj) % round_tube for di, dj in ((0, 0), (1, 0), (0, 1), (1, 1))
    )
    faces = np.vstack([np.column_stack([own, on, both]), np.column_stack([own, both, aside])])
    path = write(tmp_path / "ring.vtu", points, faces)
    with pytest.warns(UserWarning, match=r"ring\.vtu: the body has 1 handles or tunnels, .* with --smooth"):
        mesh = scan(path, 200, unit="mm", fill=False)
    check_surface(mesh.points, mesh.triangles)
    assert mesh.volume == pytest.approx(signed_volume(points * MM, faces), rel=1e-3) and mesh.losses["handles"] == 1


@pytest.mark.campaign
def test_a_thin_flap_is_kept_or_a_warning_names_it(tmp_path):
    """A plate of 3 mm on an egg: a third of it is thinner than the cells of the first grid."""
    egg = split(*box((-1, -1, -1), (1, 1, 1)), times=4)
    points = egg[0] * (30, 25, 20) / np.linalg.norm(egg[0], axis=1, keepdims=True)
    near = (np.abs(points[:, 2]) < 2.6) & (points[:, 1] > 10)
    points[near, 1] += 15 * np.clip(1 - (np.abs(points[near, 0]) / 12) ** 4, 0, 1)  # pulled out to a flap
    path = write(tmp_path / "flap.vtu", points, egg[1])
    with warnings.catch_warnings(record=True) as records:
        warnings.simplefilter("always")
        mesh = scan(path, 550, unit="mm", fill=False)
    far = mesh.losses["file_to_mesh"]
    assert far["max"] < 0.02 * mesh.losses["diagonal"] or any("up to" in str(w.message) for w in records)
    assert far["max"] < 0.5 * 15e-3, "the flap is there"
    assert mesh.volume == pytest.approx(signed_volume(points * MM, egg[1]), rel=1e-3)


def test_a_wall_makes_it_hollow(block):
    mesh = scan(block[0], 300, unit="mm", wall=0.004)
    check_tetrahedra(mesh.points, mesh.tetrahedra)
    assert mesh.hollow and mesh.outer_count == 300 and mesh.surface_count == 600
    # Offset along the normals: the body, less the one 4 mm inside; an egg has 56/60 x 42/50 x 32/40 of it roughly.
    inner = np.pi / 6 * 52e-3 * 42e-3 * 32e-3
    assert mesh.lumen_volume == pytest.approx(inner, rel=0.06)
    assert mesh.volume == pytest.approx(mesh.outer_volume - mesh.lumen_volume, rel=1e-9)
    thickness = np.linalg.norm(mesh.points[:300] - mesh.points[300:600], axis=1)
    assert thickness == pytest.approx(np.full(300, 0.004), rel=0.1)


def test_a_wall_thicker_than_the_organ_is_refused(block):
    with pytest.raises(StudyError, match="a wall of 25 mm does not fit into it; make it thinner"):
        scan(block[0], 300, unit="mm", wall=0.025)
    with pytest.raises(StudyError, match="a wall of -1 mm asked for; give a thickness above 0"):
        scan(block[0], 300, unit="mm", wall=-0.001)
    with pytest.raises(StudyError, match="smoothing over -2 mm asked for"):
        scan(block[0], 300, unit="mm", smooth=-0.002)


def test_units_are_never_guessed(block, tmp_path):
    path, points, faces = block
    with pytest.raises(StudyError) as caught:
        scan(path, 200)
    assert str(caught.value) == (
        "block.vtu does not say its unit; its longest side is 60, the size of an organ in centimetres or millimetres; "
        "say --unit mm (or another of m, cm, mm, in), or --longest-side 19cm"
    )
    with pytest.raises(StudyError, match="not a plausible organ size in m, cm or mm; say --unit mm"):
        scan(write(tmp_path / "huge.ply", 1e3 * points, faces), 200)
    assert scan(write(tmp_path / "metres.ply", MM * points, faces), fill=False).recipe["unit"] == "m"
    with pytest.raises(StudyError, match="unit 'inch' is not known"):
        scan(path, 200, unit="inch")


def test_bad_surfaces_get_a_sentence(block, tmp_path):
    _, points, faces = block
    nan = points.copy()
    nan[7] = np.nan
    cases = {
        r"the surface is open at \d+ edges; close the holes \(--close-holes\)": (points, faces[5:]),
        "1 points are not finite, the first is number 7": (nan, faces),
        "open at 3 edges": (points, faces[:1]),
    }
    for number, (sentence, mesh) in enumerate(cases.items()):
        path = write(tmp_path / f"bad{number}.vtu", *mesh)
        with pytest.raises(StudyError, match=sentence) as caught, warnings.catch_warnings():
            warnings.simplefilter("ignore")
            scan(path, 200, unit="mm")
        assert str(caught.value).startswith(path.name) and "\n" not in str(caught.value)
    with pytest.warns(UserWarning, match="1 holes are closed"):
        closed = scan(write(tmp_path / "open.vtu", points, faces[:-1]), unit="mm", holes=True, fill=False)
    assert closed.volume == pytest.approx(volume_of(block), rel=1e-3)


def test_impossible_node_counts_get_a_sentence(block):
    with pytest.raises(StudyError, match="10 surface nodes asked for, but the mesher offers 60 to"):
        scan(block[0], 10, unit="mm")
    with pytest.raises(StudyError, match="'many' surface nodes asked for"):
        scan(block[0], "many", unit="mm")
