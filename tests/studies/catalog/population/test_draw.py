"""Members of a population: who they are does not depend on how many there are, and each can be palpated."""

import json

import numpy as np
import pytest

from massspring import Plane
from reference_fem import facet_nodes, nodes
from reference_fem.system.checks import START_DEPTH, boundary_size
from studies.base.errors import StudyError
from studies.catalog.population import RANGES, Population, member, population_study
from studies.catalog.population.ranges import Filling, Palpation, Sagging
from studies.geometry import organ
from studies.geometry.shape.levelset import project
from studies.meshing.nested_mesh import base_mesh
from studies.meshing.true_shape import true_shape
from studies.scene.as_json import scene_from_dict, scene_to_json
from tests.campaigns import campaigns_but


@pytest.mark.parametrize("name", RANGES)
def test_a_larger_population_begins_with_the_smaller_one(name):
    few, more = Population(name, 2, 3).scenes(), Population(name, 4, 3).scenes()
    assert more[:2] == few
    assert len({scene.name for scene in more}) == 4
    assert member(name, 4, 0) != few[0]


@pytest.mark.parametrize("name", campaigns_but(RANGES, lambda name: name != "stomach"))
def test_what_is_drawn_lies_within_its_range_and_uses_it(name):
    ranges, scenes = RANGES[name], Population(name, 25).scenes()
    drawn = [([scene.tissue.shear_modulus for scene in scenes], ranges.shear_modulus)]
    match ranges.load:
        case Palpation(radius, depth, shift):
            drawn += [([scene.obstacles[0].radius for scene in scenes], radius), (list(map(_depth, scenes)), depth)]
            places = np.array([scene.obstacles[0].centre for scene in scenes])
            assert np.linalg.norm(places.std(axis=0)) > 0.3 * shift
        case Filling(share):
            drawn.append(([scene.lumen.filling.values[-1] for scene in scenes], share))
        case Sagging(acceleration):
            drawn.append(([-scene.gravity[2] for scene in scenes], acceleration))
    for values, (low, high) in drawn:
        assert low - 1e-9 <= min(values) and max(values) <= high + 1e-9
        assert np.ptp(values) >= 0.7 * (high - low)
    if ranges.wall is not None:
        walls = np.array([scene.organ.parameters["wall"] for scene in scenes])
        assert 1e3 * ranges.wall[0] <= walls.min() and walls.max() <= 1e3 * ranges.wall[1]


def _depth(scene):
    path = np.asarray(scene.obstacles[0].path.displacements)
    return np.linalg.norm(path[-1]) - 0.0005


@pytest.mark.parametrize("name", ["liver", "kidney"])
def test_the_probe_starts_clear_of_the_mesh_and_ends_inside_it(name):
    """Judged by the meshed organ, independently of the search for the place."""
    for scene in (member(name, 0, number) for number in (0, 1)):
        mesh = organ(name, 360, scene.regions, False, scene.organ.parameters)
        probe, points = scene.obstacles[0], mesh.points[: mesh.outer_count]
        start = np.linalg.norm(points - probe.centre, axis=1).min()
        end = np.linalg.norm(points - probe.centre - np.asarray(probe.path.displacements[-1]), axis=1).min()
        assert start >= probe.radius and end < probe.radius - 0.3 * _depth(scene)
        (held,) = mesh.patches.values()
        assert np.linalg.norm(mesh.points[held] - probe.centre, axis=1).min() > probe.radius + _depth(scene)


def test_nothing_is_clamped_where_a_probe_ends():
    """Kidney 58: at the first place that is drawn the probe would end 1 mm inside the clamped sinus, and there is no
    solution."""
    scene = member("kidney", 0, 58)
    mesh = organ("kidney", 800, scene.regions, False, scene.organ.parameters)
    (held,), probe = mesh.patches.values(), scene.obstacles[0]
    end = np.asarray(probe.centre) + probe.path.displacements[-1]
    assert np.linalg.norm(mesh.points[held] - end, axis=1).min() > probe.radius


@pytest.mark.campaign
def test_the_coarsest_mesh_of_a_reference_is_clear_of_a_probe_that_is_clear_of_the_true_shape():
    """Liver 18: the probe stands .5 mm off the true shape, and a uniform mesh of 250 surface nodes bulged into it."""
    scene = member("liver", 0, 18)
    probe, shape = scene.obstacles[0], true_shape(scene.organ)
    touched = np.asarray(probe.centre) + probe.radius * np.asarray(scene.probed.direction)
    assert np.linalg.norm(project(shape, touched[None])[0] - touched) == pytest.approx(0.5e-3, rel=0.02)
    mesh = base_mesh(scene, scene.reference.base, scene.reference.at_contact).mesh
    x = nodes(mesh)[np.unique(facet_nodes(mesh))]
    assert (np.linalg.norm(x - probe.centre, axis=1) - probe.radius).min() > -START_DEPTH * boundary_size(mesh)


@pytest.mark.campaign
def test_the_wall_behind_a_stomach_is_clear_of_it_and_near():
    scene = member("stomach", 0, 1)
    (wall,) = [obstacle for obstacle in scene.obstacles if isinstance(obstacle, Plane)]
    points = organ("stomach", 430, scene.regions, False, scene.organ.parameters).points
    assert 0.0 < wall.point[1] - points[:, 1].max() < 0.003


@pytest.mark.parametrize("name", RANGES)
def test_a_member_survives_being_stored(name):
    scene = member(name, 0, 5)
    assert scene_from_dict(json.loads(scene_to_json(scene))) == scene


@pytest.mark.parametrize("name", [name for name, ranges in RANGES.items() if isinstance(ranges.load, Palpation)])
def test_a_probe_is_pushed_along_a_unit_vector(name):
    scene = member(name, 0, 5)
    shown = [scene.obstacles[0].centre, scene.probed.direction]
    assert np.abs(np.linalg.norm(scene.probed.direction) - 1) < 1e-8
    assert all(abs(value) < 1 for row in shown for value in row)


def test_organs_take_turns_so_that_a_study_cut_short_has_them_all():
    study = population_study((Population("liver", 3), Population("kidney", 1)), "turns")
    assert [scene.name for scene in study.scenes] == ["liver_0_000", "kidney_0_000", "liver_0_001", "liver_0_002"]
    assert len(study.cases) == 4 * 7 and len({case.name for case in study.cases}) == 28
    assert {case.scene.name for case in study.cases if case.timed} == {"liver_0_000", "kidney_0_000"}


@pytest.mark.parametrize(
    ("given", "message"),
    [
        (("lever", 3), "liver"),
        (("liver", 0), "count is 0"),
        (("liver", True), "count is True"),
        (("liver", 3, -1), "seed is -1"),
        (("liver", 2.5), "count is 2.5"),
    ],
)
def test_a_population_that_is_none_is_refused(given, message):
    with pytest.raises(StudyError, match=message):
        Population(*given)


def test_a_member_without_a_place_for_the_probe_is_refused_by_name(monkeypatch):
    monkeypatch.setattr("studies.catalog.population.draw.FLAT", 1.1)
    with pytest.raises(StudyError, match="member liver_0_007: no place for a probe"):
        member("liver", 0, 7)
