"""A scene: an organ and its loads. Both solvers use the same scene, so load, contact and clock agree."""

import math
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np

from massspring import Obstacle, Ramp, Trajectory
from studies.base.errors import StudyError
from studies.geometry import BallRegion, EllipsoidRegion, HalfSpace, PaintedRegion
from studies.geometry.files.units import Source
from studies.scene.cut import Cut
from studies.scene.placing import Vector
from studies.scene.start import InitialConditions
from studies.scene.tissues import Tissue

Region = HalfSpace | BallRegion | EllipsoidRegion | PaintedRegion


@dataclass(frozen=True)
class Organ:
    """A shape of the mesher, or a mesh file."""

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
            if content is not None:  # for a file that cannot be read the mesher gives the reason
                object.__setattr__(self, "parameters", {**self.parameters, "sha256": content})


@dataclass(frozen=True)
class Held:
    """A region whose surface nodes follow a path."""

    name: str
    region: Region
    path: Trajectory = field(default_factory=Trajectory)


@dataclass(frozen=True)
class Lumen:
    """The content of a hollow organ."""

    content: str = "closed"
    """"closed": an incompressible content, its volume prescribed; "open": drained, without pressure."""
    filling: Ramp = field(default_factory=Ramp)
    """Volume of a closed lumen over time, as a factor of its volume at rest."""

    def __post_init__(self) -> None:
        if self.content not in ("closed", "open"):
            raise StudyError(f"a lumen's content is 'closed' or 'open', not '{self.content}'")
        if self.content == "open" and self.changes:
            raise StudyError("an open lumen cannot be filled; close it, or leave its filling out")

    @property
    def changes(self) -> bool:
        """Whether its content grows or shrinks."""
        return set(self.filling.values) != {1.0}


@dataclass(frozen=True)
class ForceOutput:
    """The probed force of a scene: that of an obstacle or an attachment."""

    what: str
    """"obstacle" or "held"."""
    number: int
    direction: Vector
    """Unit vector of the force on the body, so that a press counts as positive."""

    def __post_init__(self) -> None:
        if self.what not in ("obstacle", "held"):
            raise StudyError(f"a force is probed at an 'obstacle' or a 'held' region, not at '{self.what}'")
        if len(self.direction) != 3 or not abs(math.hypot(*self.direction) - 1.0) <= UNIT:
            raise StudyError(f"a force is probed along {self.direction!r}; give a vector of length 1")


UNIT = 1e-6
"""Largest deviation of the length of a direction from 1."""
FEWEST_UNKNOWNS = 1e3
"""Least value of a plan's `most`: with fewer unknowns a reference is too inaccurate."""


@dataclass(frozen=True)
class ReferencePlan:
    """The family of meshes on which the reference is computed; the finest is the reference, all give its error bar.

    A load path of a whole organ has nested meshes: the coarsest has `base` surface nodes, and each next one halves the
    elements whose error indicator is largest, until the bar of the probed force and 2.5 times that of the mean surface
    displacement are below `tolerance`, or the next mesh would have more than `most` unknowns. Octants and motions have
    `levels` set by hand.
    """

    mesh: str = "solid"
    """"solid": the scene's organ; "octant": an eighth of a ball (three symmetry planes)."""
    levels: tuple[float, ...] = ()
    """For an octant the element size over the radius away from the contact, coarse to fine; for a motion of a whole
    organ its surface nodes. Three levels are usual."""
    variants: tuple[str, ...] = ("steps", "contact", "kappa")
    """Settings that are refined on the coarsest mesh, for their share of the error bar."""
    base: int = 270
    """Surface nodes of the coarsest of nested meshes; fewer than 250 miss thin parts of an organ."""
    at_contact: int = 2
    """How often its elements are halved at the surface that an obstacle will reach."""
    tolerance: float = 0.005
    """Relative bar of the force at which nested meshes are fine enough."""
    most: float = 60e3
    """Unknowns of the finest of nested meshes."""
    dt: float | None = None
    """Largest time step of a motion [s]; None: a load path without inertia."""

    def __post_init__(self) -> None:
        if self.mesh not in ("solid", "octant"):
            raise StudyError(f"a reference has a 'solid' or 'octant' mesh, not '{self.mesh}'")
        if self.dt is not None and not 0.0 < self.dt < np.inf:
            raise StudyError(f"a reference plan has dt = {self.dt} s; give a positive time step, or None for no motion")
        if not self.nested and len(self.levels) < 2:
            raise StudyError("a reference on an octant or of a motion needs two or more levels, or it has no error bar")
        if self.nested and self.levels:
            raise StudyError("nested reference meshes have no levels; give base, tolerance or most in their place")
        if self.base < 4 or self.at_contact < 0 or not self.tolerance > 0.0 or not self.most >= FEWEST_UNKNOWNS:
            raise StudyError(
                f"a reference plan has base = {self.base}, at_contact = {self.at_contact}, tolerance = "
                f"{self.tolerance} and most = {self.most:g}; give at least 4, 0, more than 0 and {FEWEST_UNKNOWNS:g}"
            )

    @property
    def nested(self) -> bool:
        """Whether each mesh of the family has parts of the elements of the one before."""
        return self.mesh == "solid" and self.dt is None

    def smaller(self) -> "ReferencePlan":
        """A plan for a quick look: two meshes, no refined settings."""
        if self.nested:
            return replace(self, variants=(), tolerance=1.0, most=min(self.most, SMALLER))
        return replace(self, levels=self.levels[:2], variants=())


SMALLER = 12e3
"""Unknowns of a quick look."""


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
    """Times at which the reference is computed [s], ascending; at the last one the load is largest and the body at
    rest."""
    probed: ForceOutput
    reference: ReferencePlan | None
    obstacles: tuple[Obstacle, ...] = ()
    held: tuple[Held, ...] = ()
    lumen: Lumen | None = None
    """Content of a hollow organ; None for a solid one."""
    gravity: Vector = (0.0, 0.0, 0.0)
    """[m/s²]."""
    damping: float = 0.0
    """Mass-proportional [1/s]; both models have the same."""
    quantities: tuple[str, ...] = ("force", "surface", "interior", "silhouette", "volume")
    """Quantities that may be compared; a scene that allows a rigid rotation omits "surface" and "interior" (gauge
    freedom)."""
    start: InitialConditions | None = None
    """None: at rest."""
    cuts: tuple[Cut, ...] = ()
    """Their sections do not meet in the organ."""
    not_for: tuple[tuple[str, str], ...] = ()
    """(method, reason): combinations that make no sense."""

    def __post_init__(self) -> None:
        if not isinstance(self.name, str):
            raise StudyError(f"a scene is called {self.name!r}; give a text")
        names = [cut.name for cut in self.cuts]
        twice = sorted({name for name in names if names.count(name) > 1})
        if twice:
            raise StudyError(f"scene '{self.name}' has two cuts called '{twice[0]}'; give each its own name")
        if self.cuts and self.reference is not None and not self.reference.nested:
            raise StudyError(
                f"scene '{self.name}' is cut, and its reference is of an octant or a motion, which are not cut; "
                "give it a 'solid' mesh without dt, or no reference"
            )

    @property
    def cut(self) -> Cut | None:
        """The cut of the scene, if it has one. Raises StudyError for several, which `cuts` has."""
        if len(self.cuts) > 1:
            raise StudyError(
                f"scene '{self.name}' has {len(self.cuts)} cuts, and one at most is known here; leave the others out"
            )
        return self.cuts[0] if self.cuts else None

    def skip(self, method: str) -> str | None:
        """Why the method of that name does not apply here; None when it does."""
        return dict(self.not_for).get(method)

    @property
    def regions(self) -> dict[str, Region]:
        """Attachment regions by name, for the mesher."""
        return {held.name: held.region for held in self.held}

    @property
    def filled(self) -> bool:
        """Whether a lumen's content pushes back."""
        return self.lumen is not None and self.lumen.content == "closed"

    def filled_at(self, t: float) -> bool:
        """Whether the lumen is filled and no cut has opened it before time t [s]."""
        return self.filled and not any(cut.opens_lumen and cut.at < t for cut in self.cuts)

    @property
    def symmetric(self) -> bool:
        """Whether the reference is an octant, mirrored at the three coordinate planes."""
        return self.reference is not None and self.reference.mesh == "octant"

    def output_force(self, contact_force: np.ndarray, held_force: np.ndarray) -> np.ndarray:
        """The probed force [N], (…,), of forces on the body (…, o, 3) and (…, g, 3): positive for a press."""
        force = contact_force if self.probed.what == "obstacle" else held_force
        return force[..., self.probed.number, :] @ np.asarray(self.probed.direction)
