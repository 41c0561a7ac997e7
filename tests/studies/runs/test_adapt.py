"""From a scene to the mass-spring set-up: mesh, body, attachments, clock."""

from dataclasses import replace

import numpy as np
import pytest

from massspring import MassSpringError, Trajectory
from studies.geometry import HalfSpace
from studies.meshing.scene_mesh import mesh_for, patch_nodes
from studies.runs.prepare import attachments_for, body_for, prepare
from studies.runs.recipes import BODIES, TetrahedralBody
from studies.scene.library.ball_clamped import BALL_CLAMPED
from studies.scene.scene import Held
from tests.studies.tiny import NODES, SQUEEZE, cube, file_scene, tiny_case, write_obj

CLAMPED = replace(BALL_CLAMPED, reference=None)


@pytest.fixture(scope="module")
def ball_mesh(mesh_cache):
    return mesh_for(CLAMPED, NODES)


def test_only_a_tetrahedral_body_is_filled():
    filled, hollow = (prepare(tiny_case(body=BODIES[kind](NODES))) for kind in ("tetrahedral", "surface"))
    assert len(filled.mesh.tetrahedra) == len(filled.setup.body.tetrahedra) > 0
    assert len(hollow.mesh.tetrahedra) == len(hollow.setup.body.tetrahedra) == 0
    assert abs(hollow.mesh.surface_count - NODES) <= 0.02 * NODES + 1
    # The paper's body has virtual nodes on its axis on top of the mesh.
    assert hollow.setup.body.node_count > len(hollow.mesh.points)


def test_stiffness_multiplies_every_spring(ball_mesh):
    soft, stiff = (body_for(CLAMPED, TetrahedralBody(nodes=NODES, stiffness=k), ball_mesh) for k in (1.0, 4.0))
    np.testing.assert_allclose(stiff.springs.stiffness, 4.0 * soft.springs.stiffness, rtol=1e-15)
    np.testing.assert_array_equal(stiff.mass, soft.mass)


@pytest.mark.parametrize("kind", ["tetrahedral", "surface"])
def test_the_masses_add_up_to_density_times_volume(ball_mesh, kind):
    """A body of the scene's tissue, whatever the stiffness; sums of a few hundred terms round far below 1e-12."""
    dense = replace(CLAMPED, tissue=replace(CLAMPED.tissue, density=1234.5))
    for scene in (CLAMPED, dense):
        body = body_for(scene, BODIES[kind](NODES, stiffness=3.0), ball_mesh)
        assert body.mass.sum() == pytest.approx(scene.tissue.density * ball_mesh.volume, rel=1e-12)


def test_the_laws_differ_and_match_the_tissue(ball_mesh):
    """Both have Σ k L² = 15 μ V, so that they mean the same tissue (docs: stiffness laws)."""
    volume, shear = ball_mesh.volume, CLAMPED.tissue.shear_modulus
    springs = [
        body_for(CLAMPED, TetrahedralBody(nodes=NODES, law=law), ball_mesh).springs for law in ("van_gelder", "uniform")
    ]
    for network in springs:
        assert network.stiffness @ network.rest_length**2 == pytest.approx(15 * shear * volume, rel=1e-9)
    assert not np.allclose(springs[0].stiffness, springs[1].stiffness, rtol=0.01)


def test_attachments_are_the_caps_with_their_paths(ball_mesh):
    bottom, top = attachments_for(CLAMPED, ball_mesh)
    height = ball_mesh.points[:, 2]
    cap = 0.8 * 0.05
    # The outline of a cap is an edge of the mesh: all nodes beyond it, and those on it to the mesher's tolerance.
    assert set(np.flatnonzero(height[: ball_mesh.surface_count] > cap * (1 + 1e-6))) <= set(top.nodes)
    assert (height[top.nodes] > cap * (1 - 1e-6)).all()
    assert (height[bottom.nodes] < -cap * (1 - 1e-6)).all()
    assert top.path == CLAMPED.held[1].path
    assert bottom.path == Trajectory()


def test_a_mesh_from_a_file_is_attached_where_the_region_is(tmp_path):
    points, triangles, _ = cube(2)
    outer = np.unique(triangles)
    top = HalfSpace((0.0, 0.0, 0.04), (0.0, 0.0, -1.0))
    scene = file_scene(write_obj(tmp_path / "box.obj", points[outer], np.searchsorted(outer, triangles)))
    mesh = mesh_for(replace(scene, held=(Held("top", top),)), 0, filled=True)
    assert len(mesh.tetrahedra)
    nodes = patch_nodes(mesh, "top", top)
    assert len(nodes) == 9
    assert (mesh.points[nodes, 2] == 0.05).all()


def test_dt_auto_is_the_fraction_of_the_limit_of_the_held_body():
    case = tiny_case(scene=CLAMPED, body=TetrahedralBody(nodes=100))
    half, tenth = prepare(case), prepare(case.replaced(dt_fraction=0.1))
    for prepared, fraction in ((half, 0.5), (tenth, 0.1)):
        clock = prepared.setup.clock
        most = fraction * prepared.limit.damped
        assert most * clock.steps / (clock.steps + 1) < clock.dt <= most
    fixed = prepare(case.replaced(dt=1e-3)).setup.clock
    assert fixed.dt == pytest.approx(1e-3, rel=1e-9)


def test_frames_of_the_case_come_before_those_of_the_scene():
    assert prepare(tiny_case(frames=7)).setup.clock.frames == 7
    assert prepare(tiny_case(frames=None)).setup.clock.frames == SQUEEZE.frames


def test_a_dt_above_the_limit_is_refused_unless_the_case_allows_it():
    limit = prepare(tiny_case()).limit.damped
    case = tiny_case(dt=2 * limit, frames=100)
    with pytest.raises(MassSpringError, match=f"above the stability limit of {limit:.3g} s; take a smaller dt"):
        prepare(case)
    with pytest.raises(MassSpringError, match="above the stability limit"):
        prepare(tiny_case(dt_fraction=1.5, frames=100))
    assert prepare(case.replaced(beyond_limit=True)).setup.clock.dt > limit
