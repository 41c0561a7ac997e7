"""Random bodies, materials, loads and settings: what the reference calls an equilibrium is one, measured in plain NumPy
from its unknowns; all else is refused or stopped with a sentence that carries the states that converged."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from scipy.spatial import Delaunay
from skfem import ElementTriP2, MeshTet, MeshTet2
from skfem.quadrature import get_quadrature
from skfem.refdom import RefTet, RefTri

from reference_fem import (
    Cavity,
    MooneyRivlin,
    NeoHookean,
    NewtonSettings,
    PrescribedDisplacement,
    Problem,
    RigidCapsule,
    RigidPlane,
    RigidSphere,
    SolveError,
    equilibrium_path,
    facet_nodes,
    nodes,
)
from reference_fem.elements.shapes import basis_table
from reference_fem.oracles.bodies import straight
from tests.reference_fem.bodies import ball_octant, shell_octant, symmetry

DENSITY, INNER = 1000.0, 0.6
ROUND_OFF = 1e-9
"""Of what is summed: far above what double precision leaves on these meshes, far below every tolerance drawn."""
log = lambda low, high: st.floats(low, high).map(lambda power: 10.0**power)  # noqa: E731


@st.composite
def meshes(draw):
    """(mesh [0.05 m], name): an eighth of a ball or shell, a box of uneven layers, or a cloud; some sides bent."""
    name, seed = draw(st.sampled_from(["octant", "shell", "box", "cloud"])), draw(st.integers(0, 10**6))
    rng, size = np.random.default_rng(seed), draw(st.integers(1, 3))
    if name == "octant":
        mesh = ball_octant(size)
    elif name == "shell":
        mesh = shell_octant(INNER, 2 + size % 2, 1 + size // 3)
        mesh = mesh if draw(st.booleans()) else straight(mesh)
    elif name == "box":
        mesh = MeshTet.init_tensor(*[np.sort([0.0, *rng.random(1 + size // 2), 1.0]) for _ in range(3)])
    else:
        points = rng.standard_normal((6 + 6 * size, 3))
        mesh = MeshTet(points.T, Delaunay(points).simplices.T.astype(np.int64))
    mesh = replace(mesh, doflocs=0.05 * mesh.doflocs)
    bend = draw(st.one_of(st.just(0.0), log(-3, -0.8)))
    if bend:
        middles = np.unique(facet_nodes(mesh)[:, 3:])
        points, ends = nodes(mesh).copy(), nodes(mesh)[mesh.edges[:, middles - mesh.nvertices]]
        length = np.linalg.norm(ends[0] - ends[1], axis=1, keepdims=True)
        points[middles] += bend * length * rng.uniform(-1.0, 1.0, (len(middles), 3))
        mesh = replace(mesh if isinstance(mesh, MeshTet2) else MeshTet2.from_mesh(mesh), doflocs=points.T)
    return mesh, name


@st.composite
def tasks(draw):
    """(problem, times, settings): held below or at planes of symmetry; an obstacle, a moved top, or a filled lumen."""
    (mesh, name), mu, bulk = draw(meshes()), 2e3 * draw(log(-3, 3)), draw(log(0, 6))
    low, high = mesh.p.min(axis=1), mesh.p.max(axis=1)
    height, depth = float(high[2] - low[2]), draw(st.floats(0.02, 0.9))
    cut = name in ("octant", "shell")
    held = symmetry() if cut else [PrescribedDisplacement(lambda x: x[2] <= low[2] + 0.4 * height)]
    down, slip = lambda t: (0.0, 0.0, -t * depth * height), draw(st.sampled_from(["frictionless", "no_slip"]))
    x, y = (0.0, 0.0) if cut else 0.5 * (low + high)[:2]
    radius, z = 0.3 * float((high - low).min()), float(high[2])
    obstacles, cavities = (
        {
            "plane": [RigidPlane((x, y, z), (0.0, 0.0, -1.0), down, slip)],
            "sphere": [RigidSphere((x, y, z + radius), radius, down, slip)],
            "capsule": [RigidCapsule((x - 0.2, y, z + radius), (x + 0.2, y, z + radius), radius, down, slip)],
        },
        [],
    )
    load = draw(st.sampled_from(["none", *obstacles, "press", "shear", *(["fill", "pump"] if name == "shell" else [])]))
    if load in ("press", "shear"):
        way, parts = ((0.0, 0.0, -1.0), (2,)) if load == "press" else ((1.0, 0.0, 0.0), (0,))
        parts = parts if cut else (0, 1, 2)
        inside = lambda x: (x[2] >= high[2] - 0.4 * height) & ((x[0] > 1e-9) | (not cut))  # noqa: E731
        held = [*held, PrescribedDisplacement(inside, parts, lambda t: t * depth * height * np.array(way))]
    if load in ("fill", "pump"):
        lumen = lambda x: (np.linalg.norm(x, axis=0) < 0.055 * INNER) & (x.min(axis=0) > 5e-5)  # noqa: E731
        filled = (
            {"volume": lambda t: 1.0 + 2.0 * depth * t} if load == "fill" else {"pressure": lambda t: mu * depth * t}
        )
        cavities = [Cavity(lumen, **filled)]
    material = draw(st.sampled_from([NeoHookean(mu, bulk * mu), MooneyRivlin(0.3 * mu, 0.2 * mu, bulk * mu)]))
    gravity = (0.0, 0.0, draw(st.sampled_from([0.0, -9.81])))
    problem = Problem(mesh, material, held, obstacles.get(load, []), gravity, DENSITY, cavities=cavities)
    steps = draw(st.sampled_from([1, 2, 4, 10]))
    newton = NewtonSettings(
        draw(log(-8, -3)),
        draw(log(-9, -5)),
        draw(log(-5, -2)),
        draw(log(2, 4.5)),
        draw(st.sampled_from([5, 10, 25])),
        draw(st.sampled_from([1.0, 1.0 / 16.0])),
        solver="scipy",
    )
    return problem, np.arange(1, steps + 1) / steps, newton


def wall(problem, u):
    """Points of the deformed surface and their outward areas, (f, nq, 3) [m], [m²]."""
    points, weights = get_quadrature(RefTri, 4)
    values, slopes = basis_table(ElementTriP2(), points)
    y = (nodes(problem.mesh) + u)[facet_nodes(problem.mesh)]
    y_r, y_s = (np.einsum("qa,fai->fqi", slopes[:, k], y) for k in range(2))
    return np.einsum("qa,fai->fqi", values, y), np.cross(y_r, y_s) * weights[:, None]


def faults(problem, newton, state):
    """What is wrong with a state of rest, by name."""
    names = ("u", "p", "obstacle_force", "held_force", "reaction", "J", "cavity_pressure", "energy")
    where, area = wall(problem, state.u)
    volume, mu = state.volume0, problem.material.mu
    weight = DENSITY * volume * np.asarray(problem.gravity)
    at_work = max(
        np.linalg.norm(state.reaction),
        np.abs(state.obstacle_force).sum(),
        np.linalg.norm(weight),
        ROUND_OFF * mu * volume ** (2 / 3),
    )
    off = np.linalg.norm(state.obstacle_force.sum(axis=0) + state.held_force.sum(axis=0) + weight)
    noise = 1e-11 * (mu + np.abs(state.p).max()) * volume ** (2 / 3) * len(state.u)
    at, _ = get_quadrature(RefTet, problem.order)
    share = np.vstack((1.0 - at.sum(axis=0), at)).T
    mean = np.sum(state.weights * (state.p[problem.mesh.t[:4].T] @ share.T)) / volume
    depth = newton.penetration_tol * np.abs(state.u).max() + ROUND_OFF * np.ptp(nodes(problem.mesh))
    found = {
        "not finite": not all(np.isfinite(getattr(state, name)).all() for name in names),
        "inverted": not state.J.min() > 0.0,
        "energy": state.energy < -ROUND_OFF * mu * volume,
        "volume": abs(np.sum(where * area) / 3.0 / state.volume - 1.0) > ROUND_OFF,
        # planes of symmetry that cut a lumen push on its open side too
        "balance": not problem.cavities and off > np.sqrt(state.u.size) * newton.force_tol * at_work + noise,
        "pressure": abs(state.volume / volume - 1.0 - mean / problem.material.kappa) > newton.volume_tol + ROUND_OFF,
        "depth": state.penetration > depth,
    }
    return [name for name, wrong in found.items() if wrong]


@pytest.mark.campaign
@settings(max_examples=200, deadline=None, suppress_health_check=list(HealthCheck))
@given(tasks())
def test_what_converges_is_an_equilibrium(task):
    problem, times, newton = task
    reached = []
    try:
        equilibrium_path(problem, times, newton, on_step=reached.append)
    except SolveError as stopped:
        kept = len(stopped.converged)
    else:
        kept = len(times)
    assert kept == len(reached)
    for state in reached[-1:]:
        assert faults(problem, newton, state) == []


def test_each_fault_is_found():
    mesh = replace(ball_octant(2), doflocs=0.05 * ball_octant(2).doflocs)
    plane = RigidPlane((0.0, 0.0, 0.05), (0.0, 0.0, -1.0), lambda t: (0.0, 0.0, -0.005 * t))
    problem, newton = Problem(mesh, NeoHookean(2e3, 2e6), symmetry(), [plane], (0, 0, -9.81), DENSITY), NewtonSettings()
    state = equilibrium_path(problem, [1.0], newton)[0]
    assert faults(problem, newton, state) == [] and np.abs(state.obstacle_force).max() > 0.0
    for name, changes in {
        "not finite": {"p": state.p * np.nan},
        "inverted": {"J": -state.J},
        "energy": {"energy": -1.0},
        "volume": {"volume": state.volume * (1.0 + 1e-7)},
        "balance": {"obstacle_force": 1.01 * state.obstacle_force},
        "pressure": {"p": 1.001 * state.p},
        "depth": {"penetration": 1e-3},
    }.items():
        assert name in faults(problem, newton, replace(state, **changes))
