"""Known pressures and volumes of tetrahedra: derivatives, force balance, limits of stiffness, locking."""

import numpy as np
import pytest

from massspring import (
    METHODS,
    Barycentre,
    Clock,
    Element,
    Free,
    ImplicitVolume,
    MassSpringError,
    Penalty,
    Pressure,
    Pyramid,
    Setup,
    Shake,
    Xpbd,
    simulate,
)
from massspring.kernels.forces.tetrahedra import tetrahedron_volumes_into
from massspring.kernels.forces.tetrahedron_volumes import (
    add_barycentre_forces,
    add_volume_forces,
    cell_slopes,
    mean_pressure,
)
from massspring.kernels.forces.volume import enclosed_volume, pyramid_volume
from massspring.methods.families.tetrahedra import cells_of
from tests.massspring.methods.test_methods import clock_for, squeeze

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
    volume, *slopes = cell_slopes(x, (a, b, c, d))
    assert volume == pytest.approx(cell_volumes(block_body, x)[3], rel=1e-12)
    for number, node in enumerate((b, c, d)):
        for axis in range(3):
            move = np.zeros_like(x)
            move[node, axis] = step
            change = cell_volumes(block_body, x + move)[3] - cell_volumes(block_body, x - move)[3]
            assert slopes[number][axis] == pytest.approx(change / (2 * step), rel=1e-6, abs=1e-12)


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


def test_a_swollen_cell_has_the_pressure_of_its_bulk_modulus(block_body):
    """All edges longer by e: springs from the barycentre resist as K does, −3 K e, in every cell whatever its shape."""
    cells, e = cells_of(block_body), 1e-3
    add_barycentre_forces((1 + e) * block_body.rest, cells, BULK, np.zeros_like(block_body.rest))
    assert np.allclose(cells.pressure, -3 * BULK * e, rtol=1e-9)


def test_large_cells_count_more_in_the_mean_pressure(block_body):
    cells = cells_of(block_body)
    cells.pressure[:] = np.random.default_rng(0).normal(size=len(cells.pressure))
    weighted = np.average(cells.pressure, weights=block_body.tetrahedron_volumes)
    assert mean_pressure(cells) == pytest.approx(weighted, rel=1e-12)
    assert abs(weighted / cells.pressure.mean() - 1) > 0.01  # the cells differ enough to tell


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


NAMING = [m() for m in METHODS if m().added_stiffness.__func__ is not Free.added_stiffness]
ADDING = [method for method in NAMING if method.capabilities.keeps != "elements"]
"""Elements have other bodies (elements/test_explicit_elements.py)."""


def rest_forces(method, body, x):
    """What the method adds to the springs at x, from one step of it out of rest."""
    still = Setup(body, method, Clock(1e-7, 1, 1))
    without = Setup(body, Free(), Clock(1e-7, 1, 1))
    speeds = []
    for setup in (still, without):
        state = setup.start()
        state.nodes.x[:] = x
        speeds.append(setup.method.advance(state, setup.boundary(0)).v)
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
    named = {"penalty", "pressure", "pyramid", "barycentre", "element", "explicit_elements"}
    assert {method.name for method in NAMING} == named
    assert Element(hard=True).added_stiffness(None) is None


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


def test_bodies_that_do_not_fit_get_a_reason(ball_body, hollow_body):
    for method in (Barycentre(), Element(), Xpbd()):
        assert "fill its mesh" in method.why_not(ball_body)
        assert "keeps 2" in method.why_not(hollow_body)
    assert Xpbd("whole").why_not(ball_body) is None and Shake().why_not(ball_body) is None
