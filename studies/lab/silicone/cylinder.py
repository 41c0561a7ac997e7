"""The scene `cylinder_press`: a cylinder between two plates that stick, slide or have friction, for both solvers.

The force of a neo-Hookean cylinder is mu · A · f(compression), so that one curve f for each shape and kind of plate
serves every material. Curves are given over the closed form of plates that slide, f = λ⁻² − λ, λ = 1 − compression.
"""

import itertools
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np
import pandas as pd
from scipy.interpolate import CubicSpline
from skfem import Basis, ElementTetP2, ElementVector, MeshTet

from massspring import (
    Attachment,
    ImplicitVolume,
    Material,
    Plane,
    Setup,
    Trajectory,
    make_clock,
    quadratic_body,
    simulate,
    step_limit,
)
from reference_fem import NeoHookean, PrescribedDisplacement, Problem, RigidPlane, curve, equilibrium_path
from studies import StudyError
from studies.lab.silicone.beam import EDGES, second_order, upright

RADIUS, HEIGHT = 0.025, 0.03
"""Of the measured cylinders [m]."""
MODULUS, DENSITY = 1800.0, 1000.0
"""mu [Pa] and [kg/m³] of the bodies; f does not depend on them."""
BULK = 2000.0
"""kappa/mu of the reference: its force is .1 % lower than that of an incompressible cylinder at 40 %, .15 % at 50 %."""
END, MOMENTS = 0.54, 27
"""Largest compression, .5 and the offset of a contact; at how many even compressions curves are given."""
SECONDS, DAMPING, SHARE = 2.0, 60.0, 0.8
"""Of a body's press [s], its damping [1/s], and its step over the limit."""
FOLDED = 0.1
"""Least J below which a body counts as folded, as for the status of a run (docs/results.md)."""
REFERENCE, COARSER, MOONEY, YEOH = "reference", "reference, coarser mesh", "Mooney-Rivlin", "Yeoh"
Slip = Literal["no_slip", "frictionless", "bonded"]
"""How ends meet plates; bonded ends are plates, and sides do not fold onto them."""


@dataclass(frozen=True)
class Contestant:
    """A body of ours and its plates."""

    name: str
    cells: tuple[int, int]
    friction: float | Literal["no_slip", "bonded"] = "no_slip"
    mixed: bool = False
    """Whether elements at the plates keep their own volume."""


FINE, FINER = (5, 4), "body, a volume per vertex, finer mesh"
SLIDES, COULOMB = "body, plates slide", {0.3: "body, friction 0.3", 0.5: "body, friction 0.5"}
"""Less friction than .3 needs still finer meshes; with .8 and more elements fold before 45 %."""
CONTESTANTS = (
    Contestant("body, a volume per vertex", (3, 3)),
    Contestant("body, mixed volumes", (3, 3), mixed=True),
    Contestant(FINER, FINE),
    *(Contestant(name, FINE, friction) for friction, name in COULOMB.items()),
    Contestant(SLIDES, FINE, 0.0),
)


def sliding(compression: np.ndarray) -> np.ndarray:
    """F/(mu A) between plates that slide: λ⁻² − λ."""
    return (1.0 - compression) ** -2 - (1.0 - compression)


def eighth(cells: tuple[int, int], radius: float = RADIUS, height: float = HEIGHT) -> tuple[np.ndarray, np.ndarray]:
    """Points (n, 3) [m] and positive tetrahedra (k, 4) of the part with x, y, z ≥ 0, the middle at the origin.

    `cells`: bricks along the radius and along half the height, the last a third as large as the first: the rim is
    sharp, and the stress there has no bound. Squares become circles by (x, y) max(x, y)/√(x² + y²).
    """
    across, along = (np.append(0.0, np.cumsum(w)) / w.sum() for w in (3.0 ** -np.linspace(0, 1, n) for n in cells))
    box = MeshTet.init_tensor(across, across, along)
    x, y, z = box.p
    round_off = radius * np.maximum(x, y) / np.maximum(np.hypot(x, y), 1e-12)
    return upright(np.column_stack([x * round_off, y * round_off, 0.5 * height * z]), box.t.T.astype(np.int64))


def eighths(cells: tuple[int, int]) -> tuple[np.ndarray, np.ndarray]:
    """Points (n, 3) [m] and tetrahedra (k, 4) of eight mirrored eighths."""
    points, corners = eighth(cells)
    signs = list(itertools.product((1.0, -1.0), repeat=3))
    every = np.concatenate([points * sign for sign in signs])
    _, first, one = np.unique(every.round(9) + 0.0, axis=0, return_index=True, return_inverse=True)
    numbers = one.ravel()[np.concatenate([corners + k * len(points) for k in range(8)])]
    return upright(every[first], numbers)


def whole(cells: tuple[int, int]) -> tuple[np.ndarray, np.ndarray]:
    """Points (n, 3) [m] and quadratic tetrahedra (k, 10) of the cylinder, with round sides."""
    points, nodes = second_order(*eighths(cells))
    outside = np.hypot(*points[:, :2].T) > RADIUS - 1e-9
    middles, ends = nodes[:, 4:], outside[nodes[:, EDGES]].all(axis=2)
    bent = np.unique(middles[ends])
    points[bent, :2] *= RADIUS / np.hypot(*points[bent, :2].T)[:, None]
    return points, nodes


def reference_curves(
    cells: tuple[int, int],
    at: np.ndarray,
    slip: Slip = "no_slip",
    shape: tuple[float, float] = (RADIUS, HEIGHT),
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Forces of the reference at compressions `at` (m,), over those of plates that slide, (m,) each: F of a neo-Hookean
    cylinder of `shape` (radius, height) [m], and ∂F/∂b at b = 0 of 2 W/mu = (1 − b) (I1 − 3) + b (I2 − 3) (Mooney and
    Rivlin) and (I1 − 3) + b (I1 − 3)² (Yeoh). Raises SolveError.

    The energy at rest changes with b as at fixed nodes, so that ∂F/∂b = d/dδ ∫ ∂W/∂b dV, δ the plates' way.
    """
    radius, height = shape
    points, corners = eighth(cells, radius, height)
    straight = MeshTet(np.ascontiguousarray(points.T), np.ascontiguousarray(corners.T))
    mesh = curve(
        straight,
        lambda x: np.array([*(radius * x[:2] / np.hypot(*x[:2])), x[2]]),
        lambda x: np.abs(np.hypot(*x[:2]) - radius) < 1e-6 * radius,
    )
    basis = Basis(mesh, ElementVector(ElementTetP2()), intorder=5)
    held = [PrescribedDisplacement(lambda x, c=c: np.abs(x[c]) < 1e-9, (c,)) for c in range(3)]

    def way(t: float) -> tuple[float, float, float]:
        return 0.0, 0.0, -0.5 * height * t

    plates: tuple[RigidPlane, ...] = ()
    if slip == "bonded":
        held.append(PrescribedDisplacement(lambda x: np.abs(x[2] - 0.5 * height) < 1e-9, motion=way))
    else:
        plates = (RigidPlane((0.0, 0.0, 0.5 * height), (0.0, 0.0, -1.0), way, slip),)
    path = equilibrium_path(Problem(mesh, NeoHookean(1.0, BULK), held, plates), at)
    energies = []
    for state in path:
        u = np.zeros(basis.N)
        u[basis.nodal_dofs], u[basis.edge_dofs] = np.split(state.u.T, [mesh.nvertices], axis=1)
        moved = basis.interpolate(u).grad  # pyright: ignore[reportAttributeAccessIssue]
        F = np.moveaxis(np.asarray(moved), (0, 1), (-2, -1)) + np.eye(3)
        C, J = np.swapaxes(F, -1, -2) @ F, np.linalg.det(F)
        I1 = np.trace(C, axis1=-2, axis2=-1)
        I2 = 0.5 * (I1**2 - (C * C).sum(axis=(-2, -1))) * J ** (-4.0 / 3.0)
        I1 = I1 * J ** (-2.0 / 3.0)
        energies.append([0.5 * (basis.dx * w).sum() / basis.dx.sum() for w in (I2 - I1, (I1 - 3.0) ** 2)])
    ends: Any = ((1, [0.0, 0.0]), "not-a-knot")
    slopes = CubicSpline(np.append(0.0, at), np.vstack([[0.0, 0.0], energies]), bc_type=ends)
    pushes = [state.obstacle_force[0] if plates else state.held_force[-1] for state in path]
    force = -np.array(pushes)[:, 2] / (0.25 * np.pi * radius**2)
    more = slopes(at, 1).T
    return force / sliding(at), more[0] / sliding(at), more[1] / sliding(at)


def body_curve(contestant: Contestant, at: np.ndarray) -> np.ndarray:
    """Force of the plates on a body, over that of plates that slide, at compressions `at` (m,), (m,); NaN from where
    an element is folded. Raises StudyError for a run that breaks off."""
    points, nodes = whole(contestant.cells)
    touched = np.abs(points[:, 2]) > 0.5 * HEIGHT - 1e-9
    own = np.logical_and(contestant.mixed, touched[nodes].any(axis=1))
    body = quadratic_body(points, nodes, Material(MODULUS, DENSITY), inertia="stiffness", own_volumes=own)
    plates, ends, way = list[Plane](), list[Attachment](), 0.5 * END * HEIGHT
    for sign in (1.0, -1.0):
        path = Trajectory((0.0, SECONDS), ((0.0, 0.0, 0.0), (0.0, 0.0, -sign * way)))
        if contestant.friction == "bonded":
            ends.append(Attachment(np.flatnonzero(sign * points[:, 2] > 0.5 * HEIGHT - 1e-9), path))
        else:
            plates.append(Plane((0.0, 0.0, sign * 0.5 * HEIGHT), (0.0, 0.0, -sign), path, contestant.friction))
    limit = step_limit(body, DAMPING)
    clock = make_clock(SECONDS, 4 * MOMENTS, SHARE * limit.damped, limit)
    history = simulate(Setup(body, ImplicitVolume(), clock, tuple(plates), tuple(ends), damping=DAMPING))
    if history.outcome != "finished":
        raise StudyError(f"{contestant.name}: {history.message}")
    compression = END * history.t / SECONDS
    push = (history.held_force if ends else history.contact_force)[:, :, 2]
    force = 0.5 * (push[:, 1] - push[:, 0]) / (MODULUS * np.pi * RADIUS**2)
    force[np.minimum.accumulate(history.min_j) < FOLDED] = np.nan
    return np.interp(at, compression, force / sliding(compression))


def curves() -> pd.DataFrame:
    """All curves of the measured cylinders, one column each, over compression: minutes."""
    at = END * np.arange(1, MOMENTS + 1) / MOMENTS
    table = pd.DataFrame({"compression": at})
    table[REFERENCE], table[MOONEY], table[YEOH] = reference_curves((10, 8), at)
    table[COARSER] = reference_curves((8, 6), at)[0]
    for contestant in CONTESTANTS:
        table[contestant.name] = body_curve(contestant, at)
    return table


def sticking_moduli() -> pd.DataFrame:
    """How many times too large a modulus is that assumes plates that slide where they stick, for cylinders of other
    shapes: at 2 % compression, and the force at 20 and 30 %."""
    at, rows = 0.02 * np.arange(1, 16), []
    for shape in (0.5, 1.0, 5.0 / 3.0, 2.0, 3.0):
        factor = reference_curves((6, 5), at, shape=(RADIUS, 2.0 * RADIUS / shape))[0]
        rows.append((shape, *factor[[0, 4, 9, 14]], 1.0 + 2.0 * (0.25 * shape) ** 2))
    return pd.DataFrame(rows, columns=["diameter / height", "at 2 %", "10 %", "20 %", "30 %", "Gent and Lindley 1959"])
