"""Vibration modes of the held organ: a few decoupled oscillators in place of all nodes.

Pentland, Williams (1989): the modes of M ü + c M u̇ + K u = f are kept up to a number, each with a separate equation;
James, Pai (2002, DyRT) integrate each exactly; Hauser, Shen, O'Brien (2003) add attachments and obstacles, whose
contact forces are solved for in terms of the modes (docs/theory.md, section 14). With u = Ψ d + Φ q, Φᵀ M Φ = 1, K Φ =
M Φ ω²,

    q̈ + c q̇ + ω² q = Φᵀ (f + m g) − Φᵀ M Ψ (d̈ + c ḋ)

K is that of linear elements (14.1), Ψ the static shapes of moved attachments (14.2), as in Craig and Bampton (1968).
Without obstacles each oscillator is advanced exactly; with obstacles by backward Euler, which gives a steady contact
force.

Limits: displacements are linear, so a rotated part swells. Omitted modes do not deform: a narrow contact is too stiff
unless there are as many modes as its shape needs.
"""

from dataclasses import dataclass, replace
from typing import ClassVar

import numpy as np
from scipy.linalg import eigh, expm
from scipy.sparse import diags_array
from scipy.sparse.linalg import eigsh

from massspring.body.body import Body
from massspring.errors import MassSpringError
from massspring.kernels.arrays.layout import BoundaryConditions
from massspring.kernels.step.begin import look_back
from massspring.layout.allocate import start
from massspring.layout.state import State
from massspring.methods.capabilities import Capabilities, No
from massspring.methods.implicit.contact import TouchedRows
from massspring.methods.literature.linear_body import (
    LinearBody,
    check_ratio,
    linear_body,
    why_not_among,
    why_not_linear,
)
from massspring.methods.literature.pressing import Pressed, press
from massspring.methods.method import Method, begin_frame
from massspring.world.obstacles import Attachment, Surroundings


@dataclass(frozen=True)
class LinearModes(Method):
    """Linear vibration modes of the held organ (Pentland, Williams 1989): decoupled oscillators, contact solved for."""

    modes: int = 300
    """Number of the lowest modes that are kept; all if a body has fewer."""
    bulk_ratio: float = 50.0
    """K over the shear modulus [1]; 50 is a Poisson ratio of 0.49."""

    name: ClassVar[str] = "linear_modes"
    order: ClassVar[int] = 1
    volume_tol: ClassVar[float | None] = None
    conserves_angular_momentum: ClassVar[bool] = False
    capabilities: ClassVar[Capabilities] = Capabilities(
        "elements",
        conditionally_stable=False,
        prestress=True,
        point_volumes=True,
        thin_probes=No("its modes move all nodes at once"),
        events=No("its modes are those of one body"),
    )

    def __post_init__(self) -> None:
        check_ratio(self.name, "bulk_ratio", self.bulk_ratio)
        if self.modes < 1:
            raise MassSpringError(f"{self.name}'s modes is {self.modes}; it needs at least one")

    def why_not(self, body: Body) -> str | None:
        return why_not_linear(body)

    def why_not_among(self, surroundings: Surroundings) -> str | None:
        return why_not_among(surroundings)

    def start(self, body: Body, attachments: tuple[Attachment, ...] = (), v: np.ndarray | None = None) -> State:
        """The body at rest, or with velocities `v` (n, 3) [m/s], and its modes."""
        state = start(body, attachments, v)
        held = linear_body(body, state.model, self.bulk_ratio * body.rest_pressure)
        return replace(state, memory=modes_of(held, self.modes))

    def advance(self, state: State, boundary: BoundaryConditions) -> State:
        after = begin_frame(state, boundary)
        motion = Motion(after, boundary)
        for step in range(len(boundary.position)):
            motion.take(step)
        return after


@dataclass(frozen=True, eq=False)
class Modes:
    """k modes of a held body; flat displacements, (3n,)."""

    held: LinearBody
    shape: np.ndarray
    """Φ [1/√kg], (3n, k), 0 where held."""
    square: np.ndarray
    """ω² [1/s²], (k,), ascending."""
    seen: np.ndarray
    """Φᵀ M [√kg], (k, 3n)."""
    carried: np.ndarray
    """Φᵀ M Ψ [√kg], (k, 3g)."""
    exact: dict[tuple[float, float], np.ndarray]
    """(step, damping) -> propagator of (q, q̇, load) of each mode over a step, (k, 2, 3)."""

    def propagator(self, dt: float, damping: float) -> np.ndarray:
        """The exact propagator of each oscillator under a constant load over `dt` [s] with `damping` [1/s], (k, 2,
        3)."""
        if (dt, damping) not in self.exact:
            omega = np.sqrt(self.square)
            rate = np.zeros((len(omega), 3, 3))  # of (ω q, q̇, load)
            rate[:, 0, 1], rate[:, 1, 0], rate[:, 1, 1], rate[:, 1, 2] = omega, -omega, -damping, 1.0
            matrix = expm(dt * rate)[:, :2]
            matrix[:, 0] /= omega[:, None]
            matrix[:, :, 0] *= omega[:, None]
            self.exact[dt, damping] = matrix
        return self.exact[dt, damping]


def modes_of(held: LinearBody, count: int) -> Modes:
    """The lowest modes of a held body."""
    mass = np.repeat(held.inertia, 3)[held.free]
    scale = diags_array(1.0 / np.sqrt(mass))
    matrix = scale @ held.inner @ scale
    size = len(held.free)
    if count < size // 2:
        begin = np.random.default_rng(0).standard_normal(size)
        square, vectors = eigsh(matrix.tocsc(), count, sigma=0.0, v0=begin)
    else:
        square, vectors = eigh(matrix.toarray(), subset_by_index=(0, min(count, size) - 1))
    order = np.argsort(square)
    shape = np.zeros((3 * len(held.rest), len(order)))
    shape[held.free] = (scale @ vectors)[:, order]
    seen = np.ascontiguousarray((shape * np.repeat(held.inertia, 3)[:, None]).T)
    return Modes(held, shape, square[order], seen, seen @ held.follow, {})


class Motion:
    """One frame; the modal coordinates are computed from the nodes at its start."""

    def __init__(self, state: State, boundary: BoundaryConditions) -> None:
        self.state, self.boundary = state, boundary
        self.modes: Modes = state.memory
        self.follow = self.modes.held.follow
        nodes, model = state.nodes, state.model
        first = np.unique(model.held_group, return_index=True)[1]
        held = model.held_nodes[first]
        self.place = (nodes.x[held] - model.held_rest[first]).ravel()
        """Displacements of the attachments [m], (3g,)."""
        self.speed = nodes.v[held].ravel()
        """Velocities of the attachments [m/s], (3g,)."""
        u = (nodes.x - self.modes.held.rest).ravel()
        self.q = self.modes.seen @ u - self.modes.carried @ self.place
        """Modal coordinates q [m √kg], (k,)."""
        self.p = self.modes.seen @ nodes.v.ravel() - self.modes.carried @ self.speed
        """dq/dt [m √kg/s], (k,)."""
        weight = (self.modes.held.mass[:, None] * boundary.gravity).ravel()
        self.weight = self.modes.shape.T @ weight

    def take(self, step: int) -> None:
        """Makes one step and adds the impulses of obstacles and attachments."""
        boundary, modes, state = self.boundary, self.modes, self.state
        look_back(state.diagnostics, boundary, step)
        place = boundary.held_displacement[step].ravel()
        speed = (place - self.place) / boundary.dt
        self.p -= modes.carried @ (speed - self.speed)
        self.place, self.speed = place, speed
        load = self.weight - boundary.damping * (modes.carried @ speed)
        if len(boundary.radius):
            pressed = self.pressed(step, load)
        else:
            self.q, self.p = np.einsum("kab,kb->ak", modes.propagator(boundary.dt, boundary.damping), self.with_(load))
            pressed = Pressed(self.position(self.q), None, np.zeros(0))
        held = modes.held
        state.diagnostics.held_impulse[:] += held.held_impulse((pressed.end - held.rest).ravel(), boundary)
        pressed.book(boundary, state.diagnostics.contact_impulse)
        state.nodes.x[:] = pressed.end
        state.nodes.v[:] = (self.follow @ self.speed + modes.shape @ self.p).reshape(-1, 3)

    def with_(self, load: np.ndarray) -> np.ndarray:
        """(q, q̇, load) of each mode, (k, 3)."""
        return np.column_stack([self.q, self.p, load])

    def position(self, q: np.ndarray) -> np.ndarray:
        """Positions of the nodes [m], (n, 3)."""
        return self.modes.held.rest + (self.follow @ self.place + self.modes.shape @ q).reshape(-1, 3)

    def pressed(self, step: int, load: np.ndarray) -> Pressed:
        """Backward Euler, q⁺ = q + dt q̇⁺, q̇⁺ (1 + c dt + dt² ω²) = q̇ + dt (load + Φᵀ Cᵀ γ − ω² q)."""
        dt, modes = self.boundary.dt, self.modes
        resists = 1.0 + self.boundary.damping * dt + dt * dt * modes.square
        self.p = (self.p + dt * (load - modes.square * self.q)) / resists
        self.q = self.q + dt * self.p
        response = ModalResponse(modes, dt / resists, dt)
        pressed = press(self.state, self.boundary, step, self.position(self.q), response)
        change = response.speed(pressed.pushes)
        self.p, self.q = self.p + change, self.q + dt * change
        return pressed


class ModalResponse:
    """Response of the modes to contact forces along rows in a step."""

    def __init__(self, modes: Modes, speeds: np.ndarray, dt: float) -> None:
        """`speeds`: velocity of each mode at the end of the step per unit of load, (k,)."""
        self._modes, self._speeds, self._dt = modes, speeds, dt
        self._loads = np.zeros((0, len(speeds)))

    def compliance(self, rows: TouchedRows) -> np.ndarray:
        shape = self._modes.shape.reshape(-1, 3, len(self._speeds))
        self._loads = np.einsum("ri,rik->rk", rows.direction, shape[rows.nodes])
        return (self._dt * self._speeds * self._loads) @ self._loads.T

    def moved(self, rows: TouchedRows, pushes: np.ndarray) -> np.ndarray:
        return (self._modes.shape @ (self._dt * self.speed(pushes))).reshape(-1, 3)

    def speed(self, pushes: np.ndarray) -> np.ndarray:
        """Change of the modal velocities by `pushes` (c,) [N], (k,)."""
        return self._speeds * (pushes @ self._loads)
