"""The opponent of `make bench`: a step of one kept volume as one would first write it in numba.

Springs once per spring with scatter to both ends, volume and gradient triangle by triangle, one multiplier, symplectic
Euler, planes by clamping afterwards (which leaves a volume error of up to 0.2 % where they press). Body, springs,
volume, gravity, damping and held nodes are those of implicit_volume: without contact both give the same motion to
round-off.
"""

import math
from collections.abc import Callable
from dataclasses import replace
from time import perf_counter_ns
from typing import Any, NamedTuple

import numba
import numpy as np

from massspring import ImplicitVolume, Setup, simulate
from studies.bench.line import BenchLine
from studies.bench.solver import FRAMES, LARGE, LARGE_FRAMES, LARGE_REPEATS, REPEATS, squeezed_setup
from studies.metrics.timing.protocol import interleave, pinned
from studies.metrics.timing.statistics import kernel_ns, ratio_with_spread

SETTINGS: dict[str, Any] = {"cache": True, "error_model": "numpy", "fastmath": {"contract"}}
TARGETS = {"float64": 2.0, "float32": 3.0}


class Plain(NamedTuple):
    """What the plain step is given of a body, indices uint32: signed ones would cost up to 1.9 times."""

    ends: np.ndarray
    rest_length: np.ndarray
    stiffness: np.ndarray
    triangles: np.ndarray
    inverse_mass: np.ndarray
    held: np.ndarray
    x: np.ndarray
    v: np.ndarray
    force: np.ndarray
    gradient: np.ndarray


@numba.njit(**SETTINGS)
def add_springs(ends: np.ndarray, rest_length: np.ndarray, stiffness: np.ndarray, x: np.ndarray, force: np.ndarray):
    """f_i += (k − k L/|d|) d, f_j −= the same (eq. 1.1) [N]."""
    for s in range(ends.shape[0]):
        i, j = ends[s, 0], ends[s, 1]
        d0, d1, d2 = x[j, 0] - x[i, 0], x[j, 1] - x[i, 1], x[j, 2] - x[i, 2]
        c = stiffness[s] - stiffness[s] * rest_length[s] / math.sqrt(d0 * d0 + d1 * d1 + d2 * d2)
        p0, p1, p2 = c * d0, c * d1, c * d2
        force[i, 0], force[i, 1], force[i, 2] = force[i, 0] + p0, force[i, 1] + p1, force[i, 2] + p2
        force[j, 0], force[j, 1], force[j, 2] = force[j, 0] - p0, force[j, 1] - p1, force[j, 2] - p2


@numba.njit(**SETTINGS)
def add_triangles(triangles: np.ndarray, x: np.ndarray, gradient: np.ndarray):
    """6 G (eq. 2.2) [m²], (n, 3); returns V [m³] (eq. 2.1), seen from a node of the surface."""
    o, volume = triangles[0, 0], 0.0
    o0, o1, o2 = x[o, 0], x[o, 1], x[o, 2]
    for t in range(triangles.shape[0]):
        i, j, k = triangles[t, 0], triangles[t, 1], triangles[t, 2]
        a0, a1, a2 = x[i, 0] - o0, x[i, 1] - o1, x[i, 2] - o2
        b0, b1, b2 = x[j, 0] - o0, x[j, 1] - o1, x[j, 2] - o2
        c0, c1, c2 = x[k, 0] - o0, x[k, 1] - o1, x[k, 2] - o2
        n0, n1, n2 = b1 * c2 - b2 * c1, b2 * c0 - b0 * c2, b0 * c1 - b1 * c0
        volume += a0 * n0 + a1 * n1 + a2 * n2
        gradient[i, 0] += n0
        gradient[i, 1] += n1
        gradient[i, 2] += n2
        gradient[j, 0] += c1 * a2 - c2 * a1
        gradient[j, 1] += c2 * a0 - c0 * a2
        gradient[j, 2] += c0 * a1 - c1 * a0
        gradient[k, 0] += a1 * b2 - a2 * b1
        gradient[k, 1] += a2 * b0 - a0 * b2
        gradient[k, 2] += a0 * b1 - a1 * b0
    return volume / 6.0


@numba.njit(**SETTINGS)
def clamp(x: np.ndarray, v: np.ndarray, inverse_mass: np.ndarray, point: np.ndarray, normal: np.ndarray, step: float):
    """Nodes below a plane are put on it, and their velocity is what that makes of it."""
    for i in range(x.shape[0]):
        away = normal[0] * (x[i, 0] - point[0]) + normal[1] * (x[i, 1] - point[1]) + normal[2] * (x[i, 2] - point[2])
        if away < 0.0 and inverse_mass[i] > 0.0:
            for axis in range(3):
                x[i, axis] -= away * normal[axis]
                v[i, axis] -= away / step * normal[axis]


@numba.njit(**SETTINGS)
def plain_frame(
    plain: Plain,
    targets: np.ndarray,
    points: np.ndarray,
    normals: np.ndarray,
    dt: float,
    damping: float,
    fall: np.ndarray,
):
    """As many steps as there are `targets` (q,) [m³]; planes through `points` (q, o, 3); `fall` = dt g [m/s]."""
    ends, rest_length, stiffness, triangles, inverse_mass, held, x, v, force, gradient = plain
    real = x.dtype.type
    step, keep, sixth = real(dt), real(1.0 - damping * dt), real(1.0 / 6.0)
    for q in range(targets.shape[0]):
        force[:] = real(0)
        gradient[:] = real(0)
        add_springs(ends, rest_length, stiffness, x, force)
        volume = add_triangles(triangles, x, gradient)
        for i in range(x.shape[0]):
            push = step * inverse_mass[i]
            for axis in range(3):
                v[i, axis] = keep * v[i, axis] + push * force[i, axis] + fall[axis]
        for h in range(held.shape[0]):
            v[held[h], 0], v[held[h], 1], v[held[h], 2] = real(0), real(0), real(0)
        flow, mobility = 0.0, 0.0
        for i in range(x.shape[0]):
            g0, g1, g2 = sixth * gradient[i, 0], sixth * gradient[i, 1], sixth * gradient[i, 2]
            flow += g0 * v[i, 0] + g1 * v[i, 1] + g2 * v[i, 2]
            mobility += inverse_mass[i] * (g0 * g0 + g1 * g1 + g2 * g2)
        impulse = real((targets[q] - volume - dt * flow) / (dt * mobility) / 6.0)
        for i in range(x.shape[0]):
            push = impulse * inverse_mass[i]
            for axis in range(3):
                v[i, axis] += push * gradient[i, axis]
                x[i, axis] += step * v[i, axis]
        for o in range(normals.shape[0]):
            clamp(x, v, inverse_mass, points[q, o], normals[o], step)


def plain_run(setup: Setup) -> tuple[np.ndarray, np.ndarray]:
    """Frame times [ns], (F,), and positions at the end [m], (n, 3), of the frames of `setup` by plain steps.

    For one kept volume, planes and attachments that do not move; in the precision and numbers of nodes of the run.
    """
    state = setup.start()
    net, x = state.model, state.nodes.x
    real = x.dtype.type
    body = net.ends, net.rest_length, net.stiffness, net.triangles, net.inverse_mass, net.held_nodes
    plain = Plain(*body, x, state.nodes.v, np.zeros_like(x), np.zeros_like(x))
    times = np.zeros(setup.clock.frames)
    for frame in range(setup.clock.frames):
        boundary = setup.boundary(frame)
        targets, points, normals = boundary.volume_target[:, 0].copy(), boundary.position, boundary.plane_normal
        fall = real(boundary.dt) * boundary.gravity.astype(real)
        begin = perf_counter_ns()
        plain_frame(plain, targets, points.astype(real), normals.astype(real), boundary.dt, boundary.damping, fall)
        times[frame] = perf_counter_ns() - begin
    return times, state.x


def against_plain(
    what: str, setup: Setup, runs: dict[str, Callable[[], np.ndarray]], repeats: int, target: float
) -> BenchLine:
    """How many times as long the steps of `runs` "plain" take as those of "own", in turns on one pinned core, without
    the first quarter of the frames."""
    with pinned():
        times = {name: ns[:, setup.clock.frames // 4 :] for name, ns in interleave(runs, repeats).items()}
    ratio = ratio_with_spread(times["plain"], times["own"])
    plain, own = (1e-3 * kernel_ns(times[name]) / setup.clock.steps for name in ("plain", "own"))
    note = f"{plain:.3g} over {own:.3g} µs a step; rounds {ratio.low:.3g} to {ratio.high:.3g}"
    return BenchLine(what, ratio.median, "1", target, at_most=False, note=note)


def plain_lines() -> list[BenchLine]:
    """How many times as long a plain step takes as one of implicit_volume, in turns on one pinned core."""
    lines = []
    for nodes, frames, repeats in ((550, FRAMES, REPEATS), (LARGE, LARGE_FRAMES, LARGE_REPEATS)):
        # What squeezes a large body that far takes thousands of steps: it is touched by few nodes.
        setup = squeezed_setup(ImplicitVolume(), nodes, frames)
        for precision, target in TARGETS.items():
            real = replace(setup, precision=precision)
            runs = {"plain": lambda s=real: plain_run(s)[0], "own": lambda s=real: simulate(s).frame_ns}
            what = f"plain step over fused step, {nodes} surface nodes, {precision}"
            lines.append(against_plain(what, real, runs, repeats, target))
    return lines
