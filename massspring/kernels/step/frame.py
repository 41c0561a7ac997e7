"""The arguments of a frame loop as one tuple; kernels take the parts that they use."""

from typing import NamedTuple

from massspring.kernels.arrays.layout import BoundaryConditions, Contacts, FrameDiagnostics, Model, Nodes, Workspace
from massspring.kernels.jit.by_address import by_address
from massspring.kernels.probe.arrays import Probing


@by_address
class Frame(NamedTuple):
    """A body, its surroundings during a frame, and the diagnostics of the frame."""

    model: Model
    nodes: Nodes
    contacts: Contacts
    work: Workspace
    boundary: BoundaryConditions
    diagnostics: FrameDiagnostics
    probing: Probing | None = None
    """Thin probes, or None; with None the loop is compiled without their stage."""
