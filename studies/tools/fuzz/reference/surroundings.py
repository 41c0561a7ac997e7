"""The problem of a trial: what holds its body, what comes at it, and how hard to try."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from skfem import MeshTet

from reference_fem import (
    BodyForce,
    Cavity,
    DynamicsSettings,
    MooneyRivlin,
    NeoHookean,
    NewtonSettings,
    PrescribedDisplacement,
    Problem,
    RigidCapsule,
    RigidPlane,
    RigidSphere,
)
from reference_fem.oracles.bodies import symmetry
from studies.tools.fuzz.bodies import DENSITY, RADIUS
from studies.tools.fuzz.reference.bodies import INNER, mesh_of
from studies.tools.fuzz.reference.trial import FILLED, MOVED, OBSTACLES, SHELL, ReferenceTrial

HELD = 0.4
"""Share of the height that is held, and that is moved."""
ALONG = {"press": (0.0, 0.0, -1.0), "pull": (0.0, 0.0, 1.0), "shear": (1.0, 0.0, 0.0)}
FULLEST = 0.9
"""Depth at which a lumen holds three times its volume, or its pressure is mu."""


@dataclass(frozen=True)
class Task:
    """What is solved, when, and how."""

    problem: Problem
    times: np.ndarray
    """Wanted, from above 0 to the end of the load [s]."""
    newton: NewtonSettings
    dynamics: DynamicsSettings | None
    """None: a path of rest."""


def task_of(trial: ReferenceTrial, ask: Callable[[], None] = lambda: None) -> Task:
    """What a trial asks to be solved; `ask` is called in every load step, and may raise.

    Raises SolveError or StudyError for what cannot be described.
    """
    mesh, newton = mesh_of(trial), _newton(trial)
    duration, dynamics = 1.0, None
    if trial.speed > 0.0:
        duration = float(np.ptp(mesh.p, axis=1).max()) / np.sqrt(trial.mu / DENSITY) / trial.speed
        dynamics = DynamicsSettings(damping=0.1 / duration, rho_inf=0.5, newton=newton)
    problem = Problem(
        mesh,
        _material(trial),
        _held(trial, mesh, duration),
        _obstacles(trial, mesh, duration),
        gravity=(0.0, 0.0, -trial.gravity),
        density=DENSITY,
        cavities=_cavities(trial, duration),
        element=trial.element,
        loads=(_watch(ask),),
    )
    return Task(problem, np.arange(1, trial.steps + 1) * (duration / trial.steps), newton, dynamics)


def _watch(ask: Callable[[], None]) -> BodyForce:
    """A force of nothing: that it is asked for tells of a load step."""

    def value(t: float, x: np.ndarray) -> np.ndarray:
        ask()
        return np.zeros_like(x)

    return BodyForce(value)


def _newton(trial: ReferenceTrial) -> NewtonSettings:
    return NewtonSettings(
        force_tol=trial.force_tol,
        volume_tol=trial.volume_tol,
        penetration_tol=trial.penetration_tol,
        penalty=trial.penalty,
        max_iterations=trial.iterations,
        smallest_step=trial.smallest_step,
        solver=trial.solver,
    )


def _material(trial: ReferenceTrial) -> NeoHookean | MooneyRivlin:
    if trial.law == "neo_hookean":
        return NeoHookean(trial.mu, trial.bulk * trial.mu)
    return MooneyRivlin(0.3 * trial.mu, 0.2 * trial.mu, trial.bulk * trial.mu)


def _box(mesh: MeshTet) -> tuple[np.ndarray, np.ndarray]:
    return np.nanmin(mesh.p, axis=1), np.nanmax(mesh.p, axis=1)


def _held(trial: ReferenceTrial, mesh: MeshTet, duration: float) -> list[PrescribedDisplacement]:
    """Planes of symmetry, or the lowest part; and the highest part where it is moved."""
    low, high = _box(mesh)
    share = HELD * (high[2] - low[2])
    held = [PrescribedDisplacement(lambda x: x[2] <= low[2] + share)]
    if trial.shape in ("octant", SHELL):
        held = symmetry()
    if trial.flaw == "loose":
        held = [PrescribedDisplacement(lambda x: x[2] <= low[2] + share, (2,))]
    if trial.load in MOVED:
        far = trial.depth * (high[2] - low[2]) * np.array(ALONG[trial.load])
        parts = (0, 1, 2) if len(held) == 1 else (0,) if trial.load == "shear" else (2,)
        motion = _linear(far, duration)
        beside = 1e-9 if len(held) > 1 else -np.inf
        held.append(PrescribedDisplacement(lambda x: (x[2] >= high[2] - share) & (x[0] > beside), parts, motion))
    return held


def _linear(far: np.ndarray, duration: float) -> Callable[[float], np.ndarray]:
    """From nothing to `far` (3,) [m] in `duration` [s]."""
    return lambda t: far * (t / duration)


def _obstacles(trial: ReferenceTrial, mesh: MeshTet, duration: float) -> list[RigidPlane | RigidSphere | RigidCapsule]:
    """From above: it starts where it touches, and goes no deeper than the depth."""
    if trial.load not in OBSTACLES:
        return []
    low, high = _box(mesh)
    extent, (x, y, _) = high - low, 0.5 * (low + high)
    if trial.shape in ("octant", SHELL):
        x = y = 0.0
    radius = 0.3 * float(extent.min())
    motion, z = _linear(np.array([0.0, 0.0, -trial.depth * extent[2]]), duration), float(high[2])
    if trial.load == "plane":
        return [RigidPlane((x, y, z), (0.0, 0.0, -1.0), motion, trial.slip)]
    if trial.load == "sphere":
        return [RigidSphere((x, y, z + radius), radius, motion, trial.slip)]
    reach = 2.0 * float(extent[0])
    return [RigidCapsule((x - reach, y, z + radius), (x + reach, y, z + radius), radius, motion, trial.slip)]


def _cavities(trial: ReferenceTrial, duration: float) -> list[Cavity]:
    """The lumen of a shell, filled or pumped up; open where nothing fills it, and asked of others too: they refuse."""
    if trial.load not in FILLED:
        return []

    def lumen(x: np.ndarray) -> np.ndarray:
        return (np.linalg.norm(x, axis=0) < 1.1 * INNER * RADIUS) & (x.min(axis=0) > 1e-3 * RADIUS)

    if trial.load == "fill":
        return [Cavity(lumen, volume=lambda t: 1.0 + 2.0 * trial.depth / FULLEST * t / duration)]
    return [Cavity(lumen, pressure=lambda t: trial.mu * trial.depth / FULLEST * t / duration)]
