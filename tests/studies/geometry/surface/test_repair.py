"""Repair of surfaces: every change is made, counted and reported."""

import numpy as np
import pytest

from studies.base.errors import StudyError
from studies.geometry import check_surface
from studies.geometry.mesh.organ_mesh import signed_volume
from studies.geometry.surface.repair import border, mend, oriented, part_of, without_holes
from tests.studies.geometry.boxes import box, split, together


def test_a_sound_surface_is_left_alone():
    points, faces = split(*box())
    surface = mend(points, faces, "box")
    assert (surface.points == points).all() and (surface.triangles == faces).all() and surface.remarks == ()


def test_neighbours_are_made_to_agree_and_to_look_outward():
    points, faces = split(*box(), times=2)
    mixed = faces.copy()
    turn = np.random.default_rng(0).random(len(faces)) < 0.45
    mixed[turn] = mixed[turn, ::-1]
    surface = mend(points, mixed, "box")
    assert signed_volume(surface.points, surface.triangles) == pytest.approx(1.0, rel=1e-12)
    check_surface(surface.points, surface.triangles)
    assert surface.remarks == (f"{turn.sum()} triangles are flipped to agree with their neighbours",)
    surface = mend(points, faces[:, ::-1], "box")
    assert signed_volume(surface.points, surface.triangles) == pytest.approx(1.0, rel=1e-12)
    assert surface.remarks == ("the surface was inverted and has been flipped",)


def test_moebius_bands_are_refused():
    turns = np.linspace(0, 2 * np.pi, 21)[:-1]
    across = np.stack([np.cos(turns / 2) * np.cos(turns), np.cos(turns / 2) * np.sin(turns), np.sin(turns / 2)], axis=1)
    middle = np.stack([np.cos(turns), np.sin(turns), 0 * turns], axis=1)
    points = np.vstack([middle - 0.3 * across, middle + 0.3 * across])
    first = np.arange(20)
    following = (first + 1) % 20
    # Once round, the two rims change places.
    far = np.where(first == 19, following, following + 20)
    near = np.where(first == 19, following + 20, following)
    faces = np.vstack([np.column_stack([first, near, far]), np.column_stack([first, far, first + 20])])
    with pytest.raises(StudyError, match="only one side"):
        mend(points, faces, "band")
    assert oriented(box()[1], "box")[1] == 0


def one_sided(loop):
    """A band of five triangles whose border is this loop of five nodes (n,)."""
    nodes = loop[[0, 3, 1, 4, 2]]
    return np.array([nodes[[k, (k + 1) % 5, (k + 2) % 5]] for k in range(5)])


def test_a_strip_that_hangs_on_the_surface_is_left_out():
    points, faces = split(*box(), times=2)
    strip = np.concatenate([faces[0][:2], len(points) + np.arange(3)])
    more = np.vstack([points, points[faces[0][0]] + 0.1 * np.eye(3)])
    surface = mend(more, np.vstack([faces, one_sided(strip)]), "box")
    assert (surface.points == points).all() and (surface.triangles == faces).all()
    assert len(surface.remarks) == 1 and surface.remarks[0].startswith("5 triangles of open sheets that hang on")
    wall = np.vstack([faces, [faces[0], faces[1]]])  # doubled triangles are no sheet
    assert len(mend(points, wall, "box").triangles) == len(faces)


def test_a_few_triangles_that_make_it_one_sided_are_replaced():
    points, faces = split(*box(), times=4)
    node, at = faces[0, 0], np.flatnonzero((faces == faces[0, 0]).any(axis=1))
    follows = dict(np.array([np.roll(face, -int(np.argmax(face == node)))[1:] for face in faces[at]]).tolist())
    loop = [node, next(iter(follows))]  # around three triangles
    while len(loop) < 5:
        loop.append(follows[loop[-1]])
    rest = faces[~np.isin(faces, loop).all(axis=1)]
    assert len(rest) == len(faces) - 3
    surface = mend(points, np.vstack([rest, one_sided(np.array(loop))]), "box")
    assert signed_volume(surface.points, surface.triangles) == pytest.approx(1.0, abs=1e-3)
    assert not len(border(surface.triangles))
    assert "triangles where it has one side only are replaced by lids, near (" in surface.remarks[0]


@pytest.mark.parametrize("inverted", [False, True])
def test_only_the_largest_part_stays_with_its_lumen(inverted):
    speck, lumen = box((3, 3, 3), (3.1, 3.1, 3.1)), box((0.2, 0.2, 0.2), (0.6, 0.6, 0.6))
    points, faces = together(speck, box(), (lumen[0], lumen[1][:, ::-1]))
    assert len(np.unique(part_of(faces))) == 3
    surface = mend(points, faces[:, ::-1] if inverted else faces, "box")
    assert len(surface.points) == 8 and signed_volume(surface.points, surface.triangles) == pytest.approx(1.0)
    share = 100 * 6 * 0.01 / (6 + 6 * 0.01 + 6 * 0.16)
    assert surface.remarks[0] == f"1 of 3 separate parts are left out ({share:.2g} % of the area)"
    assert surface.lumen and abs(signed_volume(*surface.lumen)) == pytest.approx(0.064)
    assert surface.volume == pytest.approx(1.0 + 0.001 - 0.064)  # as the file has it


def test_a_small_lumen_is_filled_and_said():
    small = box((0.2, 0.2, 0.2), (0.3, 0.3, 0.3))
    surface = mend(*together(box(), (small[0], small[1][:, ::-1])), "box")
    assert surface.lumen is None and surface.volume == pytest.approx(0.999)
    assert surface.remarks == ("lumens of together 1e+03 mL are filled (0.1 %)",)


def test_what_looks_inwards_beside_the_body_is_no_lumen():
    points, faces = together(box((0, 0, 0), (3, 3, 1)), box((0, 0, 1.5), (1, 1, 2)))
    faces[12:] = faces[12:, ::-1]
    surface = mend(points, faces, "box")
    assert surface.lumen is None and "1 of 2 separate parts are left out" in surface.remarks[0]


def test_a_body_in_a_body_is_named():
    surface = mend(*together(box(), box((0.2, 0.2, 0.2), (0.6, 0.6, 0.6))), "box")
    assert surface.lumen is None and surface.nested == pytest.approx(0.064)
    assert surface.volume == pytest.approx(1.064)


def test_doubled_and_collapsed_triangles_go():
    points, faces = box()
    odd = np.vstack([faces, faces[3:5], faces[7:8, [0, 2, 1]], [[1, 1, 2]]])
    surface = mend(points, odd, "box")
    assert (surface.triangles == faces).all()
    assert surface.remarks == ("4 triangles that were doubled or had no three corners are left out",)
    with pytest.raises(StudyError, match="no usable triangle"):
        mend(points, np.array([[0, 0, 1]]), "box")


def test_holes_are_closed_on_request():
    points, faces = split(*box(), times=2)
    at_corner, at_side = (faces == 0).any(axis=1), (faces == 7).any(axis=1)
    torn = faces[~at_corner & ~at_side]
    assert len(border(mend(points, torn, "box").triangles)) > 0
    surface = mend(points, torn, "box", holes=True)
    assert surface.remarks == ("2 holes are closed by flat fans",)
    check_surface(surface.points, surface.triangles)
    # Two corners are cut off: less than a cube of the edge of the missing triangles each.
    assert 1.0 - 2 * 0.25**3 < signed_volume(surface.points, surface.triangles) < 1.0
    assert without_holes(points, faces)[2] == 0
