"""Contact between the faces of a cut: exact derivatives, no net force or moment, and a cut that is pressed shut."""

from dataclasses import replace

import numpy as np
import pytest
from skfem import MeshTet2

from reference_fem import NeoHookean, NewtonSettings, PrescribedDisplacement, Problem, SolveError, nodes
from reference_fem.contact import faces as contact
from reference_fem.dynamics.motion_path import motion_path
from reference_fem.statics.equilibrium import equilibrium_path
from reference_fem.system import assembly
from reference_fem.system.saddle_point import System
from reference_fem.system.state import Loads
from studies.meshing.opened_mesh import opened_elements
from tests.reference_fem.bodies import block
from tests.reference_fem.system.test_saddle_point import AGREES, STEP, tangent_misfit

TISSUE = NeoHookean(1.0, 1000.0)


def middle_faces(mesh, reach: float = 2.0) -> np.ndarray:
    """Inner faces in the plane z = ½ with x up to `reach`, seen from above."""
    inner = np.asarray(mesh.f2t)[1] >= 0
    table = np.asarray(mesh.facets).T[inner].astype(np.int64)
    x = mesh.p.T[table]
    table = table[(np.abs(x[:, :, 2] - 0.5) < 1e-9).all(axis=1) & (x[:, :, 0] <= reach + 1e-9).all(axis=1)]
    a, b, c = mesh.p.T[table].transpose(1, 0, 2)
    turned = np.cross(b - a, c - a)[:, 2] < 0
    table[turned] = table[turned][:, ::-1]
    return table


def cut_block(cells=(2, 2, 2), reach: float = 2.0, bent: float = 0.0):
    """(the block before the cut, opened in the plane z = ½); `bent`: its plane is a wave."""
    mesh = MeshTet2.from_mesh(block(cells))
    faces = middle_faces(mesh, reach)
    x = mesh.doflocs.copy()
    x[2] += bent * np.sin(2 * x[0] + x[1]) * x[2] * (1.0 - x[2])
    mesh = replace(mesh, doflocs=x)
    return mesh, opened_elements(mesh, faces)[0]


def pressed(mesh, way: float, touch: bool, shear: float = 0.0, **options) -> Problem:
    held = [
        PrescribedDisplacement(lambda x: x[2] < 1e-9),
        PrescribedDisplacement(lambda x: x[2] > 1 - 1e-9, motion=lambda t: (shear * t, 0.0, -way * t)),
    ]
    return Problem(mesh, TISSUE, held, faces_touch=touch, **options)


@pytest.fixture(scope="module", params=[2.0, 0.5])
def system(request):
    """Cut through, and up to a front, whose nodes are in both faces."""
    return System(pressed(cut_block((2, 1, 2), request.param, 0.3)[1], 0.1, True), NewtonSettings(penalty=20.0))


@pytest.fixture(scope="module")
def state(system):
    """Deformed, faces apart, overlapping and slipped, with multipliers that keep all points pressed."""
    rng = np.random.default_rng(0)
    x, direction = np.zeros(system.total), rng.standard_normal(system.total)
    x[: system.displacement_count] = 0.02 * rng.standard_normal(system.displacement_count)
    x[system.displacement_count :] = rng.standard_normal(system.total - system.displacement_count)
    faces = 10.0 + rng.uniform(size=system.faces.weights.shape)
    return x, direction, Loads(0.0, system.rows, system.rest().multiplier, faces=faces)


def potential(system, x, loads):
    touch = contact.FaceTouch(loads.faces, system.faces.penalty, loads.face_guess, np.zeros_like(loads.faces))
    own = assembly.energy(x, system.elements, system.problem.material)
    eps = touch.penalty[:, None]
    t = np.maximum(0.0, touch.multiplier - eps * contact.gaps_and_slopes(x, system.faces)[0])
    return own + np.sum(system.faces.weights * (t**2 - touch.multiplier**2) / (2.0 * eps))


def test_the_residual_is_the_gradient_of_the_potential(system, state):
    x, direction, loads = state
    evaluation = system.evaluate(x, loads)
    assert (evaluation.faces.pressure > 0).all() and len(system.faces.dofs) in (2, 4)
    ends = [potential(system, x + side * STEP * direction, loads) for side in (-1, 1)]
    assert evaluation.residual @ direction == pytest.approx((ends[1] - ends[0]) / (2 * STEP), rel=AGREES)


def test_the_tangent_is_the_gradient_of_the_residual(system, state):
    x, _, loads = state
    assert tangent_misfit(system, state, system.evaluate(x, loads).values) < AGREES


def test_slopes_of_gaps_by_finite_differences(system, state):
    x, direction, _ = state
    ahead, behind = (contact.gaps_and_slopes(x + side * STEP * direction, system.faces)[0] for side in (1, -1))
    slopes = np.einsum("fqr,fr->fq", contact.gaps_and_slopes(x, system.faces)[1], direction[system.faces.dofs])
    difference = (ahead - behind) / (2 * STEP)
    np.testing.assert_allclose(difference, slopes, rtol=1e-6, atol=1e-8)
    with pytest.raises(AssertionError):
        np.testing.assert_allclose(difference, 1.00001 * slopes, rtol=1e-6, atol=1e-8)


def test_forces_and_moments_of_both_faces_cancel(system, state):
    x, _, loads = state
    with_faces, without = (
        system.evaluate(x, loads._replace(faces=f), tangent=False).residual
        for f in (loads.faces, np.full_like(loads.faces, -1e9))
    )
    force = (with_faces - without)[: system.displacement_count].reshape(-1, 3)
    place = (system.faces.rest + x[: system.displacement_count]).reshape(-1, 3)
    size = np.abs(force).sum()
    assert size > 1.0
    assert np.abs(force.sum(axis=0)).max() < 1e-14 * size
    assert np.abs(np.cross(place, force).sum(axis=0)).max() < 1e-14 * size


@pytest.mark.parametrize("reach", [2.0, 0.5])
def test_a_cut_pressed_shut_is_as_if_it_were_not(reach):
    """A wide block pressed between its ends: in its plane of symmetry nothing shears, so nothing slides."""
    whole, opened = cut_block((4, 4, 4), reach)
    times = (0.5, 1.0)
    truth = equilibrium_path(pressed(whole, 0.1, False), times)
    path = equilibrium_path(pressed(opened, 0.1, True), times)
    through = equilibrium_path(pressed(opened, 0.1, False), times[:1])
    for one, other in zip(truth, path, strict=True):
        assert other.held_force[1, 2] == pytest.approx(one.held_force[1, 2], rel=1e-2)
        assert other.penetration < 1e-3 * 0.1
        # Places that are in both: the copies come after, so compare by place.
        match = np.array([np.flatnonzero((np.abs(nodes(whole) - p) < 1e-9).all(axis=1))[0] for p in nodes(opened)])
        off = np.linalg.norm(other.u - one.u[match], axis=1).mean()
        assert off < 1e-2 * np.linalg.norm(one.u, axis=1).max()
    assert abs(through[0].held_force[1, 2]) < 0.9 * abs(truth[0].held_force[1, 2])


def test_a_cut_that_opens_is_free():
    opened = cut_block((2, 2, 2))[1]
    a, b = (equilibrium_path(pressed(opened, -0.05, touch), (1.0,))[0] for touch in (True, False))
    np.testing.assert_allclose(a.u, b.u, atol=1e-9)
    assert np.abs(a.held_force).max() < 1e-9


def test_what_cannot_touch_is_refused():
    whole, opened = cut_block((2, 2, 2))
    with pytest.raises(SolveError, match="no two facets lie on each other at rest"):
        System(pressed(whole, 0.1, True), NewtonSettings())
    with pytest.raises(SolveError, match="have slid over each other by"):
        equilibrium_path(pressed(opened, 0.05, True, shear=2.0), (1.0,))
    with pytest.raises(SolveError, match="in which the faces of a cut touch"):
        motion_path(pressed(opened, 0.1, True, density=1.0), (1.0,))


def test_nested_meshes_carry_the_pressures_over():
    from reference_fem.statics.nested import carried_between_faces

    coarse, fine = (System(pressed(cut_block(c)[1], 0.1, True), NewtonSettings()) for c in ((2, 2, 2), (4, 4, 2)))
    x = nodes(coarse.problem.mesh)[np.unique(coarse.faces.dofs[:, :6] // 3)]
    assert np.abs(x[:, 2] - 0.5).max() < 1e-9
    rest = np.einsum(
        "qa,fia->fqi",
        coarse.faces.values,
        coarse.faces.rest[coarse.faces.dofs].reshape(len(coarse.faces.dofs), 2, 3, 6)[:, 0],
    )
    carried = carried_between_faces(coarse, 1.0 + rest[..., 0], fine)
    assert carried.shape == fine.faces.weights.shape
    assert carried.mean() == pytest.approx(1.5, abs=0.02) and np.ptp(carried) > 0.8
