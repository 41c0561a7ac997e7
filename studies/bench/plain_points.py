"""The opponent of quadratic bodies in `make bench`: their step as one would first write it in numba.

Springs once per pair with scatter, elements one after the other with scatter to their nodes and vertices, conjugate
gradients with the same preconditioner, symplectic Euler, planes by clamping nodes afterwards. Without contact it gives
the motion of implicit_volume to the tolerance of the multipliers.
"""

from dataclasses import replace
from time import perf_counter_ns
from typing import NamedTuple

import numba
import numpy as np

from massspring import ImplicitVolume, Setup, simulate
from massspring.body.points import BARYCENTRIC, PointVolumes
from massspring.kernels.points.arrays import PointRows
from studies.bench.line import BenchLine
from studies.bench.plain import SETTINGS, against_plain, clamp
from studies.runs.case import BodyRecipe, Case
from studies.runs.prepare import prepare
from studies.scene.library.ball_squeeze import BALL_SQUEEZE

SURFACE_NODES = (594, 794, 1194)
FRAMES, ROUNDS, MOST = 40, 5, 200
TARGET = 3.0
TOLERANCE = ImplicitVolume().tolerance


class PlainPoints(NamedTuple):
    """What the plain step is given of a body and its run, nodes in the order of the run."""

    ends: np.ndarray
    stiffness: np.ndarray
    cells: np.ndarray
    slopes: np.ndarray
    weight: np.ndarray
    corner: np.ndarray
    bulk: float
    inverse_mass: np.ndarray
    rest_volume: np.ndarray
    scale: np.ndarray
    inverse: np.ndarray
    rho: np.ndarray
    x: np.ndarray
    v: np.ndarray
    lam: np.ndarray
    cofactor: np.ndarray
    """Scratch: w_q cof F_q [m³], (k, 4, 3, 3)."""
    own: np.ndarray
    """Scratch: −b (J_q − 1) [Pa], (k, 4)."""


@numba.njit(**SETTINGS)
def add_springs(ends: np.ndarray, stiffness: np.ndarray, x: np.ndarray, force: np.ndarray):
    """f_i += k (x_j − x_i), f_j −= the same (eq. 4.9) [N]."""
    for s in range(ends.shape[0]):
        i, j = ends[s, 0], ends[s, 1]
        for axis in range(3):
            pull = stiffness[s] * (x[j, axis] - x[i, axis])
            force[i, axis] += pull
            force[j, axis] -= pull


@numba.njit(**SETTINGS)
def measure(plain: PlainPoints, volume: np.ndarray):
    """w_q cof F_q, −b (J_q − 1) and the volumes of the vertices (eq. 8.8–8.10, 8.12)."""
    x, rho = plain.x, plain.rho
    volume[:] = 0.0
    for k in range(plain.cells.shape[0]):
        for q in range(4):
            f = np.zeros((3, 3))
            for a in range(10):
                i = plain.cells[k, a]
                for row in range(3):
                    for axis in range(3):
                        f[row, axis] += x[i, row] * plain.slopes[k, q, a, axis]
            c = plain.cofactor[k, q]
            for row in range(3):
                s, t = (row + 1) % 3, (row + 2) % 3
                for axis in range(3):
                    m, n = (axis + 1) % 3, (axis + 2) % 3
                    c[row, axis] = f[s, m] * f[t, n] - f[s, n] * f[t, m]
            ratio, w = f[0, 0] * c[0, 0] + f[0, 1] * c[0, 1] + f[0, 2] * c[0, 2], plain.weight[k, q]
            plain.own[k, q] = -plain.bulk * (ratio - 1.0)
            for row in range(3):
                for axis in range(3):
                    c[row, axis] *= w
            for r in range(4):
                volume[plain.corner[k, r]] += rho[q, r] * w * ratio


@numba.njit(**SETTINGS)
def add_push(plain: PlainPoints, p: np.ndarray, with_own: bool, force: np.ndarray):
    """Jᵀ p and, `with_own`, the points' own pressures (eq. 8.11, 8.12) [N]."""
    for k in range(plain.cells.shape[0]):
        for q in range(4):
            pressure = plain.own[k, q] if with_own else 0.0
            for r in range(4):
                pressure += plain.rho[q, r] * p[plain.corner[k, r]]
            for a in range(10):
                i, g, c = plain.cells[k, a], plain.slopes[k, q, a], plain.cofactor[k, q]
                for row in range(3):
                    force[i, row] += pressure * (c[row, 0] * g[0] + c[row, 1] * g[1] + c[row, 2] * g[2])


@numba.njit(**SETTINGS)
def flow_into(plain: PlainPoints, u: np.ndarray, product: np.ndarray):
    """J u [m³/s], (m,) (eq. 8.11)."""
    product[:] = 0.0
    for k in range(plain.cells.shape[0]):
        for q in range(4):
            total, c = 0.0, plain.cofactor[k, q]
            for a in range(10):
                i, g = plain.cells[k, a], plain.slopes[k, q, a]
                for row in range(3):
                    total += u[i, row] * (c[row, 0] * g[0] + c[row, 1] * g[1] + c[row, 2] * g[2])
            for r in range(4):
                product[plain.corner[k, r]] += plain.rho[q, r] * total


@numba.njit(**SETTINGS)
def solve(plain: PlainPoints, residual: np.ndarray, allowed: np.ndarray):
    """lam += S⁻¹ residual by conjugate gradients (eq. 8.4, 8.13)."""
    lam = plain.lam
    search, image = np.zeros_like(lam), np.zeros_like(lam)
    force, before = np.zeros((plain.inverse_mass.shape[0], 3)), np.inf
    for _ in range(MOST):
        if not (np.abs(residual) > allowed).any():
            break
        z = plain.scale * np.dot(plain.inverse, (plain.scale * residual).astype(np.float32))
        product = np.dot(residual, z)
        search = z + product / before * search
        force[:] = 0.0
        add_push(plain, search, False, force)
        for i in range(force.shape[0]):
            for axis in range(3):
                force[i, axis] *= plain.inverse_mass[i]
        flow_into(plain, force, image)
        step = product / np.dot(search, image)
        lam += step * search
        residual -= step * image
        before = product


@numba.njit(**SETTINGS)
def plain_frame(plain: PlainPoints, points: np.ndarray, normals: np.ndarray, dt: float, damping: float):
    """As many steps as `points` (q, o, 3) of the planes; x, v and lam [Pa], with the rest pressure, go on."""
    x, v, lam = plain.x, plain.v, plain.lam
    force, product, volume = np.zeros_like(x), np.zeros_like(lam), np.zeros_like(lam)
    moved, w = np.zeros_like(x), plain.inverse_mass
    for q in range(points.shape[0]):
        force[:] = 0.0
        add_springs(plain.ends, plain.stiffness, x, force)
        measure(plain, volume)
        moved[:] = 0.0
        add_push(plain, lam, True, moved)
        for i in range(x.shape[0]):
            for axis in range(3):
                v[i, axis] = (1.0 - damping * dt) * v[i, axis] + dt * w[i] * force[i, axis]
                moved[i, axis] = v[i, axis] + dt * w[i] * moved[i, axis]
        flow_into(plain, moved, product)
        residual = ((plain.rest_volume - volume) / dt - product) / dt
        solve(plain, residual, TOLERANCE * plain.rest_volume / dt**2)
        force[:] = 0.0
        add_push(plain, lam, True, force)
        for i in range(x.shape[0]):
            for axis in range(3):
                v[i, axis] += dt * w[i] * force[i, axis]
                x[i, axis] += dt * v[i, axis]
        for o in range(normals.shape[0]):
            clamp(x, v, w, points[q, o], normals[o], dt)


def plain_points_run(setup: Setup) -> tuple[np.ndarray, np.ndarray]:
    """Frame times [ns], (F,), and positions at the end [m], (n, 3), of the frames of `setup` by plain steps.

    For solid quadratic bodies that nothing holds, planes, and no gravity.
    """
    body, state = setup.body, setup.start()
    volumes, rows = body.kept, state.rows
    assert isinstance(volumes, PointVolumes) and isinstance(rows, PointRows)
    plain = PlainPoints(
        body.springs.ends,
        body.springs.stiffness,
        volumes.cells,
        volumes.gradient,
        volumes.weight,
        volumes.corner_volume.astype(np.uint32),
        body.local_bulk,
        1.0 / body.moved_mass,
        body.rest_volumes,
        rows.scale,
        rows.inverse,
        BARYCENTRIC,
        body.rest.copy(),
        np.zeros_like(body.rest) if setup.velocity is None else np.array(setup.velocity, dtype=np.float64),
        body.rest_lam.copy(),
        np.zeros((*volumes.weight.shape, 3, 3)),
        np.zeros(volumes.weight.shape),
    )
    times = np.zeros(setup.clock.frames)
    for frame in range(setup.clock.frames):
        boundary = setup.boundary(frame)
        begin = perf_counter_ns()
        plain_frame(plain, boundary.position, boundary.plane_normal, boundary.dt, boundary.damping)
        times[frame] = perf_counter_ns() - begin
    return times, plain.x


def pressed_ball(nodes: int) -> Setup:
    """The squeezed ball, in the first frames of the press."""
    setup = prepare(Case(BALL_SQUEEZE, BodyRecipe("quadratic", nodes, mass="stiffness"))).setup
    return replace(setup, clock=replace(setup.clock, frames=FRAMES))


def plain_points_lines() -> list[BenchLine]:
    """How many times as long a plain step takes as one of implicit_volume, in turns on one pinned core."""
    lines = []
    for nodes in SURFACE_NODES:
        setup = pressed_ball(nodes)
        runs = {"plain": lambda s=setup: plain_points_run(s)[0], "own": lambda s=setup: simulate(s).frame_ns}
        what = f"plain quadratic step over quadratic step, {setup.body.node_count} nodes"
        lines.append(against_plain(what, setup, runs, ROUNDS, TARGET))
    return lines
