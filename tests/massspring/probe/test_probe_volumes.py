"""A thin probe on a body that keeps several volumes: regions by a dense solve, one per node by an iteration."""

from dataclasses import replace

import numpy as np
import pytest

from massspring import Attachment, ImplicitVolume, Probe, Setup, Trajectory, Volumes, simulate
from massspring.kernels.probe.arrays import CARRYING, IN_CONTACT, LEFT_BEHIND
from massspring.run.checks import check_probes
from tests.massspring.methods.test_methods import clock_for

EDGE = 0.02
METHOD = ImplicitVolume()


@pytest.fixture(params=["hollow", "regions", "nodal"])
def parted_body(request):
    """Wall and lumen, seven regions, one volume per node."""
    if request.param == "hollow":
        return request.getfixturevalue("hollow_body")
    body = request.getfixturevalue("block_body")
    return body.keeping(Volumes.nodal(body) if request.param == "nodal" else Volumes.regions(body, 7))


def pressed(body, depth=0.008, frames=40, steps=20, slide=0.0, **options):
    """A probe that comes down between the nodes of the upper side, and may slide then; the lower side is held."""
    clock = clock_for(body, frames, steps)
    top = body.rest[:, 2].max()
    keys = ((0, 0, 0), (0, 0, -depth - 0.004), (slide, 0, -depth - 0.004))
    way = Trajectory((0.0, 0.4 * clock.duration, clock.duration), keys)
    probe = Probe((1.4 * EDGE, 1.6 * EDGE, top + 0.004), 0.0, way)
    held = Attachment(np.flatnonzero(body.rest[:, 2] < 0.25 * EDGE))
    return Setup(body, METHOD, clock, (probe,), (held,), damping=30.0, **options)


def in_contact(setup):
    """The state before the last frame, and the number of that frame."""
    state = setup.start()
    for frame in range(setup.clock.frames - 1):
        state = METHOD.advance(state, setup.boundary(frame))
    assert state.probing.counts[IN_CONTACT] > 20
    return state, setup.clock.frames - 1


def gradients(body, x):
    """dV/dx by central differences [m²], (m, 3n): exact to h², as a volume is a cubic."""
    step, columns = 1e-3 * EDGE, []
    for k in range(x.size):
        moved = [x.copy(), x.copy()]
        for y, sign in zip(moved, (1, -1), strict=True):
            y.reshape(-1)[k] += sign * step
        columns.append((body.kept.measure(moved[0]) - body.kept.measure(moved[1])) / (2 * step))
    return np.stack(columns, axis=1)


def test_contact_and_volumes_equal_the_saddle_point(parted_body):
    """Outside truth: what the probe adds to one step is W (Cᵀ c + dt Jᵀ δ) with J·(v⁺ − u) = 0, J by differences."""
    setup = pressed(parted_body, frames=400, steps=1)
    before, frame = in_contact(setup)
    boundary = setup.boundary(frame)
    touched = METHOD.advance(before, boundary)
    alone = METHOD.advance(replace(before, probing=None), boundary)
    rows = touched.probing.rows
    impulse = rows.impulse[: rows.count[0]]
    assert (impulse >= 0).all() and impulse.max() > 0
    difference = (touched.v - alone.v).ravel()
    jacobian = gradients(parted_body, before.x)
    scale = np.abs(jacobian) @ np.abs(difference)
    assert np.abs(jacobian @ difference).max() < 1e-5 * scale.max()  # an iteration leaves 1e-7 of the largest flow
    c = np.zeros((len(impulse), *touched.x.shape))
    for k in range(len(impulse)):
        for q in range(3):
            c[k, rows.node[k, q]] += rows.weight[k, q] * rows.direction[k]
    free = np.repeat(touched.model.inverse_mass > 0, 3)
    force = (np.repeat(touched.model.mass, 3) * difference - np.einsum("k,kij->ij", impulse, c).ravel())[free]
    pressures = np.linalg.lstsq(jacobian.T[free], force, rcond=None)[0]
    left = force - jacobian.T[free] @ pressures
    assert np.abs(left).max() < 1e-6 * impulse.max()
    assert np.abs(pressures).max() > 0
    # What presses touches: the surface ends the step at the radius, within the linear solve.
    tip = setup.probes[0].anchor + setup.probes[0].path((frame + 1) * setup.clock.frame)
    gap = np.einsum("kij,ij->k", c, touched.x) - rows.direction[: len(impulse)] @ tip
    pressing = impulse > 0
    assert np.abs(gap[pressing] - touched.probing.radius[0]).max() < 1e-6 * EDGE


def test_volumes_are_kept_and_forces_balance(parted_body):
    history = simulate(pressed(parted_body, frames=120, slide=0.2 * EDGE))
    assert history.outcome == "finished" and history.probe_counts[:, LEFT_BEHIND].sum() == 0
    assert np.abs(history.volume / parted_body.kept.measure(parted_body.rest) - 1).max() < 1e-4
    contact, reaction = history.contact_force[-1, 0], history.held_force[-1, 0]
    assert contact[2] < 0
    assert np.abs(contact + reaction).max() < 0.05 * np.abs(contact).max()  # it has slid until now


def test_sleeping_pairs_change_no_bit(parted_body):
    setup = pressed(parted_body, frames=10, slide=0.2 * EDGE)
    ends = []
    for skipping in (True, False):
        state = setup.start()
        state = replace(state, probing=state.probing._replace(skipping=skipping))
        for frame in range(setup.clock.frames):
            state = METHOD.advance(state, setup.boundary(frame))
        ends.append((state.x, state.v, state.lam))
    assert all(np.array_equal(a, b) for a, b in zip(*ends, strict=True))


def test_what_is_carried_takes_no_volume(parted_body):
    """Down by two edges within a step: contacts give up or not, nothing passes, and the volumes come back."""
    clock = clock_for(parted_body, 300, 1)
    top = parted_body.rest[:, 2].max()
    path = Trajectory((3.3 * clock.dt, 4.1 * clock.dt), ((0, 0, 0), (0.1 * EDGE, 0, -1.2 * EDGE)))
    probe = Probe((1.4 * EDGE, 1.6 * EDGE, top + 0.01 * EDGE), 0.0, path)
    setup = Setup(parted_body, METHOD, clock, (probe,), damping=30.0)
    state = setup.start()
    for frame in range(clock.frames):
        state = METHOD.advance(state, setup.boundary(frame))
        assert check_probes(state, setup.obstacles) is None
    assert state.probing.counts[LEFT_BEHIND] == 0 and state.probing.counts[IN_CONTACT] + state.probing.counts[CARRYING]
    rest = parted_body.kept.measure(parted_body.rest)
    assert np.abs(parted_body.kept.measure(state.x) / rest - 1).max() < 1e-2
