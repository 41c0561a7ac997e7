"""The state of a body in motion, which every method advances."""

from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from massspring.kernels.arrays.face_pairs import FacePairs
from massspring.kernels.arrays.layout import BoundaryConditions, Contacts, FrameDiagnostics, Model, Nodes, Workspace
from massspring.kernels.arrays.volume_rows import VolumeRows
from massspring.kernels.jit.stage_clock import UNTIMED, StageTimes
from massspring.kernels.points.arrays import PointRows
from massspring.kernels.probe.arrays import Probing
from massspring.kernels.step.frame import Frame


@dataclass(frozen=True, eq=False)
class State:
    """A body in motion. `advance` returns a new one and leaves the old as it was."""

    model: Model
    nodes: Nodes
    contacts: Contacts
    work: Workspace
    lam: np.ndarray
    """Interior gauge pressure of each kept volume in the last step, minus its value at rest [Pa], (m,); 0 for methods
    that keep no volume."""
    rows: VolumeRows | PointRows | None = None
    """None if one closed surface is kept, which needs no rows."""
    diagnostics: FrameDiagnostics = field(default_factory=lambda: new_diagnostics(0, 0))
    """Diagnostics of the last frame."""
    memory: Any = None
    """Data that only the method uses, created by its `start`."""
    probing: Probing | None = None
    """Arrays of thin probes, or None; with None the frame is compiled without their stage."""
    pairs: FacePairs | None = None
    """Faces of a cut that may touch, or None; with None the frame is compiled without them."""
    permutation: np.ndarray | None = None
    """Index of each node of the body in `model` and `nodes`, (n,); None if the numbers are the same."""
    origin: np.ndarray | None = None
    """Origin of `nodes.x` and `model.held_rest` [m], (3,); None for the origin of the body."""

    @property
    def x(self) -> np.ndarray:
        """Positions [m], (n, 3)."""
        x = self.nodes.x if self.permutation is None else self.nodes.x[self.permutation]
        return x if self.origin is None else x + self.origin

    @property
    def v(self) -> np.ndarray:
        """Velocities [m/s], (n, 3)."""
        return self.nodes.v if self.permutation is None else self.nodes.v[self.permutation]

    def frame(self, boundary: BoundaryConditions) -> Frame:
        """The arguments of a frame loop."""
        return Frame(self.model, self.nodes, self.contacts, self.work, boundary, self.diagnostics, self.probing)

    def moved_to(self, x: np.ndarray) -> "State":
        """The same at positions `x` (n, 3) [m]."""
        nodes = self.nodes._replace(x=self.nodes.x.copy())
        place = slice(None) if self.permutation is None else self.permutation
        nodes.x[place] = x if self.origin is None else x - self.origin
        return replace(self, nodes=nodes)

    def relative_to(self, origin: np.ndarray) -> "State":
        """The same body in the same place, with arrays relative to `origin` (3,) [m]; `self` must have no origin.

        The obstacles of a frame must have the same origin (`Setup.boundary`).
        """
        nodes = self.nodes._replace(x=self.nodes.x - origin)
        model = self.model._replace(held_rest=self.model.held_rest - origin)
        return replace(self, nodes=nodes, model=model, origin=origin)


def new_diagnostics(obstacles: int, attachments: int, stage_times: StageTimes = UNTIMED) -> FrameDiagnostics:
    """Diagnostics at zero; the stage times go on."""
    singular, limited, iterations = (np.zeros(size, dtype=np.int64) for size in (1, 1, 2))
    contact, held = np.zeros((obstacles, 3)), np.zeros((attachments, 3))
    earlier = np.full_like(contact, np.nan), np.full_like(held, np.nan)
    return FrameDiagnostics(contact, held, *earlier, np.zeros(1), singular, limited, iterations, stage_times)
