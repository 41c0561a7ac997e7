"""A body in motion, as every method is given it."""

from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from massspring.kernels.arrays.face_pairs import FacePairs
from massspring.kernels.arrays.layout import BoundaryConditions, Contacts, FrameDiagnostics, Model, Nodes, Workspace
from massspring.kernels.arrays.volume_rows import VolumeRows
from massspring.kernels.jit.stage_clock import UNTIMED, StageTimes
from massspring.kernels.jit.thread_team import ThreadTeam
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
    """Interior gauge pressure of each kept volume in the last step, beyond what it is at rest [Pa], (m,); 0 for
    methods that keep none."""
    rows: VolumeRows | PointRows | None = None
    """None where one closed surface is kept: a division needs no rows."""
    diagnostics: FrameDiagnostics = field(default_factory=lambda: new_diagnostics(0, 0))
    """What the last frame measured of itself."""
    memory: Any = None
    """Arrays that only the method knows, made by its `start`."""
    probing: Probing | None = None
    """Of thin probes; None where there are none: the frame is then compiled without their stage."""
    pairs: FacePairs | None = None
    """Faces of a cut that may touch; None where there are none: the frame is then compiled without them."""
    permutation: np.ndarray | None = None
    """Where each node is in `model` and `nodes`, (n,); None where they have the numbers of the body."""

    team: ThreadTeam | None = None
    """Threads that share the longest loops of a frame; None for one thread."""
    origin: np.ndarray | None = None
    """What `nodes.x` and `model.held_rest` are relative to [m], (3,); None where they are as given."""

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
        """What a frame loop is given."""
        return Frame(
            self.model, self.nodes, self.contacts, self.work, boundary, self.diagnostics, self.probing, self.team
        )

    def moved_to(self, x: np.ndarray) -> "State":
        """The same at positions `x` (n, 3) [m]."""
        nodes = self.nodes._replace(x=self.nodes.x.copy())
        place = slice(None) if self.permutation is None else self.permutation
        nodes.x[place] = x if self.origin is None else x - self.origin
        return replace(self, nodes=nodes)

    def relative_to(self, origin: np.ndarray) -> "State":
        """The same body in the same place, its arrays relative to `origin` (3,) [m]; they were as given.

        The obstacles of a frame have to be so too (`Setup.boundary`).
        """
        nodes = self.nodes._replace(x=self.nodes.x - origin)
        model = self.model._replace(held_rest=self.model.held_rest - origin)
        return replace(self, nodes=nodes, model=model, origin=origin)


def new_diagnostics(obstacles: int, attachments: int, stage_times: StageTimes = UNTIMED) -> FrameDiagnostics:
    """Diagnostics at zero; the stage times go on."""
    singular, limited, iterations = (np.zeros(size, dtype=np.int64) for size in (1, 1, 2))
    return FrameDiagnostics(
        np.zeros((obstacles, 3)), np.zeros((attachments, 3)), singular, limited, iterations, stage_times
    )
