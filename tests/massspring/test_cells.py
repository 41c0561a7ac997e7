"""Known pressures and volumes of tetrahedra: derivatives, force balance, limits of stiffness, locking."""

import numpy as np
import pytest

from massspring import (
    METHODS,
    Attachment,
    Barycentre,
    Clock,
    Element,
    Free,
    ImplicitVolume,
    MassSpringError,
    Path,
    Penalty,
    Pressure,
    Pyramid,
    Setup,
    Shake,
    Xpbd,
    simulate,
    tetrahedral_body,
)
from massspring.kernels.cell_multipliers import (
    cell_changes_into,
    cell_forces_into,
    cell_rows_into,
    relax_cells,
    solve_cells,
)
from massspring.kernels.cells import add_barycentre_forces, add_volume_forces, cell_slopes
from massspring.kernels.deformation import tetrahedron_volumes_into
from massspring.kernels.layout import Accuracy
from massspring.kernels.prediction import predict, unpushed_into
from massspring.kernels.volume import enclosed_volume, pyramid_volume
from massspring.methods.base import start
from massspring.methods.cells import cells_of
from massspring.volumes import Volumes
from tests.massspring.conftest import SOFT, block
from tests.massspring.test_methods import clock_for, squeeze, thrown

BULK = 30_000.0  # Pa
CELL_FORCES = {"element": add_volume_forces, "barycentre": add_barycentre_forces}


def deformed(body, amount=0.02, seed=5):
    return body.rest + amount * body.size * np.random.default_rng(seed).uniform(-1, 1, body.rest.shape)


def cell_volumes(body, x):
    out = np.empty(len(body.tetrahedra))
    tetrahedron_volumes_into(x, body.tetrahedra, out)
    return out


def cell_energy(kind, body, x):
    """Straight from the definitions, in numpy."""
    if kind == "element":
        ratio = cell_volumes(body, x) / body.tetrahedron_volumes - 1
        return 0.5 * BULK * float(body.tetrahedron_volumes @ ratio**2)

    def reach(points):
        corners = points[body.tetrahedra]
        return np.linalg.norm(corners - corners.mean(axis=1, keepdims=True), axis=2).sum(axis=1)

    weight = 9 * BULK * body.tetrahedron_volumes / reach(body.rest) ** 2
    return 0.5 * float(weight @ (reach(x) - reach(body.rest)) ** 2)


@pytest.mark.parametrize("kind", CELL_FORCES)
def test_cell_forces_are_minus_the_derivative_of_their_energy(block_body, kind):
    x, direction = deformed(block_body), np.random.default_rng(1).normal(size=block_body.rest.shape)
    force = np.zeros_like(x)
    CELL_FORCES[kind](x, cells_of(block_body), BULK, force)
    step = 1e-6 * block_body.size
    after, before = (cell_energy(kind, block_body, x + s * direction) for s in (step, -step))
    assert (force * direction).sum() == pytest.approx((before - after) / (2 * step), rel=1e-6)


def test_the_slopes_of_a_cell_are_those_of_its_volume(block_body):
    x, step = deformed(block_body), 1e-6 * block_body.size
    a, b, c, d = block_body.tetrahedra[3]
    volume, *slopes = cell_slopes(x, a, b, c, d)
    assert volume == pytest.approx(cell_volumes(block_body, x)[3], rel=1e-12)
    for number, node in enumerate((b, c, d)):
        for axis in range(3):
            move = np.zeros_like(x)
            move[node, axis] = step
            change = cell_volumes(block_body, x + move)[3] - cell_volumes(block_body, x - move)[3]
            assert slopes[3 * number + axis] == pytest.approx(change / (2 * step), rel=1e-6, abs=1e-12)


@pytest.mark.parametrize("kind", CELL_FORCES)
def test_cells_push_nothing_about(block_body, kind):
    """Σ f = 0 and no moment to round-off; the published forces of the barycentre, without the mean, would not."""
    x, force = deformed(block_body), np.zeros_like(block_body.rest)
    CELL_FORCES[kind](x, cells_of(block_body), BULK, force)
    scale = np.abs(force).sum()
    assert np.abs(force.sum(axis=0)).max() < 1e-13 * scale
    assert np.abs(np.cross(x, force).sum(axis=0)).max() < 1e-13 * scale * block_body.size
    if kind == "barycentre":
        corners = x[block_body.tetrahedra]
        spokes = corners - corners.mean(axis=1, keepdims=True)
        length = np.linalg.norm(spokes, axis=2)
        cells = cells_of(block_body)
        push = -9 * BULK * cells.rest_volume * (length.sum(axis=1) - cells.rest_reach) / cells.rest_reach**2
        published = push[:, None, None] * spokes / length[:, :, None]
        assert np.abs(published.sum(axis=(0, 1))).max() > 1e-4 * scale


def test_the_pyramids_fill_the_surface(body):
    """Wherever the centre of mass is; on one triangle less they do not."""
    mass = body.mass * np.random.default_rng(0).uniform(0.1, 3.0, body.node_count)
    x = deformed(body) + 2.0
    whole = enclosed_volume(x, body.triangles)
    assert pyramid_volume(x, mass, body.triangles) == pytest.approx(whole, rel=1e-12)
    assert pyramid_volume(x, mass, body.triangles[:-1]) != pytest.approx(whole, rel=1e-6)


def pressed(body, method, fraction=0.25, duration=2.0):
    """Squeezed by `fraction` of its height within a third of the time, then still."""
    limit = clock_for(body, 1, 1, method=method).dt
    clock = Clock(duration / 40, 40, int(np.ceil(duration / 40 / limit)))
    obstacles = squeeze(body, 0.5 * fraction * np.ptp(body.rest[:, 2]), 0.3 * duration)
    return simulate(Setup(body, method, clock, obstacles, damping=40.0))


def test_the_pyramid_is_a_penalty(ball_body):
    one, other = (pressed(ball_body, method()) for method in (Penalty, Pyramid))
    assert np.abs(one.final - other.final).max() < 1e-9 * ball_body.size
    assert np.abs(one.pressure).max() > 10.0


def test_what_a_penalty_is_short_of_goes_down_with_its_stiffness(ball_body):
    """Missing is lam/K, lam tends to the constraint's as 1/K: both halve when K doubles."""
    truth = pressed(ball_body, ImplicitVolume()).pressure[-1, 0]
    missing, gap = [], []
    for bulk in (1e5, 2e5, 4e5):
        history = pressed(ball_body, Penalty(bulk))
        missing.append(1 - history.volume[-1, 0] / ball_body.volume)
        gap.append(truth - history.pressure[-1, 0])
        assert history.pressure[-1, 0] == pytest.approx(bulk * missing[-1], rel=1e-3)  # of the step before the last
    # The pressure of a penalty is 3 % low at the softest, and its own K with it.
    assert missing[0] / missing[1] == pytest.approx(2.0, rel=0.03)
    assert missing[1] / missing[2] == pytest.approx(2.0, rel=0.015)
    assert gap[0] / gap[1] == pytest.approx(2.0, rel=0.05) and gap[0] < 0.05 * truth


def test_the_gas_obeys_its_law(ball_body):
    gas, penalty = (pressed(ball_body, method(2_000.0)) for method in (Pressure, Penalty))
    ratio = ball_body.volume / gas.volume[-1, 0]
    assert ratio > 1.01
    assert gas.pressure[-1, 0] == pytest.approx(2_000.0 * (ratio - 1), rel=1e-3)
    assert penalty.pressure[-1, 0] == pytest.approx(2_000.0 * (1 - penalty.volume[-1, 0] / ball_body.volume), rel=1e-3)


ADDING = [m() for m in METHODS if m().added_stiffness.__func__ is not Free.added_stiffness]


def rest_forces(method, body, x):
    """What the method adds to the springs at x, from one step of it out of rest."""
    still = Setup(body, method, Clock(1e-7, 1, 1))
    without = Setup(body, Free(), Clock(1e-7, 1, 1))
    speeds = []
    for setup in (still, without):
        state = setup.start()
        state.motion.x[:] = x
        speeds.append(setup.method.advance(state, setup.drive(0)).v)
    return (speeds[0] - speeds[1]) * body.mass[:, None] / 1e-7


@pytest.mark.parametrize("method", ADDING, ids=lambda method: method.name)
def test_the_stiffness_a_method_names_is_the_derivative_of_its_forces(block_body, method):
    factor = method.added_stiffness(block_body)
    direction = np.random.default_rng(1).uniform(-1, 1, block_body.rest.shape)
    step = 1e-6 * block_body.size
    after, before = (rest_forces(method, block_body, block_body.rest + s * direction) for s in (step, -step))
    exact = -(factor @ (factor.T @ direction.ravel())).reshape(-1, 3)
    assert np.abs((after - before) / (2 * step) - exact).max() < 1e-5 * np.abs(exact).max()


def test_methods_that_add_a_force_say_so():
    assert {method.name for method in ADDING} == {"penalty", "pressure", "pyramid", "barycentre", "element"}
    assert Element(hard=True).added_stiffness(None) is None


def saddle_point(body, cells, net, mo, dt, compliance):
    """Outside truth: [M/dt², −Jᵀ; J, C V0] solved densely, touched nodes as further rows."""
    n, k = body.node_count, len(body.tetrahedra)
    jacobian = np.zeros((k, n, 3))
    slopes = np.concatenate([-cells.slope.sum(axis=1, keepdims=True), cells.slope], axis=1)
    for corner in range(4):
        np.add.at(jacobian, (np.arange(k), body.tetrahedra[:, corner]), slopes[:, corner])
    touched = np.flatnonzero(mo.locked)
    normal = np.zeros((len(touched), n, 3))
    normal[np.arange(len(touched)), touched] = mo.normal[touched]
    rows = np.concatenate([dt * jacobian.reshape(k, -1), normal.reshape(len(touched), -1)])
    mass = np.repeat(body.mass, 3)
    soft = np.diag(np.concatenate([compliance * cells.rest_volume, np.zeros(len(touched))]))
    system = np.block([[np.diag(mass), -rows.T], [rows, soft]])
    approach = np.einsum("ij,ij->i", mo.goal[touched], mo.normal[touched])
    right = np.concatenate([mass * mo.v_star.ravel(), cells.rest_volume - cell_volumes(body, mo.x), approach])
    return np.linalg.solve(system, right)[: 3 * n + k]


def test_the_hard_solve_equals_the_full_saddle_point(block_body):
    body, dt, compliance = block_body, 1e-3, 1e-5
    state, cells, rng = start(block_body), cells_of(block_body), np.random.default_rng(0)
    net, mo = state.network, state.motion
    mo.x[:] = deformed(body, 0.002)
    mo.v_star[:] = 0.1 * rng.normal(size=body.rest.shape)
    touched = np.array([1, 5, 9])
    normals = rng.normal(size=(3, 3))
    mo.normal[touched] = normals / np.linalg.norm(normals, axis=1)[:, None]
    mo.direction[touched], mo.locked[touched] = mo.normal[touched], 1
    mo.goal[touched] = 0.05 * mo.normal[touched]
    cell_rows_into(mo.x, cells, cells.right)
    cells.pressure[:] = 100.0  # a warm start must not matter
    solve_cells(mo, net.inverse_mass, cells, dt, compliance, Accuracy(1e-12, 2000))
    truth = saddle_point(body, cells, net, mo, dt, compliance)[3 * body.node_count :]
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
    state.motion.x[:] = 0.99 * body.rest
    return method.advance(state, setup.drive(0))


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
    state, drive = setup.start(), setup.drive(0)
    state.motion.x[:] = 0.99 * block_body.rest
    net, mo, cells = state.network, state.motion, state.memory
    predict(net, mo, drive, 0, False)
    unpushed_into(mo, drive.dt, cells.y)
    for _ in range(method.iterations):
        cells.pressure[:] = 0.0
        relax_cells(mo, net.inverse_mass, cells, drive.dt**2, method.compliance, mo.gradient)
    short = [np.abs(1 - cell_volumes(block_body, x) / block_body.tetrahedron_volumes).max() for x in (kept.x, cells.y)]
    assert short[1] < 0.1 * short[0]


def test_xpbd_of_the_whole_is_newton_s_iteration(body):
    """Iterations square the error of the volume, down to round-off."""
    ends = [one_step(body, Xpbd("whole", iterations)).x for iterations in (1, 2, 3, 5)]
    errors = [abs(enclosed_volume(x, body.triangles) / body.volume - 1) for x in ends]
    assert errors[0] > errors[1] > errors[2]
    assert errors[1] < 5 * errors[0] ** 2 and errors[2] < 5 * errors[1] ** 2
    assert errors[3] < 1e-13


def test_xpbd_of_the_whole_is_as_compliant_as_it_is_told(ball_body):
    after = one_step(ball_body, Xpbd("whole", 30, compliance=1e-5))
    missing = 1 - enclosed_volume(after.x, ball_body.triangles) / ball_body.volume
    assert missing > 1e-4
    assert after.lam[0] == pytest.approx(missing / 1e-5, rel=1e-9)


def sheared(body, method):
    """Force it takes to move the upper face of a clamped block sideways by a tenth of its height [N]."""
    low, high = body.rest[:, 2] < 0.005, body.rest[:, 2] > 0.055
    side = Path((0.0, 0.3), ((0, 0, 0), (0.006, 0.0, 0.0)))
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


@pytest.mark.parametrize(
    "bad",
    [
        lambda: Penalty(0.0),
        lambda: Pressure(-1.0),
        lambda: Pyramid(float("nan")),
        lambda: Barycentre(float("inf")),
        lambda: Element(-5.0),
        lambda: Xpbd(iterations=0),
        lambda: Xpbd(compliance=-1.0),
        lambda: Xpbd(volumes="node"),
    ],
)
def test_settings_that_make_no_sense_are_refused(bad):
    with pytest.raises(MassSpringError, match=r"must be|needs at least one|not of 'node'"):
        bad()


def test_bodies_that_do_not_fit_are_told_why(ball_body, hollow_body):
    for method in (Barycentre(), Element(), Xpbd()):
        assert "fill its mesh" in method.applies(ball_body)
        assert "keeps 2" in method.applies(hollow_body)
    assert Xpbd("whole").applies(ball_body) is None and Shake().applies(ball_body) is None
