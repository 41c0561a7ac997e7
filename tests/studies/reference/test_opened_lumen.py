"""The reference of a hollow organ whose wall is cut: filled before the cut, open after it, each right by itself."""

import math
from dataclasses import replace

import numpy as np
import pytest

from massspring import Ramp
from reference_fem import NeoHookean, PrescribedDisplacement, Problem, equilibrium_path, nodes
from reference_fem.elements.shapes import edge_index
from studies.geometry.mesh.organ_mesh import boundary_triangles, unique_edges
from studies.meshing.nested_mesh import base_mesh
from studies.meshing.opened_mesh import opened_elements
from studies.reference.load import load_reference
from studies.reference.nested import path_of, problems_of
from studies.reference.problem import problem_on
from studies.reference.reference_solves import ReferenceSolve
from studies.reference.solve import solve
from studies.scene.library import SHELL_OPENED
from studies.scene.library.ball_cuts import RADIUS, WALL
from studies.scene.scene import Held, Lumen, ReferencePlan

PLAN = ReferencePlan(base=100, at_contact=0, most=6e3, variants=("kappa",))
FULL = Lumen(filling=Ramp((0.0, 0.7), (1.0, 1.15)))
PULLED = replace(SHELL_OPENED, lumen=FULL, reference=PLAN)
"""Filled and pulled, then opened and pulled on."""


@pytest.fixture(scope="module")
def mesh(mesh_cache):
    return base_mesh(PULLED, PLAN.base, 0)


@pytest.fixture(scope="module")
def path(mesh):
    """Equilibria of the pulled shell at its checkpoints."""
    return path_of(mesh, problems_of(mesh))


def euler(tetrahedra: np.ndarray) -> int:
    triangles = boundary_triangles(tetrahedra)
    return len(np.unique(triangles)) - len(unique_edges(triangles)) + len(triangles)


def test_opening_joins_the_lumen_to_the_outside_and_keeps_the_wall(mesh, path):
    assert [euler(one.t[:4].T.astype(np.int64)) for one in (mesh.mesh, mesh.solved)] == [4, 2]
    assert path[-1].volume0 == pytest.approx(path[0].volume0, rel=1e-13)
    for one in path:
        assert one.volume == pytest.approx(one.volume0, rel=1e-4)


def test_the_traces_of_the_cut_lie_in_its_plane_on_both_surfaces(mesh):
    """Ends and middles, of the outer trace and of that in the lumen."""
    sides = mesh.body.rim(mesh.body.cut_faces)[1]
    trace = np.concatenate([np.unique(sides), mesh.mesh.nvertices + edge_index(mesh.mesh, sides)])
    x = mesh.points[trace]  # before those at the front are drawn to it
    np.testing.assert_allclose(x[:, 2], 0.0, atol=1e-12)
    depth = RADIUS - np.linalg.norm(x, axis=1)
    inner = depth > 0.5 * WALL
    np.testing.assert_allclose(depth, np.where(inner, WALL, 0.0), atol=1e-9)
    assert inner.sum() == (~inner).sum() > 8


def test_before_the_cut_it_is_the_scene_that_nobody_cuts(mesh, path):
    """On the same mesh to the last digits."""
    uncut = replace(PULLED, cuts=())
    closed = problem_on(uncut, mesh.mesh, mesh.held, mesh.lumen_at(0.0))
    alone = equilibrium_path(closed, PULLED.checkpoints[:1])[-1]
    np.testing.assert_allclose(path[0].u[: mesh.mesh.nvertices], alone.u[: mesh.mesh.nvertices], atol=1e-9 * RADIUS)
    assert path[0].cavity_pressure == pytest.approx(alone.cavity_pressure, rel=1e-9)


def test_after_the_cut_it_is_the_opened_mesh_alone(mesh, path):
    """The problem as reference_fem takes it, without a scene: an opened wall, two caps, no cavity."""
    opened, _ = opened_elements(mesh.mesh, mesh.body.cut_faces)
    tissue, (bottom, top) = PULLED.tissue, PULLED.held
    wall = NeoHookean(tissue.shear_modulus, tissue.shear_modulus * tissue.bulk_over_shear)
    caps = tuple(
        PrescribedDisplacement(where=where, motion=held.path)
        for where, held in (
            (lambda x: near(x, mesh.patches[0], opened), bottom),
            (lambda x: near(x, mesh.patches[1], opened), top),
        )
    )
    alone = equilibrium_path(Problem(opened, wall, held=caps), PULLED.checkpoints[1:])
    at = {e.t: e for e in alone}
    for one in path[1:]:
        np.testing.assert_allclose(one.u, at[one.t].u, atol=1e-9 * RADIUS)
        assert len(one.cavity_pressure) == 0


def near(x: np.ndarray, patch: np.ndarray, mesh) -> np.ndarray:
    """Which places (3, n) are nodes of a patch."""
    places = nodes(mesh)[patch]
    return (np.abs(x.T[:, None] - places[None]).max(axis=2) < 1e-9 * RADIUS).any(axis=1)


def test_it_ends_as_one_that_was_never_filled(mesh, path):
    """Nothing of the content is left."""
    drained = replace(mesh, scene=replace(PULLED, lumen=Lumen("open")))
    never = path_of(drained, problems_of(drained))
    assert abs(path[0].held_force[1, 2] / never[0].held_force[1, 2] - 1) > 0.1
    np.testing.assert_allclose(path[-1].u, never[-1].u, atol=1e-9 * RADIUS)


def sphere_pressure(filling: float, mu: float) -> float:
    """Of an incompressible neo-Hookean shell whose lumen grows to `filling` of its volume [Pa]: p = ½ mu [g] from the
    stretch inside to that outside, g = 4/λ + 1/λ⁴ (Green and Shield 1950)."""
    inside = (RADIUS - WALL) ** 3
    grown = [((r**3 + (filling - 1.0) * inside) / r**3) ** (1 / 3) for r in (RADIUS - WALL, RADIUS)]
    a, b = (4.0 / stretch + stretch**-4 for stretch in grown)
    return 0.5 * mu * (b - a)


def test_a_filled_ball_bears_the_pressure_of_the_closed_form_and_lets_go_to_its_shape_at_rest(mesh_cache):
    """Held at a small spot alone: the pressure is the sphere's, and what is cut goes back to where it was made."""
    spot = Held("bottom", replace(PULLED.held[0].region, point=(0.0, 0.0, -0.97 * RADIUS)))
    scene = replace(PULLED, held=(spot,), probed=replace(PULLED.probed, number=0))
    mesh = base_mesh(scene, 150, 0)
    before, *after = path_of(mesh, problems_of(mesh))
    p = sphere_pressure(1.15, scene.tissue.shear_modulus)
    assert float(before.cavity_pressure[0]) == pytest.approx(p, rel=0.02)
    grown = RADIUS * ((1.0 + 0.15 * (1 - WALL / RADIUS) ** 3) ** (1 / 3) - 1.0)
    farthest = np.linalg.norm(before.u, axis=1).max()
    assert farthest == pytest.approx(2 * grown, rel=0.15)  # the pole away from the spot
    for one in after:
        assert np.abs(one.u).max() < 1e-9 * RADIUS and len(one.cavity_pressure) == 0
        assert np.abs(one.held_force).max() < 1e-9


def test_its_record_has_the_pressure_until_the_cut_and_bars_without_that_of_the_lumen(tmp_path, mesh_cache):
    solve(tmp_path, ReferenceSolve(PULLED))
    made = load_reference(tmp_path, PULLED)
    assert made is not None
    filled, *opened = made.field("lumen_pressure")
    assert filled > 1.0 and opened == [0.0, 0.0]
    for one in (*made.meshes, *made.variants.values()):
        assert one.lumen_pressure == pytest.approx([filled, 0.0, 0.0], rel=0.05)
        assert np.linalg.norm(one.opening, axis=1).max() > 0.01
    bars = made.total_uncertainty
    assert "lumen" not in bars and {"force_end", "opening", "surface_mean", "volume"} <= bars.keys()
    assert all(math.isfinite(bar) for bar in bars.values()) and 0.0 < bars["opening"] < 0.3  # of two meshes
