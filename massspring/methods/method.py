"""The base class of methods: settings (a frozen dataclass), claims and capabilities (class variables), one compiled
loop."""

from dataclasses import replace
from typing import ClassVar, Protocol

import numpy as np
from scipy.sparse import csr_array

from massspring.body.body import Body
from massspring.kernels.arrays.layout import BoundaryConditions
from massspring.kernels.points.arrays import PointRows
from massspring.layout.allocate import start
from massspring.layout.probe_arrays import fresh
from massspring.layout.state import State, new_diagnostics
from massspring.methods.capabilities import Capabilities
from massspring.world.obstacles import Attachment, Surroundings

REMEMBERED = ("contact_id", "pressing", "normal", "dragging", "anchor", "count", "shape")
"""What contact inside facets keeps from step to step."""


class Method(Protocol):
    """A method that advances a body in time. To add one, write a subclass in a new file and add a line to METHODS."""

    name: ClassVar[str]
    """Name on the command line."""
    order: ClassVar[int]
    """Claim: global error of the trajectory ~ dt^order."""
    volume_tol: ClassVar[float | None]
    """Claim: |V/V0 − 1| after a step without contact changes at half the stability limit; None if the method makes no
    claim."""
    conserves_angular_momentum: ClassVar[bool] = True
    """Claim: a body in free flight keeps its angular momentum to round-off."""
    capabilities: ClassVar[Capabilities]
    """Capabilities with default settings; an instance with other settings may override them."""

    def why_not(self, body: Body) -> str | None:
        """Why the method cannot advance `body`; None when it can."""
        return self.capabilities.why_not(body)

    def why_not_among(self, surroundings: Surroundings) -> str | None:
        """Why the method cannot run in such surroundings; None when it can."""
        return None

    def added_stiffness(self, body: Body) -> csr_array | None:
        """B [√(N/m)], (3n, r): the method adds the stiffness B Bᵀ to that of the springs at rest; None if it adds
        none."""
        return None

    def start(self, body: Body, attachments: tuple[Attachment, ...] = (), v: np.ndarray | None = None) -> State:
        """The body at rest, or with velocities `v` (n, 3) [m/s]. Raises MassSpringError."""
        return start(body, attachments, v)

    def advance(self, state: State, boundary: BoundaryConditions) -> State:
        """One frame: as many steps as `boundary.position` has rows."""
        ...


def begin_frame(state: State, boundary: BoundaryConditions) -> State:
    """A copy to advance in place, so that the state of the caller does not change."""
    nodes = state.nodes._replace(x=state.nodes.x.copy(), v=state.nodes.v.copy())
    obstacles = len(boundary.radius) + boundary.tips.end.shape[1]
    diagnostics = new_diagnostics(obstacles, boundary.held_displacement.shape[1], state.diagnostics.stage_times)
    probing = None if state.probing is None else fresh(state.probing, diagnostics)
    rows = state.rows
    if isinstance(rows, PointRows):
        touched = {name: getattr(rows.facets, name).copy() for name in REMEMBERED}
        rows = rows._replace(
            eased=rows.eased.copy(),
            facets=rows.facets._replace(**touched),
            most_squeezed=np.full_like(rows.most_squeezed, -np.inf),
        )
    return replace(state, nodes=nodes, rows=rows, diagnostics=diagnostics, probing=probing)
