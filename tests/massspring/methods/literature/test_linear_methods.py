"""Precomputed response and linear modes against linear finite elements of scikit-fem, closed forms, and refusals."""

import numpy as np
import pytest
from scipy.sparse.linalg import spsolve
from skfem import Basis, BilinearForm, ElementTetP1, ElementTetP2, ElementVector, MeshTet
from skfem.helpers import ddot, div, sym_grad
from threadpoolctl import threadpool_limits

from massspring import (
    Attachment,
    Clock,
    ElasticResponse,
    LinearModes,
    MassSpringError,
    Plane,
    Ramp,
    Setup,
    Sphere,
    Trajectory,
    simulate,
)
from massspring.body.points import PointVolumes
from massspring.methods.literature.linear_body import linear_stiffness
from massspring.methods.literature.linear_modes import modes_of
from massspring.methods.literature.pressing import complementary
from tests.massspring.quadratic import MU, curved_solid, hollow_ball, linear_solid, straight_solid

RATIO = ElasticResponse.bulk_ratio
BODIES = {"linear": linear_solid, "quadratic": lambda: straight_solid(contact="nodes")}
PRESS = 0.0008
"""[m], a fiftieth of the height."""


@pytest.fixture(scope="module", autouse=True)
def one_thread():
    """As in the processes of a sweep: products of a few hundred rows do not gain from a second."""
    with threadpool_limits(1):
        yield


@pytest.fixture(scope="module", params=BODIES)
def solid(request):
    return BODIES[request.param]()


@BilinearForm
def hooke(u, v, w):
    return 2.0 * w.mu * ddot(sym_grad(u), sym_grad(v)) + w.lam * div(u) * div(v)


def stiffness_of_skfem(body):
    """K (3n, 3n) [N/m] in the order of the body's nodes: lambda = K + b − mu (docs/theory.md, section 14)."""
    quadratic = isinstance(body.kept, PointVolumes)
    cells = (body.kept.cells if quadratic else body.tetrahedra).astype(np.int64)
    used, corner = np.unique(cells[:, :4], return_inverse=True)
    mesh = MeshTet(body.rest[used].T.copy(), corner.reshape(-1, 4).T.copy())
    basis = Basis(mesh, ElementVector(ElementTetP2() if quadratic else ElementTetP1()), intorder=2)
    matrix = hooke.assemble(basis, mu=MU, lam=RATIO * MU + body.local_bulk - MU).tocsr()
    place = basis.doflocs[:, ::3].T
    gap = np.linalg.norm(place[:, None] - body.rest[None], axis=2)
    order = np.argsort(gap.argmin(axis=1))
    assert gap.min(axis=1).max() < 1e-12 and len(order) == body.node_count
    rows = (3 * order[:, None] + np.arange(3)).ravel()
    return matrix[rows][:, rows]


@pytest.fixture(scope="module")
def truth(solid):
    return stiffness_of_skfem(solid)


def bottom(body):
    return np.flatnonzero(body.rest[:, 2] < body.rest[:, 2].min() + 0.007)


def pressing(body, method, steps=4, duration=1.0, damping=0.0, **other):
    """Held below, pressed from above by a smooth plane."""
    high = float(body.rest[:, 2].max())
    down = Trajectory((0.0, 0.5 * duration), ((0, 0, 0), (0, 0, -0.003 - PRESS)))
    plane = Plane((0.0, 0.0, high), (0.0, 0.0, -1.0), down)
    clock = Clock(duration / steps, steps, 1)
    return Setup(body, method, clock, (plane,), (Attachment(bottom(body)),), damping=damping, **other)


def solved_with_prescribed(stiffness, body, held, touched, place):
    """(u, K u) of the direct solve with z prescribed at `touched`, x and y free there."""
    fixed = np.concatenate([(3 * held[:, None] + np.arange(3)).ravel(), 3 * touched + 2])
    u = np.zeros(3 * body.node_count)
    u[3 * touched + 2] = place - body.rest[touched, 2]
    free = np.setdiff1d(np.arange(len(u)), fixed)
    u[free] = spsolve(stiffness[free][:, free].tocsc(), -(stiffness @ u)[free])
    return u.reshape(-1, 3), (stiffness @ u).reshape(-1, 3)


def against_skfem(body, truth, method, **options):
    """(relative error of the displacement, of the force on the plane, of that on what is held), and touched nodes."""
    setup = pressing(body, method, **options)
    history = simulate(setup)
    assert history.outcome == "finished"
    place = body.rest[:, 2].max() - 0.003 - PRESS
    touched = np.flatnonzero(np.abs(history.final[:, 2] - place) < 1e-9 * body.size)
    u, force = solved_with_prescribed(truth, body, bottom(body), touched, place)
    moved = np.abs(history.final - body.rest - u).max() / np.abs(u).max()
    press, hold = force[touched, 2].sum(), force[bottom(body)].sum(axis=0)
    errors = (
        moved,
        history.contact_force[-1, 0, 2] / press - 1,
        np.abs(history.held_force[-1, 0] - hold).max() / -press,
    )
    return errors, touched


def test_the_stiffness_is_that_of_linear_finite_elements(solid, truth):
    own = linear_stiffness(solid, RATIO * MU)
    assert np.abs((own - truth).toarray()).max() < 1e-12 * np.abs(truth.data).max()


def test_the_response_is_the_direct_solve_with_the_same_prescribed_nodes(solid, truth):
    errors, touched = against_skfem(solid, truth, ElasticResponse())
    assert len(touched) > 3 and np.abs(errors).max() < 1e-9


def test_with_all_modes_the_static_solution_is_that_of_finite_elements(solid, truth):
    """Damped until it rests; a fifth of the modes are too stiff."""
    options = {"steps": 60, "duration": 12.0, "damping": 30.0}
    errors, touched = against_skfem(solid, truth, LinearModes(10_000), **options)
    assert len(touched) > 3 and np.abs(errors).max() < 1e-7
    some = 3 * (solid.node_count - len(bottom(solid))) // 5
    fewer = simulate(pressing(solid, LinearModes(some), **options)).contact_force[-1, 0, 2]
    assert fewer < 1.02 * simulate(pressing(solid, LinearModes(10_000), **options)).contact_force[-1, 0, 2] < 0.0


def test_modes_are_those_of_the_held_body(solid, truth):
    state = Setup(solid, LinearModes(12), Clock(0.1, 1, 1), attachments=(Attachment(bottom(solid)),)).start()
    modes, mass = state.memory, np.repeat(solid.moved_mass, 3)
    assert np.abs(modes.shape.T @ (mass[:, None] * modes.shape) - np.eye(12)).max() < 1e-10
    free = modes.held.free
    left = truth[free] @ modes.shape - mass[free, None] * modes.shape[free] * modes.square
    assert np.abs(left).max() < 1e-8 * np.abs(truth @ modes.shape).max()
    every = modes_of(modes.held, 10_000).square
    assert every[:12] == pytest.approx(modes.square, rel=1e-9) and len(every) == len(free)


@pytest.mark.parametrize("dt", [0.003, 0.05])
def test_a_mode_rings_as_its_equation_says_whatever_the_step(solid, dt):
    """q = e^(−c t/2) (cos w t + c/(2 w) sin w t) with w² = ω² − c²/4."""
    held, damping = Attachment(bottom(solid)), 8.0
    state = LinearModes(5).start(solid, (held,))
    shape = state.memory.shape[:, 2].reshape(-1, 3) * 1e-6
    clock = Clock(dt, 20, 1)
    setup = Setup(solid, LinearModes(5), clock, (), (held,), damping=damping, positions=solid.rest + shape)
    history = simulate(setup, snapshots=range(1, 21))
    w = np.sqrt(state.memory.square[2] - damping**2 / 4)
    t = clock.frame * np.arange(1, 21)
    expected = np.exp(-damping * t / 2) * (np.cos(w * t) + damping / (2 * w) * np.sin(w * t))
    moved = (history.snapshots - solid.rest).reshape(20, -1) @ shape.ravel() / (shape**2).sum()
    assert np.abs(moved - expected).max() < 1e-8


@pytest.mark.parametrize("method", [ElasticResponse(), LinearModes()], ids=lambda method: method.name)
def test_a_sphere_presses_without_pulling_and_lets_go(solid, method):
    top, middle = solid.rest[:, 2].max(), solid.rest[:, :2].mean(axis=0)
    way = Trajectory((0.0, 0.5, 1.0), ((0, 0, 0), (0, 0, -0.01), (0, 0, 0.01)))
    probe = Sphere((*map(float, middle), float(top) + 0.031), 0.03, way)
    setup = Setup(solid, method, Clock(0.02, 60, 1), (probe,), (Attachment(bottom(solid)),), damping=20.0)
    history = simulate(setup, range(1, 61))
    gaps = [probe.gap(x, t).min() for x, t in zip(history.snapshots, history.t, strict=True)]
    assert history.outcome == "finished" and min(gaps) > -1e-7
    assert history.contact_force[:, 0, 2].max() < 1e-9 and history.contact_force[24, 0, 2] < -0.01
    assert np.abs(history.contact_force[-1]).max() == 0.0


@pytest.mark.parametrize(("rows", "rank"), [(30, 40), (60, 20), (1, 3)])
def test_pushes_and_gaps_are_never_both(rows, rank):
    """KKT conditions, also where there are more rows than the body has ways to move."""
    random = np.random.default_rng(rows)
    for _ in range(10):
        factor = random.normal(size=(rows, rank))
        compliance = factor @ factor.T
        missing = factor @ random.normal(size=rank) - 0.1  # there is a motion that leaves all gaps open
        force = complementary(compliance, missing)
        gap = compliance @ force - missing
        scale = np.abs(missing).max()
        assert force.min() >= 0.0 and gap.min() > -1e-6 * scale
        assert np.abs(force * gap).max() < 1e-5 * scale * max(force.max(), 1e-300)


def refused(body, method, sentence, **around):
    arguments = {"attachments": (Attachment(bottom(body)),), **around}
    with pytest.raises(MassSpringError, match=sentence):
        Setup(body, method, Clock(0.01, 1, 1), **arguments).start()


@pytest.mark.parametrize("method", [ElasticResponse(), LinearModes()], ids=lambda method: method.name)
def test_what_they_cannot_do_is_refused(method):
    body = linear_solid((2, 2, 2))
    refused(body, method, "no nodes are clamped", attachments=())
    refused(body, method, "frictionless", obstacles=(Plane((0, 0, -1), (0, 0, 1), friction=0.2),))
    refused(body, method, "follow no target", targets={"node 3": Ramp((0.0, 1.0), (1.0, 1.1))})
    refused(body, method, "on a line", attachments=(Attachment(np.array([0, 1])),))
    refused(curved_solid(), method, "contact inside facets")
    refused(hollow_ball(contact="nodes"), method, "keep no volume of a lumen")
    refused(body, ElasticResponse(), "no inertia", velocity=np.ones_like(body.rest))


def test_columns_beyond_memory_are_refused(monkeypatch):
    monkeypatch.setattr("massspring.methods.literature.elastic_response.MOST_BYTES", 1e4)
    refused(linear_solid((2, 2, 2)), ElasticResponse(), "use a coarser mesh")
