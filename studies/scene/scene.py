"""A scene: what happens to which organ. Both solvers read the same one: load, contact and clock agree."""

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np

from massspring import Obstacle, Ramp, Trajectory
from studies.base.errors import StudyError
from studies.geometry import BallRegion, EllipsoidRegion, HalfSpace, PaintedRegion
from studies.geometry.files.units import Source
from studies.scene.placing import Vector
from studies.scene.start import InitialConditions
from studies.scene.tissues import Tissue

Region = HalfSpace | BallRegion | EllipsoidRegion | PaintedRegion


@dataclass(frozen=True)
class Organ:
    """A shape the mesher knows, or a mesh file."""

    shape: str
    """A name of `studies.geometry`, or "file"."""
    parameters: Mapping[str, Any] = field(default_factory=dict)
    """Of the shape; for "file": {"path": …, "unit": "m", "cm", "mm" or "in"}, "scale", "longest_side" [m] or "part" as
    in studies.geometry.files.units.Source, and "remesh": true, "smooth" or "wall" [m] for a new surface with the nodes
    that are asked for, the outlines of held regions on its edges; "holes": true and "solid" [m] as in
    studies.geometry.api.scans.Remeshing. "sha256" is added: results belong to what the file
    holds, wherever it lies."""

    def __post_init__(self) -> None:
        if self.shape == "file" and "path" in self.parameters and "sha256" not in self.parameters:
            content = Source(Path(self.parameters["path"])).sha256
            if content is not None:  # of a file that cannot be read the mesher says why
                object.__setattr__(self, "parameters", {**self.parameters, "sha256": content})


@dataclass(frozen=True)
class Held:
    """A region whose surface nodes follow a path."""

    name: str
    region: Region
    path: Trajectory = field(default_factory=Trajectory)


@dataclass(frozen=True)
class Lumen:
    """What fills a hollow organ."""

    content: str = "closed"
    """"closed": an incompressible content, its volume prescribed; "open": drained, without pressure."""
    filling: Ramp = field(default_factory=Ramp)
    """Volume of a closed lumen over time, as a factor of its volume at rest."""

    def __post_init__(self) -> None:
        if self.content not in ("closed", "open"):
            raise StudyError(f"a lumen's content is 'closed' or 'open', not '{self.content}'")
        if self.content == "open" and set(self.filling.values) != {1.0}:
            raise StudyError("an open lumen cannot be filled; close it, or leave its filling out")


@dataclass(frozen=True)
class ForceOutput:
    """The force a scene is about: what an obstacle, or an attachment, feels of the body."""

    what: str
    """"obstacle" or "held"."""
    number: int
    direction: Vector
    """Unit vector of the force on the body, so that a press counts as positive."""

    def __post_init__(self) -> None:
        if self.what not in ("obstacle", "held"):
            raise StudyError(f"a force is probed at an 'obstacle' or a 'held' region, not at '{self.what}'")


Times = int | tuple[int, ...]
"""How often something is done on every mesh of a family, or on each of them, coarse to fine."""


@dataclass(frozen=True)
class ReferencePlan:
    """The family of meshes the reference is computed on, coarse to fine; the last one is the reference."""

    mesh: str
    """"solid": the scene's organ with so many surface nodes; "octant": an eighth of a ball (three symmetry planes)."""
    levels: tuple[float, ...]
    """Surface nodes ("solid"), or element size over radius away from the contact ("octant"); three are the rule."""
    variants: tuple[str, ...] = ("steps", "contact", "kappa")
    """Settings that are made better on the coarsest mesh, for their share of the error bar."""
    at_outlines: Times = 0
    """Times the elements at the outlines of held regions are halved, on every mesh or on each; three halve the size."""
    at_contact: Times = 0
    """Times the elements at the surface that an obstacle will reach are halved, likewise."""

    dt: float | None = None
    """Largest time step of a motion [s]; None: a load path without inertia, as slow as it takes."""

    def __post_init__(self) -> None:
        if self.mesh not in ("solid", "octant") or len(self.levels) < 2:
            raise StudyError(
                "a reference needs a 'solid' or 'octant' mesh and at least two levels, or it has no error bar"
            )
        for times in (self.at_outlines, self.at_contact):
            listed = times if isinstance(times, tuple) else (times,) * len(self.levels)
            if len(listed) != len(self.levels) or any(number < 0 for number in listed):
                raise StudyError(
                    f"a reference plan halves elements {times} times on meshes {self.levels}; give one number of at "
                    f"least 0, or one for each mesh"
                )
        if self.dt is not None and not 0.0 < self.dt < np.inf:
            raise StudyError(f"a reference plan has dt = {self.dt} s; give a positive time step, or None for no motion")

    def bisections(self, level: float) -> tuple[int, int]:
        """Times the elements at outlines and those at the contact are halved on mesh `level`. Raises StudyError."""
        return _on(self.at_outlines, self.levels, level), _on(self.at_contact, self.levels, level)

    def alone(self, level: float) -> "ReferencePlan":
        """What of the plan the mesh `level` depends on: the same in every family that has it. Raises StudyError."""
        outlines, contact = self.bisections(level)
        return replace(self, levels=(level, level), variants=(), at_outlines=outlines, at_contact=contact)

    def coarsest(self, count: int) -> "ReferencePlan":
        """The plan of its `count` coarsest meshes."""
        outlines, contact = (
            times[:count] if isinstance(times, tuple) else times for times in (self.at_outlines, self.at_contact)
        )
        return replace(self, levels=self.levels[:count], at_outlines=outlines, at_contact=contact)


def _on(times: Times, levels: tuple[float, ...], level: float) -> int:
    if not isinstance(times, tuple):
        return times
    if level not in levels:
        raise StudyError(f"mesh {level:g} is none of the plan's, {levels}: it does not say how often to halve there")
    return times[levels.index(level)]


@dataclass(frozen=True)
class Scene:
    """Load, clock and material; immutable and JSON-able."""

    name: str
    title: str
    organ: Organ
    tissue: Tissue
    duration: float
    """[s]."""
    frames: int
    checkpoints: tuple[float, ...]
    """Times at which the reference is known [s], ascending; the last one is the scene at its deepest, come to rest."""
    probed: ForceOutput
    reference: ReferencePlan | None
    obstacles: tuple[Obstacle, ...] = ()
    held: tuple[Held, ...] = ()
    lumen: Lumen | None = None
    """Of a hollow organ; None for a solid one."""
    gravity: Vector = (0.0, 0.0, 0.0)
    """[m/s²]."""
    damping: float = 0.0
    """Mass-proportional [1/s]; both models have the same."""
    quantities: tuple[str, ...] = ("force", "surface", "interior", "silhouette", "volume")
    """What may be compared; a scene that leaves a rigid turn free drops "surface" and "interior" (gauge freedom)."""
    start: InitialConditions | None = None
    """None: at rest."""
    not_for: tuple[tuple[str, str], ...] = ()
    """(method, reason): combinations that make no sense."""

    def skip(self, method: str) -> str | None:
        """Why the method of that name does not apply here; None when it does."""
        return dict(self.not_for).get(method)

    @property
    def regions(self) -> dict[str, Region]:
        """Attachment regions by name, as the mesher wants them."""
        return {held.name: held.region for held in self.held}

    @property
    def filled(self) -> bool:
        """Whether a lumen's content pushes back."""
        return self.lumen is not None and self.lumen.content == "closed"

    @property
    def symmetric(self) -> bool:
        """Whether the reference is an octant, mirrored at the three coordinate planes."""
        return self.reference is not None and self.reference.mesh == "octant"

    def output_force(self, contact_force: np.ndarray, held_force: np.ndarray) -> np.ndarray:
        """The probed force [N], (…,), of forces on the body (…, o, 3) and (…, g, 3): positive for a press."""
        force = contact_force if self.probed.what == "obstacle" else held_force
        return force[..., self.probed.number, :] @ np.asarray(self.probed.direction)
