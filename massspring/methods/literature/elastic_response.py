"""The precomputed elastic response of the held organ: each step ends in equilibrium, displacements are linear in the
forces.

Bro-Nielsen, Cotin (1996) and Cotin, Delingette, Ayache (1999, 2000): u = K⁻¹ f is solved for unit forces at every
surface node before the run. In the run a small dense system gives the contact forces at touched nodes, and the shape is
a sum of columns. James, Pai (1999, ArtDefo) solve the same by updates of a boundary-element inverse. Here K is that of
the elements of docs/theory.md (13.1) at rest, with a volume term at every point. Contact follows (14.3), and
attachments displace the body by their shapes Ψ (14.2).

Limits: displacements are linear: a rotated part swells (by 1/cos of the angle), and pressing an organ by a fifth
changes its volume by several per cent. No inertia, no damping: every step ends in equilibrium. The columns take 72
bytes × surface nodes × nodes.
"""

from dataclasses import dataclass, replace
from typing import ClassVar

import numpy as np

from massspring.body.body import Body
from massspring.errors import MassSpringError
from massspring.kernels.arrays.layout import BoundaryConditions, Model
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
from massspring.methods.literature.pressing import press
from massspring.methods.method import Method, begin_frame
from massspring.world.obstacles import Attachment, Surroundings

MOST_BYTES = 2e9
"""Largest size of the columns [bytes]."""
TOGETHER = 256
"""Number of columns solved for at once."""


@dataclass(frozen=True)
class ElasticResponse(Method):
    """Precomputed linear response of the held organ (Cotin et al. 2000): a small dense system a step, no inertia."""

    bulk_ratio: float = 50.0
    """K over the shear modulus [1]; 50 is a Poisson ratio of 0.49."""

    name: ClassVar[str] = "elastic_response"
    order: ClassVar[int] = 0
    volume_tol: ClassVar[float | None] = None
    conserves_angular_momentum: ClassVar[bool] = False
    capabilities: ClassVar[Capabilities] = Capabilities(
        "elements",
        conditionally_stable=False,
        prestress=True,
        point_volumes=True,
        thin_probes=No("its columns belong to nodes"),
        events=No("its columns are those of one body"),
    )

    def __post_init__(self) -> None:
        check_ratio(self.name, "bulk_ratio", self.bulk_ratio)

    def why_not(self, body: Body) -> str | None:
        return why_not_linear(body)

    def why_not_among(self, surroundings: Surroundings) -> str | None:
        if surroundings.moved:
            return "it has no inertia, so that nothing moves by itself; take linear_modes"
        return why_not_among(surroundings)

    def start(self, body: Body, attachments: tuple[Attachment, ...] = (), v: np.ndarray | None = None) -> State:
        """The body at rest with all its columns. Raises MassSpringError if they exceed MOST_BYTES."""
        columns = 3 * len(body.surface_nodes)
        size = 8.0 * columns * 3 * body.node_count
        if size > MOST_BYTES:
            raise MassSpringError(
                f"{self.name} would keep {columns:,} columns of {body.node_count:,} nodes, {size / 1e9:.2g} GB; "
                f"the limit is {MOST_BYTES / 1e9:g} GB: use a coarser mesh"
            )
        state = start(body, attachments, v)
        held = linear_body(body, state.model, self.bulk_ratio * body.rest_pressure)
        return replace(state, memory=precomputed(held, state.model))

    def advance(self, state: State, boundary: BoundaryConditions) -> State:
        after = begin_frame(state, boundary)
        memory: Precomputed = after.memory
        held, nodes, diagnostics = memory.held, after.nodes, after.diagnostics
        weighed = held.rest + (memory.sag @ boundary.gravity).reshape(-1, 3)
        for step in range(len(boundary.position)):
            look_back(diagnostics, boundary, step)
            free = weighed + (held.follow @ boundary.held_displacement[step].ravel()).reshape(-1, 3)
            pressed = press(after, boundary, step, free, Columns(memory))
            diagnostics.held_impulse[:] += held.held_impulse((pressed.end - held.rest).ravel(), boundary)
            pressed.book(boundary, diagnostics.contact_impulse)
            nodes.v[:] = (pressed.end - nodes.x) / boundary.dt
            nodes.x[:] = pressed.end
        return after


@dataclass(frozen=True, eq=False)
class Precomputed:
    """Solutions computed before the run."""

    held: LinearBody
    sag: np.ndarray
    """Displacement by a gravity of 1 m/s² along each axis [s²], (3n, 3)."""
    columns: np.ndarray
    """K⁻¹ of unit forces at the free surface nodes [m/N], (s, 3, 3n)."""
    place: np.ndarray
    """Index of each node in `columns`, (n,); −1 if it has none."""


def precomputed(held: LinearBody, model: Model) -> Precomputed:
    """Solves for all columns of a held body."""
    n = len(held.rest)
    touchable = np.flatnonzero(model.touchable)
    place = np.full(n, -1)
    place[touchable] = np.arange(len(touchable))
    coordinates = (3 * touchable[:, None] + np.arange(3)).ravel()
    columns = np.empty((len(coordinates), 3 * n))
    for first in range(0, len(coordinates), TOGETHER):
        some = coordinates[first : first + TOGETHER]
        units = np.zeros((3 * n, len(some)))
        units[some, np.arange(len(some))] = 1.0
        columns[first : first + len(some)] = held.solve(units).T
    sag = held.solve(np.kron(held.mass[:, None], np.eye(3)))
    return Precomputed(held, sag, columns.reshape(-1, 3, 3 * n), place)


class Columns:
    """The response along contact rows from the columns of their nodes."""

    def __init__(self, memory: Precomputed) -> None:
        self._memory = memory
        self._rows = np.empty((0, 0, 3))

    def compliance(self, rows: TouchedRows) -> np.ndarray:
        memory = self._memory
        columns = memory.columns[memory.place[rows.nodes]]
        self._rows = np.einsum("ri,rij->rj", rows.direction, columns).reshape(len(columns), *memory.held.rest.shape)
        return np.einsum("abi,bi->ab", self._rows[:, rows.nodes], rows.direction)

    def moved(self, rows: TouchedRows, pushes: np.ndarray) -> np.ndarray:
        return np.tensordot(pushes, self._rows, 1)
