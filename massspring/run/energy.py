"""The work that is done on a body against its energy: a body that gains more than it is given shakes itself."""

import numpy as np

from massspring.body.body import Measured
from massspring.kernels.forces.springs import membrane_energy, spring_energy
from massspring.layout.state import State
from massspring.run.setup import Setup


def kinetic_energy(state: State, mass: np.ndarray | None = None) -> float:
    """Of the nodes that nothing holds [J], with other masses (n,) [kg] if they are given, in the order of the state's:
    forces on held regions are without the inertia of their nodes."""
    v = np.where(state.model.inverse_mass[:, None] > 0.0, state.nodes.v, 0.0)
    mass = state.model.mass if mass is None else mass
    # Not by `@`: a pool of threads that has computed a product waits for the next at the expense of frames.
    return 0.5 * float(np.einsum("i,ij,ij->", mass, v, v, dtype=np.float64))


def elastic_energy(state: State) -> float:
    """Energy of springs and membrane [J], including that of taut springs at rest."""
    net, x = state.model, state.nodes.x.astype(np.float64, copy=False)
    taut = spring_energy(x, net.ends, net.rest_length, net.stiffness)
    return taut + membrane_energy(x, net.membrane)


class EnergyAccount:
    """Energy of a body during a stage, and the work on it: of obstacles, attachments, gravity and fills, and the energy
    at the start. Damping and friction take energy, so that energy − work only falls.

    A volume that is within its tolerance but not on its target has been moved there by its pressure, which does work,
    too. The work is NaN for a method that does not keep volumes as constraints: it stores energy in other ways too.
    """

    def __init__(self, setup: Setup, state: State, frame: int = 0) -> None:
        self.setup, self.frame = setup, frame
        self.rest_energy = setup.body.rest_energy
        self.unmet = 0.0
        self._look(state, setup.body.measured(state.x.astype(np.float64, copy=False)))
        constrained = setup.method.capabilities.correction in ("limited", "full")
        self.done = self.energy if constrained else np.nan
        self.force, self.pressure_at_end = np.zeros((len(setup.obstacles) + len(setup.attachments), 3)), self.pressure

    def add(self, state: State, measured: Measured, steps: int) -> None:
        """Adds the next frame, which took so many steps and ended at `state`, measured there.

        The force of a step is that of the positions at its begin; half of its change in the frame makes the work of
        second order in the step, and so does the whole of the pressure's.
        """
        done, target, fallen = state.diagnostics, self.target, self.fallen
        force, pressure, ended = self.force, self.pressure, self.pressure_at_end
        dt, self.frame = self.setup.clock.frame / steps, self.frame + 1
        last = np.concatenate([done.contact_impulse - done.earlier_contact, done.held_impulse - done.earlier_held])
        self.force = last / dt
        times = self.frame * self.setup.clock.frame - np.array([dt, 0.0])
        begin, end = self.setup.paths(times)
        self._look(state, measured)
        self.pressure_at_end = self.pressure + (self.pressure - pressure) / steps
        self.done += float(done.work[0]) + float(((self.force + 0.5 * (self.force - force)) * (end - begin)).sum())
        self.done += float(0.5 * (ended + self.pressure_at_end) @ (self.target - target)) + self.fallen - fallen
        self.unmet = float(self.pressure_at_end @ (measured.volume - self.target))

    def entered(self, setup: Setup, state: State) -> "EnergyAccount":
        """That of the stage after an event, whose change of energy counts as work."""
        after = EnergyAccount(setup, state, self.frame)
        after.done += self.done - self.energy
        after.force = self.force
        return after

    @property
    def work(self) -> float:
        """On the body, from where it was at rest [J]."""
        return self.done + self.unmet

    @property
    def energy(self) -> float:
        """Kinetic and elastic [J]."""
        return self.kinetic + self.elastic

    def _look(self, state: State, measured: Measured) -> None:
        body, x = self.setup.body, measured.x
        self.kinetic = kinetic_energy(state)
        self.tissue_kinetic = (
            self.kinetic if body.inertia is None else kinetic_energy(state, self.setup.inside.body.mass)
        )
        self.elastic = elastic_energy(state) - self.rest_energy + measured.local_energy
        self.fallen = float(body.mass @ (x - body.rest) @ np.asarray(self.setup.gravity))
        self.pressure = state.lam + state.model.rest_lam
        self.target = self.setup.volume_targets(np.array([self.frame * self.setup.clock.frame]))[0]
