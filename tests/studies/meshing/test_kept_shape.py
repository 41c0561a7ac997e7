"""A body that does not keep the shape of its organ, or the area where it is held, says so before it runs."""

import warnings
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from massspring import Sphere, Trajectory
from massspring.world.trajectories import STILL
from studies.base.errors import StudyError
from studies.geometry import HalfSpace
from studies.meshing import kept_shape
from studies.meshing.kept_shape import (
    FACETS,
    check_reach,
    held_area_error,
    held_facets,
    level_that_holds,
    tell_contact,
    tell_shape,
    touched_facets,
)
from studies.meshing.scene_mesh import mesh_for
from studies.runs.prepare import mesh_of, prepare
from studies.runs.recipes import BODIES, QuadraticBody, TetrahedralBody
from studies.scene.library import JUDGED
from studies.scene.library.ball_clamped import BALL_CLAMPED
from studies.scene.scene import Held, Lumen, Organ
from tests.studies.geometry.boxes import box
from tests.studies.tiny import SQUEEZE, tiny_case

ORGANS = [scene for scene in JUDGED if scene.held]


def warnings_of(scene, mesh, filled=True):
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always", UserWarning)
        tell_shape(scene, mesh, filled)
    return [str(one.message) for one in caught]


def test_a_warning_names_both_errors_of_flat_sides():
    with pytest.warns(UserWarning, match=r"ball: .* up to 2 % of the size .* volume -9\.\d %; .* or quadratic"):
        prepare(tiny_case())
    (sentence,) = warnings_of(SQUEEZE, mesh_for(SQUEEZE, 60, filled=False), filled=False)
    assert "volume -9." in sentence


def test_a_warning_names_a_volume_that_is_too_large():
    mesh = mesh_of(SQUEEZE, QuadraticBody(234))
    assert warnings_of(SQUEEZE, mesh) == []  # curved sides keep it
    (sentence,) = warnings_of(SQUEEZE, replace(mesh, points=1.003 * mesh.points))
    assert "volume +0.77 %" in sentence and "or quadratic" not in sentence


@pytest.mark.parametrize("kind", ["tetrahedral", "quadratic"])
def test_an_error_names_a_held_region_that_lost_a_facet(kind):
    scene = BALL_CLAMPED
    mesh = mesh_of(scene, BODIES[kind](294))
    held = scene.held[0]
    facets, off = held_facets(mesh, held), held_area_error(scene, mesh, held)
    assert abs(off) < 0.03 and not any("held region" in line for line in warnings_of(scene, mesh))
    points = np.setdiff1d(mesh.patches[held.name], facets[0])
    fewer = replace(mesh, patches=mesh.patches | {held.name: points})
    with pytest.raises(StudyError, match=rf"area of the held region '{held.name}' is -\d+ % off .*allowed: 10 %"):
        tell_shape(scene, fewer, filled=True)


@pytest.mark.parametrize(("off", "severity"), [(0.02, 0), (0.05, 1), (-0.05, 1), (-0.11, 2), (0.11, 2)])
def test_the_held_area_is_warned_of_and_then_refused(monkeypatch, off, severity):
    monkeypatch.setattr(kept_shape, "held_area_error", lambda *_: off)
    scene, mesh = BALL_CLAMPED, mesh_of(BALL_CLAMPED, QuadraticBody(294))
    if severity == 2:
        with pytest.raises(StudyError, match=r"held region 'bottom' is [-+]11 % off"):
            tell_shape(scene, mesh, filled=True)
    else:
        assert sum("held region" in line for line in warnings_of(scene, mesh)) == severity


def probed(radius: float):
    """The clamped ball with a probe that enters its side by a fifth of its size."""
    path = Trajectory((0.0, 1.0), ((0.0, 0.0, 0.0), (-0.02, 0.0, 0.0)))
    return replace(BALL_CLAMPED, obstacles=(Sphere((0.05 + radius, 0.0, 0.0), radius, path),))


def test_a_warning_names_few_facets_before_the_run(monkeypatch):
    mesh = mesh_of(BALL_CLAMPED, TetrahedralBody(nodes=294))
    thin, thick = (touched_facets(probed(radius), mesh) for radius in (0.01, 0.04))
    assert 0 < thin < FACETS < thick
    with pytest.warns(UserWarning, match=rf"about {thin:.0f} facets .* below 20 .* graded='adaptive'"):
        tell_contact(probed(0.01), mesh, adaptive=False)
    with pytest.warns(UserWarning, match=rf"about {thin:.0f} facets .* below 20 .*; use more nodes$"):
        tell_contact(probed(0.01), mesh, adaptive=True)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        tell_contact(probed(0.04), mesh, adaptive=False)
        monkeypatch.setattr(kept_shape, "FACETS", thin)
        tell_contact(probed(0.01), mesh, adaptive=False)
    assert touched_facets(BALL_CLAMPED, mesh) is None  # no probe


def test_adaptive_bodies_of_hollow_organs_may_touch_a_probe_with_fewer_facets(monkeypatch):
    """Their force may be 6 % off, for 3."""
    scene = replace(probed(0.01), lumen=Lumen("open"))
    for facets, adaptive, warns in ((19, False, True), (11, True, False), (9, True, True)):
        monkeypatch.setattr(kept_shape, "touched_facets", lambda *_, facets=facets: facets)
        with warnings.catch_warnings(record=True) as caught:
            warnings.simplefilter("always")
            tell_contact(scene, SimpleNamespace(name="bladder"), adaptive)
        assert [f"below {10 if adaptive else 20} its force" in str(one.message) for one in caught] == [True] * warns


@pytest.mark.parametrize(("radius", "refused"), [(0.001, True), (0.01, False)])
def test_a_tool_that_passes_between_all_nodes_is_refused(radius, refused):
    """Towards the middle of the facet farthest along x; not one that moves away."""
    mesh = mesh_of(BALL_CLAMPED, TetrahedralBody(nodes=294))
    middles = mesh.points[mesh.outer_triangles].mean(axis=1)
    start = middles[np.argmax(middles[:, 0])] + [radius + 0.001, 0.0, 0.0]
    path = Trajectory((0.0, 1.0), ((0.0, 0.0, 0.0), (-0.03, 0.0, 0.0)))
    scene = replace(BALL_CLAMPED, obstacles=(Sphere(tuple(start), radius, path),))
    still = replace(scene, held=tuple(replace(held, path=STILL) for held in scene.held))
    reasons = {True: "passes between the nodes", False: r"sides are \d+ times as long \(allowed: 3.5\)"}
    for at_nodes, reason in reasons.items():
        if refused:
            with pytest.raises(StudyError, match=f"obstacle 0, of radius 1 mm, .*{reason}.* use more nodes"):
                check_reach(still, mesh, at_nodes)
        else:
            check_reach(still, mesh, at_nodes)
        check_reach(scene, mesh, at_nodes)  # what is held moves: where the body will be is not known
    away = Trajectory((0.0, 1.0), ((0.0, 0.0, 0.0), (0.03, 0.0, 0.0)))
    check_reach(replace(still, obstacles=(Sphere(tuple(start), radius, away),)), mesh, True)


def test_a_file_that_comes_as_it_is_has_its_own_shape(tmp_path):
    """Its triangles do not follow the outline of a region: a warning names the staircase."""
    import meshio

    points, triangles = box((0, 0, 0), (0.1, 0.1, 0.1))
    meshio.write_points_cells(tmp_path / "box.ply", points, [("triangle", triangles)])
    organ = Organ("file", {"path": str(tmp_path / "box.ply"), "unit": "m"})
    whole = replace(SQUEEZE, organ=organ, obstacles=())
    assert warnings_of(whole, mesh_for(whole, 60)) == []
    region = HalfSpace((0.0, 0.0, 0.03), (0.0, 0.0, 1.0))
    held = replace(whole, held=(Held("foot", region),))
    (sentence,) = warnings_of(held, mesh_for(held, 60))
    assert "held region 'foot' -" in sentence and "off the true surface" not in sentence


def test_the_first_level_that_holds_enough_is_taken_and_else_the_best():
    lost = {100: 5.0, 108: 2.0, 117: 0.5, 126: 0.1}
    assert level_that_holds(100, 130, lost.__getitem__, 1.0) == 117
    assert level_that_holds(100, 110, lost.__getitem__, 1.0) == 108, "the best of 100 and 108"
    assert level_that_holds(100, 90, lost.__getitem__, 1.0) == 100, "the first is always tried"


def test_a_level_that_cannot_be_meshed_is_passed_over():
    def lost(level):
        if level < 108:
            raise StudyError(f"{level} nodes fold")
        return 0.0

    assert level_that_holds(100, 130, lost, 1.0) == 108
    with pytest.raises(StudyError, match="100 nodes fold"):
        level_that_holds(100, 105, lost, 1.0)
