"""Both solvers are given the same scene: loads, obstacles, held regions."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from massspring import Capsule, Plane, Ramp, Trajectory
from reference_fem import NewtonSettings
from reference_fem.model.problem import find_held
from reference_fem.system.saddle_point import System
from studies.base.errors import StudyError
from studies.meshing import nested_mesh
from studies.meshing.kept_shape import FINER
from studies.meshing.nested_mesh import base_mesh
from studies.meshing.scene_mesh import mesh_for, patch_nodes
from studies.reference.nested import problem_of
from studies.reference.problem import kept_obstacles, reference_problem
from studies.scene.library import JUDGED, SCENES
from tests.campaigns import campaigns_but
from tests.studies.scene.test_library import SMALL, THIN, small_setup
from tests.studies.tiny import quick_to_mesh


@pytest.fixture(params=campaigns_but(JUDGED, quick_to_mesh), ids=lambda scene: scene.name)
def judged(request):
    return request.param


@cache
def _problem_by_name(name):
    scene = next(scene for scene in JUDGED if scene.name == name)
    return coarse_problem(scene)


def small_problem(scene):
    """The reference problem of a scene on a coarse mesh, once for all tests, which only read it."""
    return _problem_by_name(scene.name) if scene in JUDGED else coarse_problem(scene)


def coarse_problem(scene):
    """The reference problem of a scene on a coarse mesh: nothing here is solved on it."""
    plan = scene.reference
    if not plan.nested:
        return reference_problem(scene, plan.levels[0])
    return problem_of(base_mesh(scene, few(scene), 0))


def few(scene):
    """Surface nodes of a small mesh of its organ."""
    return THIN if scene.lumen else SMALL


def load_gap(drive_scene, problem_scene) -> float:
    """Largest distance [m] between where the two solvers put their obstacles and held regions, over the whole clock."""
    setup, problem = small_setup(drive_scene).setup, small_problem(problem_scene)
    kept = [drive_scene.obstacles.index(o) for o in kept_obstacles(drive_scene)]
    gaps = []
    for frame in range(setup.clock.frames):
        boundary, t = setup.boundary(frame), (frame + 1) * setup.clock.frame
        for number, rigid in zip(kept, problem.obstacles, strict=True):
            start = rigid.point if hasattr(rigid, "normal") else rigid.center
            gaps.append(boundary.position[-1, number] - (np.asarray(start) + rigid.motion(t)))
        if not drive_scene.symmetric:
            for number, held in enumerate(problem.held):
                gaps.append(boundary.held_displacement[-1, number] - held.motion(t))
        for cavity in problem.cavities:
            lumen = setup.body.kept.names.index("lumen")
            factor = boundary.volume_target[-1, lumen] / setup.body.rest_volumes[lumen]
            gaps.append(np.full(3, factor - cavity.volume(t)) * np.cbrt(setup.body.rest_volumes[lumen]))
    return float(np.abs(gaps).max(initial=0.0))


def moves(scene) -> bool:
    """Whether anything but gravity acts."""
    paths = [o.path for o in scene.obstacles] + [h.path for h in scene.held]
    return any(len(path.times) > 1 for path in paths) or (scene.filled and len(scene.lumen.filling.times) > 1)


def test_the_reference_problem_can_be_set_up(judged):
    problem = small_problem(judged)
    System(problem, NewtonSettings()).solver.release()
    assert problem.material.mu == judged.tissue.shear_modulus
    assert problem.material.kappa == judged.tissue.shear_modulus * judged.tissue.bulk_over_shear
    assert problem.density == judged.tissue.density
    assert tuple(problem.gravity) == judged.gravity


def test_both_solvers_see_the_same_load_at_the_same_time(judged):
    size = float(np.ptp(small_setup(judged).setup.body.rest))
    # Times and positions agree to rounding.
    assert load_gap(judged, judged) < 1e-12 * size
    assert load_gap(judged, _later(judged)) > 1e-4 * size or not moves(judged)


def _later(scene):
    """A mutant whose paths lag a tenth of a second behind."""
    late = lambda path: Trajectory(tuple(t + 0.1 for t in path.times), path.displacements)  # noqa: E731
    filling = scene.lumen.filling if scene.lumen else None
    return replace(
        scene,
        lumen=filling and replace(scene.lumen, filling=Ramp(tuple(t + 0.1 for t in filling.times), filling.values)),
        obstacles=tuple(replace(o, path=late(o.path)) for o in scene.obstacles),
        held=tuple(replace(h, path=late(h.path)) for h in scene.held),
    )


def test_both_solvers_see_the_same_obstacles(judged):
    problem = small_problem(judged)
    for obstacle, rigid in zip(kept_obstacles(judged), problem.obstacles, strict=True):
        if isinstance(obstacle, Plane):
            np.testing.assert_allclose(rigid.normal, obstacle.unit_normal, rtol=0, atol=1e-15)
        else:
            assert rigid.radius == obstacle.radius
    # An octant keeps one of two mirrored obstacles; nothing else is left out.
    dropped = [o for o in judged.obstacles if o not in kept_obstacles(judged)]
    mirrored = [np.abs(o.anchor).tolist() for o in dropped]
    assert all(any(np.allclose(m, k.anchor) for k in kept_obstacles(judged)) for m in mirrored)


def test_both_solvers_hold_the_same_region(judged, monkeypatch):
    if judged.symmetric or not judged.held:
        pytest.skip("an octant is held by its symmetry" if judged.symmetric else "it holds nothing")
    # Elements halved under a probe have more vertices than the mesh of the organ.
    monkeypatch.setattr(nested_mesh, "fine_under_tools", lambda scene, body, radii: body)
    problem = coarse_problem(judged)
    mesh, level = mesh_for(judged, few(judged), on_shape=True), few(judged)
    while (
        len(mesh.points) < problem.mesh.nvertices
    ):  # the reference is finer where this would lose an end of the region
        level = round(FINER * level)
        mesh = mesh_for(judged, level, on_shape=True)
    assert len(mesh.points) == problem.mesh.nvertices
    for held, group in zip(judged.held, find_held(problem), strict=True):
        corners = group.nodes[group.nodes < len(mesh.points)]
        patch = patch_nodes(mesh, held.name, held.region)
        # The reference may leave out a node of the outline that no whole facet of the region reaches.
        assert set(corners) <= set(patch)
        assert len(corners) >= 0.95 * len(patch)
        assert (held.region.level(mesh.points[patch]) <= 1e-3 * np.ptp(mesh.points)).all()


@pytest.mark.parametrize(
    "obstacle", [Plane((0, 0, 1), (0, 0, -1), friction=0.2), Capsule((0, 0, 1), (0, 0, 2), 0.1, friction=0.5)]
)
def test_an_obstacle_that_the_reference_does_not_know_is_refused(obstacle):
    liver = next(s for s in SCENES if s.name == "liver_press")
    with pytest.raises(StudyError, match="the reference knows contact without friction"):
        coarse_problem(replace(liver, obstacles=(obstacle,), reference=replace(liver.reference, at_contact=0)))
