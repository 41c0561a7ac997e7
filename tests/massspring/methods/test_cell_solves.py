"""Volumes of tetrahedra solved for: against dense systems, limits of iterations and compliance, locking."""

import numpy as np
import pytest

from massspring import (
    Attachment,
    Clock,
    Element,
    Free,
    ImplicitVolume,
    Setup,
    Trajectory,
    Xpbd,
    simulate,
    tetrahedral_body,
)
from massspring.body.volumes import Volumes
from massspring.kernels.arrays.layout import Accuracy
from massspring.kernels.constraint.tetrahedra import (
    cell_changes_into,
    cell_forces_into,
    cell_rows_into,
    relax_cells,
    solve_cells,
)
from massspring.kernels.contact.constrained_motion import unpushed_into
from massspring.kernels.contact.modes import SLIDES
from massspring.kernels.forces.volume import enclosed_volume
from massspring.kernels.step.begin import begin_step, open_frame
from massspring.layout.allocate import start
from massspring.methods.families.tetrahedra import cells_of
from tests.massspring.conftest import SOFT, block
from tests.massspring.methods.test_cells import cell_volumes, deformed, pressed
from tests.massspring.methods.test_methods import clock_for, thrown


def saddle_point(body, cells, nodes, contacts, dt, compliance):
    """Outside truth: [M/dt², −Jᵀ; J, C V0] solved densely, touched nodes as further rows."""
    n, k = body.node_count, len(body.tetrahedra)
    jacobian = np.zeros((k, n, 3))
    slopes = np.concatenate([-cells.slope.sum(axis=1, keepdims=True), cells.slope], axis=1)
    for corner in range(4):
        np.add.at(jacobian, (np.arange(k), body.tetrahedra[:, corner]), slopes[:, corner])
    touched = np.flatnonzero(contacts.mode)
    normal = np.zeros((len(touched), n, 3))
    normal[np.arange(len(touched)), touched] = contacts.normal[touched]
    rows = np.concatenate([dt * jacobian.reshape(k, -1), normal.reshape(len(touched), -1)])
    mass = np.repeat(body.mass, 3)
    soft = np.diag(np.concatenate([compliance * cells.rest_volume, np.zeros(len(touched))]))
    system = np.block([[np.diag(mass), -rows.T], [rows, soft]])
    approach = np.einsum("ij,ij->i", contacts.v_target[touched], contacts.normal[touched])
    right = np.concatenate([mass * nodes.v_star.ravel(), cells.rest_volume - cell_volumes(body, nodes.x), approach])
    return np.linalg.solve(system, right)[: 3 * n + k]


def test_the_hard_solve_equals_the_full_saddle_point(block_body):
    body, dt, compliance = block_body, 1e-3, 1e-5
    state, cells, rng = start(block_body), cells_of(block_body), np.random.default_rng(0)
    net, nodes, contacts = state.model, state.nodes, state.contacts
    nodes.x[:] = deformed(body, 0.002)
    nodes.v_star[:] = 0.1 * rng.normal(size=body.rest.shape)
    touched = np.array([1, 5, 9])
    normals = rng.normal(size=(3, 3))
    contacts.normal[touched] = normals / np.linalg.norm(normals, axis=1)[:, None]
    contacts.direction[touched], contacts.mode[touched] = contacts.normal[touched], SLIDES
    contacts.v_target[touched] = 0.05 * contacts.normal[touched]
    cell_rows_into(nodes.x, cells, cells.right)
    cells.pressure[:] = 100.0  # a warm start must not matter
    count = solve_cells(nodes, contacts, net.inverse_mass, cells, dt, compliance, Accuracy(1e-12, 2000))
    assert count < 35  # 22 in conjugate directions, 46 along the steepest ones
    truth = saddle_point(body, cells, nodes, contacts, dt, compliance)[3 * body.node_count :]
    assert np.abs(cells.pressure - truth).max() < 1e-6 * np.abs(truth).max()


def test_rows_and_their_transpose_belong_together(block_body):
    """p · (J u) = u · (Jᵀ p)."""
    rng, cells = np.random.default_rng(2), cells_of(block_body)
    cell_rows_into(deformed(block_body), cells, cells.right)
    p, u = rng.normal(size=len(cells.right)), rng.normal(size=block_body.rest.shape)
    cell_forces_into(cells, p, cells.gradient)
    cell_changes_into(cells, u, cells.image)
    assert p @ cells.image == pytest.approx((u * cells.gradient).sum(), rel=1e-12)


def one_step(body, method, dt=1e-3):
    """After a step out of a shape that is 3 % too small, with some velocity."""
    setup = Setup(body, method, Clock(dt, 1, 1), velocity=0.1 * thrown(body))
    state = setup.start()
    state.nodes.x[:] = 0.99 * body.rest
    return method.advance(state, setup.boundary(0))


def test_xpbd_tends_to_the_volume_solved_for_at_the_end_of_the_step(block_body):
    """Kept multipliers: with iterations p = (V0 − V)/(C V0) in every cell, the compliant law; and V0 as C goes to 0."""
    body = block_body
    for compliance in (1e-4, 1e-5):
        errors = []
        for iterations in (20, 100, 500):
            after = one_step(body, Xpbd(iterations=iterations, compliance=compliance))
            missing = 1 - cell_volumes(body, after.x) / body.tetrahedron_volumes
            errors.append(np.abs(missing - compliance * after.memory.pressure).max())
        assert errors[-1] < 1e-9 or errors[-1] < 0.05 * errors[0]
        assert np.abs(compliance * after.memory.pressure).max() > 1e-4
    soft, hard = (one_step(body, Xpbd(iterations=500, compliance=c)) for c in (1e-5, 1e-9))
    worst = [np.abs(cell_volumes(body, s.x) / body.tetrahedron_volumes - 1).max() for s in (soft, hard)]
    assert worst[1] < 0.02 * worst[0]


def test_xpbd_that_forgets_its_multipliers_is_hard_whatever_its_compliance(block_body):
    """The mutant of public implementations, the test of the test before: with iterations it loses the compliance."""
    method = Xpbd(iterations=200, compliance=1e-4)
    kept = one_step(block_body, method)
    setup = Setup(block_body, method, Clock(1e-3, 1, 1), velocity=0.1 * thrown(block_body))
    state, boundary = setup.start(), setup.boundary(0)
    state.nodes.x[:] = 0.99 * block_body.rest
    net, nodes, contacts, cells = state.model, state.nodes, state.contacts, state.memory
    open_frame(state.frame(boundary))
    begin_step(state.frame(boundary), 0, False)
    unpushed_into(nodes, contacts, boundary.dt, cells.y)
    for _ in range(method.iterations):
        cells.pressure[:] = 0.0
        relax_cells(contacts, net.inverse_mass, cells, boundary.dt**2, method.compliance)
    short = [np.abs(1 - cell_volumes(block_body, x) / block_body.tetrahedron_volumes).max() for x in (kept.x, cells.y)]
    assert short[1] < 0.1 * short[0]


def test_sweeps_over_cells_keep_the_whole(block_body):
    """Five leave 2 % in single cells of a pressed block and 3e-8 of their sum; 3e-4 of it where cells have no sum."""
    history = pressed(block_body, Xpbd(), duration=0.3)
    assert history.outcome == "finished" and np.abs(history.contact_force).max() > 1.0
    assert np.abs(history.volume / history.volume_target - 1).max() < 1e-6
    assert np.abs(cell_volumes(block_body, history.final) / block_body.tetrahedron_volumes - 1).max() > 1e-3


@pytest.mark.parametrize("compliance", [1e-5, 1e-3])
def test_the_sum_of_cells_asks_for_nothing_that_the_cells_do_not(block_body, compliance):
    """Every cell has its compliant volume in the end, to round-off, where a target asks for 2 % more than at rest."""
    method, target = Xpbd(iterations=200, compliance=compliance), 1.02
    setup = Setup(block_body, method, Clock(1e-3, 1, 1))
    boundary = setup.boundary(0)._replace(volume_target=np.array([[target * block_body.volume]]))
    after = method.advance(setup.start(), boundary)
    missing = target - cell_volumes(block_body, after.x) / block_body.tetrahedron_volumes
    assert np.abs(missing - compliance * after.memory.pressure).max() < 1e-11
    assert missing.min() > 1e-3


def test_xpbd_of_the_whole_is_newton_s_iteration(body):
    """Iterations square the error of the volume, down to round-off."""
    ends = [one_step(body, Xpbd("whole", iterations)).x for iterations in (1, 2, 3, 5)]
    errors = [abs(enclosed_volume(x, body.triangles) / body.volume - 1) for x in ends]
    assert errors[0] > errors[1] > errors[2]
    assert errors[1] < 5 * errors[0] ** 2 and errors[2] < 5 * errors[1] ** 2
    assert errors[3] < 1e-13


def test_xpbd_of_the_whole_has_the_compliance_of_its_setting(ball_body):
    after = one_step(ball_body, Xpbd("whole", 30, compliance=1e-5))
    missing = 1 - enclosed_volume(after.x, ball_body.triangles) / ball_body.volume
    assert missing > 1e-4
    assert after.lam[0] == pytest.approx(missing / 1e-5, rel=1e-9)


def sheared(body, method):
    """Force it takes to move the upper face of a clamped block sideways by a tenth of its height [N]."""
    low, high = body.rest[:, 2] < 0.005, body.rest[:, 2] > 0.055
    side = Trajectory((0.0, 0.3), ((0, 0, 0), (0.006, 0.0, 0.0)))
    held = (Attachment(np.flatnonzero(low)), Attachment(np.flatnonzero(high), side))
    clock = Clock(0.01, 60, int(np.ceil(0.01 / clock_for(body, 1, 1, method=method).dt)))
    history = simulate(Setup(body, method, clock, attachments=held, damping=40.0))
    assert history.outcome == "finished"
    return abs(float(history.held_force[-5:, 1, 0].mean()))


@pytest.mark.slow
def test_hard_cells_lock_and_nodal_volumes_do_not():
    """162 cells on 64 nodes: four times the force of one volume a node; softer cells lie between."""
    body = tetrahedral_body(*block((3, 3, 3), distortion=0.1), SOFT)
    free, nodal = sheared(body, Free()), sheared(body.keeping(Volumes.nodal(body)), ImplicitVolume())
    soft, hard = sheared(body, Element()), sheared(body, Element(bulk_modulus=1e7, hard=True))
    assert free < nodal < 1.3 * free
    assert 3.0 * nodal < hard < 10.0 * nodal
    assert nodal < soft < 0.5 * hard


def test_an_implicit_cell_is_as_stiff_as_a_pushing_one(block_body):
    """At rest under load the penalty and the hard solve with the same K are one equation."""
    soft, hard = (pressed(block_body, Element(hard=h), duration=1.0) for h in (False, True))
    assert np.abs(soft.final - hard.final).max() < 1e-4 * block_body.size
    assert hard.pressure[-1, 0] == pytest.approx(soft.pressure[-1, 0], rel=1e-3)
