"""Sums over points of blocked elements, against NumPy at positions far from rest."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.sparse import diags_array

from massspring import Attachment, Body, Clock, ImplicitVolume, Setup, Trajectory, quadratic_body, simulate
from massspring.body.membranes import triangle_springs
from massspring.body.points import PointVolumes
from massspring.kernels.forces.springs import spring_forces_into
from massspring.kernels.points.arrays import PointRows
from massspring.kernels.points.elements import forces_into, measure_into, push_into
from massspring.kernels.points.precondition import precondition_into
from massspring.kernels.points.solve import apply_schur, solve_iteratively
from massspring.layout import volume_inverse
from massspring.layout.facet_rows import facet_rows, facet_rule
from massspring.layout.volume_inverse import SHIFT
from tests.massspring.conftest import SOFT
from tests.massspring.quadratic import curved_block, hollow_ball, jiggled, local_force, quadratic_block

CLOSE, SINGLE = 1e-12, 1e-6
DT = 1e-3


@pytest.fixture(params=["small", "curved", "hollow", "mixed"])
def body(request) -> Body:
    """6 elements, fewer than a block; 54, not a multiple of it; 240 with a lumen; the same with volumes of elements."""
    if request.param in ("hollow", "mixed"):
        return hollow_ball(mixed=request.param == "mixed")
    return quadratic_body(*(quadratic_block((1, 1, 1)) if request.param == "small" else curved_block((3, 3, 1))), SOFT)


def prepared(body: Body, held=()):
    """Volumes, rows, positions and the frame with nodes `held`; what depends on positions is measured."""
    attachments = (Attachment(np.asarray(held)),) if len(held) else ()
    setup = Setup(body, ImplicitVolume(), Clock(DT, 1, 1), (), attachments)
    state = setup.start()
    x = np.ascontiguousarray(jiggled(body, 0.05))
    forces_into(state.rows, x, padded(x), state.rows.lam)
    state.rows.volume[:] = 0.0
    measure_into(state.rows, x, padded(x))
    assert isinstance(body.kept, PointVolumes) and setup.inside.permutation is None
    return body.kept, state.rows, x, state.frame(setup.boundary(0))


def padded(x):
    return np.column_stack([x, np.zeros(len(x))])


def close(value, exact, bound=CLOSE):
    assert np.abs(value - exact).max() < bound * np.abs(exact).max()


def test_volumes_and_forces_are_those_of_numpy(body):
    volumes, rows, x, _ = prepared(body)
    close(rows.volume, volumes.measure(x))
    lam = np.random.default_rng(1).standard_normal(volumes.count) * SOFT.shear_modulus
    rows.volume[:] = 0.0
    springs, stretched = body.springs, np.zeros_like(x)
    spring_forces_into(x, springs.ends, springs.rest_length, springs.stiffness, stretched)
    forces_into(rows, x, padded(x), lam)
    close(rows.volume, volumes.measure(x))
    pressed = volumes.jacobian(x).T @ lam
    close(rows.exact.force[:, :3].ravel(), stretched.ravel() + pressed + local_force(body, x))
    push_into(rows, lam)
    close(rows.quick.force[:, :3].ravel(), pressed, SINGLE)
    assert not rows.exact.force[:, 3].any() and not rows.quick.force[:, 3].any()


def test_springs_summed_as_springs_move_the_body_alike():
    """As those of a body with a wall, here of next to no stiffness."""
    body = quadratic_body(*curved_block((3, 3, 1)), SOFT)
    wall = triangle_springs(body.rest, body.triangles, 1e-3, 1e-9 * SOFT.shear_modulus)
    walled = replace(body, membrane=wall)
    assert point_rows_of(body).elastic and not point_rows_of(walled).elastic
    assert not point_rows_of(walled).rigidity.any()
    runs = [simulate(pulled(each), {2}) for each in (body, walled)]
    moved = runs[0].snapshots[0] - body.rest
    close(runs[1].snapshots[0] - body.rest, moved, 1e-6)
    close(runs[1].held_force, runs[0].held_force, 1e-6)


def test_what_is_held_takes_the_momentum_that_the_body_loses():
    """Free nodes gain the impulses of the attachments and of gravity, those of the multipliers' changes among them."""
    body = quadratic_body(*curved_block((3, 3, 1)), SOFT)
    setup = replace(pulled(body), damping=0.0, clock=Clock(0.02 / 100, 1, 1))
    before = setup.start()
    after = setup.method.advance(before, setup.boundary(0))
    free = before.model.inverse_mass > 0.0
    gained = (before.model.mass[:, None] * (after.v - before.v))[free].sum(axis=0)
    weight = setup.clock.duration * before.model.mass.sum() * np.asarray(setup.gravity)
    close(after.diagnostics.held_impulse.sum(axis=0), gained - weight, SINGLE)


def pulled(body: Body) -> Setup:
    """A heavy body held at one end and pulled at the other."""
    low, high = (np.flatnonzero(body.rest[:, 0] == end) for end in (body.rest[:, 0].min(), body.rest[:, 0].max()))
    away = Attachment(high, Trajectory((0.0, 0.1), ((0.0, 0.0, 0.0), (0.1 * body.size, 0.0, 0.0))))
    return Setup(body, ImplicitVolume(), Clock(0.02, 2, 100), (), (Attachment(low), away), (0.0, 0.0, -9.81), 1.0)


def point_rows_of(body: Body) -> PointRows:
    rows = Setup(body, ImplicitVolume(), Clock(DT, 1, 1)).start().rows
    assert isinstance(rows, PointRows)
    return rows


def test_the_schur_complement_is_that_of_numpy_with_held_nodes(body):
    held = np.arange(0, body.node_count, 5)
    volumes, rows, x, frame = prepared(body, held)
    inverse_mass = frame.model.inverse_mass
    p, product = np.random.default_rng(3).standard_normal(volumes.count), np.zeros(volumes.count)
    apply_schur(frame, rows, None, p, product)
    j = volumes.jacobian(x)
    close(product, j @ (diags_array(np.repeat(inverse_mass, 3)) @ (j.T @ p)), SINGLE)


def test_the_preconditioner_is_the_inverse_at_rest(body):
    """In single precision: six digits of the condition of S are left."""
    shifted, inverse = at_rest(body)
    residual, product = np.random.default_rng(5).standard_normal(len(shifted)), np.zeros(len(shifted))
    rho = precondition_into(inverse, residual, product)
    assert rho == pytest.approx(float(residual @ product), rel=1e-12) and rho > 0.0
    close(shifted @ product, residual, 1e-6 * np.linalg.cond(inverse.far))


def test_on_two_levels_it_is_nearly_the_inverse_and_positive_definite(monkeypatch):
    """Though between many clusters blocks are left out."""
    monkeypatch.setattr(volume_inverse, "DENSE", 0)
    shifted, inverse = at_rest(hollow_ball(mixed=True))
    clusters = len(inverse.near_start) - 1
    assert 2 * clusters < len(inverse.near_cluster) < 0.8 * clusters**2
    answers = np.zeros_like(shifted)
    for unit, answer in zip(np.eye(len(shifted)), answers, strict=True):
        precondition_into(inverse, unit, answer)
    close(answers, answers.T, 1e-6)
    scale = np.sqrt(np.diag(shifted))
    assert np.linalg.eigvalsh(scale[:, None] * answers * scale)[0] > 0.1
    size = np.sqrt(np.linalg.eigvals(answers @ shifted).real)
    assert size.max() / size.min() < 1.5


def at_rest(body: Body):
    """S at rest with its shift, some nodes held, and its preconditioner."""
    held = np.arange(0, body.node_count, 7)
    volumes, rows, _, frame = prepared(body, held)
    j = volumes.jacobian(body.rest)
    schur = (j @ diags_array(np.repeat(frame.model.inverse_mass, 3)) @ j.T).toarray()
    assert np.allclose(rows.diagonal, np.diag(schur), rtol=1e-12)
    return schur + SHIFT * np.diag(np.diag(schur)), rows.inverse


def test_conjugate_gradients_solve_for_every_volume(body):
    volumes, rows, x, frame = prepared(body)
    inverse_mass = frame.model.inverse_mass
    j = volumes.jacobian(x)
    schur = (j @ diags_array(np.repeat(inverse_mass, 3)) @ j.T).toarray()
    right = schur @ np.random.default_rng(6).standard_normal(volumes.count)
    rows.right[:], rows.lam[:] = right, 0.0
    rows.allowed[:] = 1e-7 * np.abs(right).max()
    count = solve_iteratively(frame, rows, None, 200)
    assert 0 < count < 60
    assert np.abs(schur @ rows.lam - right).max() < SINGLE * np.abs(right).max()


def test_volumes_whose_nodes_are_all_held_are_left_out(body):
    """They have nothing to push on: no pressure, no part in the iteration, and the others are solved for as before."""
    volumes = prepared(body)[0]
    assert isinstance(volumes, PointVolumes)
    around = (volumes.corner_volume == 0).any(axis=1)
    held = np.unique(volumes.cells[around])
    _, rows, _, frame = prepared(body, held)
    dead = rows.diagonal == 0.0
    assert dead[0] and np.isfinite(rows.inverse.far).all() and (rows.inverse.scale[dead] == 0.0).all()
    rows.right[:], rows.lam[:], rows.allowed[:] = 1.0, 3.0, 1e-9
    if not dead.all():
        assert solve_iteratively(frame, rows, None, 200) > 0
    assert (rows.lam[dead] == 3.0).all() and np.isfinite(rows.lam).all()


def test_the_rule_of_facets_is_exact_to_the_fourth_degree():
    """∫ over a triangle of b_1^i b_2^j b_3^k is 2 i! j! k!/(i + j + k + 2)!, per area; and N is 1 at its own node."""
    shape, weight = facet_rule()
    assert np.allclose(shape.sum(axis=1), 1.0, atol=1e-14) and weight.sum() == pytest.approx(1.0, abs=1e-14)
    assert np.allclose(weight @ shape, [0, 0, 0, 1 / 3, 1 / 3, 1 / 3], atol=1e-14)
    # ∫ N_a N_b of six-node triangles (Zienkiewicz, Taylor): degree four.
    mass = np.array(
        [
            [6, -1, -1, 0, -4, 0],
            [-1, 6, -1, 0, 0, -4],
            [-1, -1, 6, -4, 0, 0],
            [0, 0, -4, 32, 16, 16],
            [-4, 0, 0, 16, 32, 16],
            [0, -4, 0, 16, 16, 32],
        ]
    )
    assert np.allclose(shape.T @ (weight[:, None] * shape), mass / 180.0, atol=1e-14)


def test_what_resists_at_a_contact_point_is_the_mass_of_its_nodes(body):
    """A unit force at a point for a unit of time moves the point by 1/m_q (eq. 9.4); facets that are held have none."""
    inverse_mass = 1.0 / body.mass
    inverse_mass[body.contact_facets[0]] = 0.0
    rows = facet_rows(body.contact_facets, body.rest, inverse_mass)
    assert len(rows.node) == len(body.contact_facets) - (inverse_mass[body.contact_facets] == 0).all(axis=1).sum()
    count = len(facet_rule()[0])
    for f, nodes in enumerate(rows.node):
        shape = rows.shape[f, :count]
        speed = inverse_mass[nodes] * shape  # of each node under a force at each point
        assert np.allclose((speed * shape).sum(axis=1), 1.0 / rows.mass[f, :count], rtol=1e-12)
