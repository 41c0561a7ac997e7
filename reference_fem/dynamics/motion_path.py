"""Bodies in motion: ringing, release, impact, moving probes; with an account of the energy."""

from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import ArrayLike

from reference_fem.dynamics.inertia import MovingSystem, scheme
from reference_fem.dynamics.march import March, kinetic
from reference_fem.errors import SolveError
from reference_fem.model.problem import Problem
from reference_fem.statics.equilibrium import Equilibrium, describe
from reference_fem.system.checks import check_times
from reference_fem.system.state import NewtonSettings


@dataclass(frozen=True)
class DynamicsSettings:
    """Settings of the time integration; the start time and the tolerances of a step are in NewtonSettings.

    dt: largest step [s], None = the intervals between the wanted times. damping: c [1/s] of the force -c M v, as the
    mass-spring body has it. rho_inf: factor per step on the amplitude of an oscillation that the step cannot resolve, 0
    to 1. Take 0.5 for an impact: with 0.9 the few nodes in contact oscillate. Raises SolveError for values out of
    range.
    """

    dt: float | None = None
    damping: float = 0.0
    rho_inf: float = 0.9
    newton: NewtonSettings = field(default_factory=NewtonSettings)

    def __post_init__(self):
        if self.dt is not None and not (np.isfinite(self.dt) and self.dt > 0.0):
            raise SolveError(f"the largest time step is {self.dt} s: it must be positive and finite")
        if not (np.isfinite(self.damping) and self.damping >= 0.0):
            raise SolveError(f"the damping is {self.damping} 1/s: it must be zero or positive and finite")
        if not 0.0 <= self.rho_inf <= 1.0:
            raise SolveError(f"rho_inf is {self.rho_inf}: it must lie in 0 to 1 (0.9 damps little)")


@dataclass(frozen=True, eq=False)
class Moment(Equilibrium):
    """One instant of a motion: the fields of an Equilibrium, with inertia in the reactions, and the energies."""

    v: np.ndarray
    """Velocity of the P2 nodes, (N2, 3) [m/s]."""
    a: np.ndarray
    """Acceleration of the P2 nodes, (N2, 3) [m/s²]."""
    kinetic: float
    """Kinetic energy [J]; `energy` is the strain energy."""
    damped: float
    """Energy dissipated by damping since the start [J]."""
    work: float
    """Work of loads, obstacles, holders and cavities on the body since the start [J]."""
    balance: float
    """Kinetic and strain energy, less those at the start, plus damped, less work [J]: the energy error of the
    scheme."""


def motion_path(
    problem: Problem,
    times: ArrayLike,
    settings: DynamicsSettings | None = None,
    velocity0: ArrayLike | None = None,
    start: Equilibrium | None = None,
    on_step: Callable[[Moment], None] | None = None,
) -> list[Moment]:
    """The motion at the given times [s], from velocity0 (3,) or (N2, 3) [m/s] or from rest; on_step sees each moment.

    start: an Equilibrium on the same mesh, from whose displacement the body is released; None = undeformed. All loads
    of `problem` act from the start, including gravity. Raises SolveError for a problem that cannot be set up, and when
    a step shorter than newton.smallest_step of the ordinary one still fails: its `converged` holds what was reached.
    """
    settings = settings or DynamicsSettings()
    begin = settings.newton.start
    times = check_times(times, begin)
    if problem.faces_touch:
        raise SolveError(
            "a motion in which the faces of a cut touch is asked for: follow a load path, or let them pass"
        )
    system = MovingSystem(problem, settings.newton, settings.damping)
    march = March(system, scheme(settings.rho_inf), settings.dt)
    path: list[Moment] = []
    try:
        ahead = times[times > begin]
        march.begin(*given_start(system, velocity0, start), ahead[0] - begin if len(ahead) else 1.0)
        for t in times:
            if t > begin:
                march.advance(t, path)
            path.append(moment(system, march))
            if on_step is not None:
                on_step(path[-1])
    finally:
        system.solver.release()
    return path


def given_start(system: MovingSystem, velocity0: ArrayLike | None, start: Equilibrium | None):
    """(State, velocities (3 N2,)) that a motion begins with."""
    shape, state = system.nodes.shape, system.rest()
    if start is not None:
        if start.u.shape != shape:
            raise SolveError(
                f"the start has {len(start.u)} nodes but the mesh {shape[0]}: start from an equilibrium on this mesh"
            )
        state.x[: system.field_count] = np.concatenate((start.u.ravel(), start.p))
    given = np.asarray(0.0 if velocity0 is None else velocity0, dtype=float)
    if given.shape not in ((), (3,), shape) or not np.isfinite(given).all():
        raise SolveError(f"the start velocities have shape {given.shape}: give finite values [m/s], (3,) or {shape}")
    return state, np.broadcast_to(given, shape).ravel().copy()


def moment(system: MovingSystem, march: March) -> Moment:
    motion, account = march.motion, march.account
    seen = describe(system, motion.state, march.iterations, march.substeps)
    march.iterations = march.substeps = 0
    moving = kinetic(system, motion)
    return Moment(
        **vars(seen),
        v=motion.v.reshape(-1, 3).copy(),
        a=motion.a.reshape(-1, 3).copy(),
        kinetic=moving,
        damped=float(account.damped),
        work=float(account.work),
        balance=float(moving + seen.energy - march.energy0 + account.damped - account.work),
    )
