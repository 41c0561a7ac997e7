"""Data of a load step: its start, its loads, and the settings of Newton's method."""

from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np

from reference_fem.contact.augmented import NO_GRIP, NO_GUESS, Grip

NO_FACES = np.zeros((0, 0))


@dataclass(frozen=True)
class NewtonSettings:
    """Tolerances and limits of Newton's method. Tolerances are relative: force to the largest of reactions, contact and
    weight; volume to V0."""

    force_tol: float = 1e-6
    volume_tol: float = 1e-8
    penetration_tol: float = 3e-4
    """Deepest contact penetration over the largest displacement; beyond it the multiplier is updated. The force is then
    within 3e-4 of that with a tolerance of 1e-5."""
    penalty: float = 1500.0
    """Contact penalty times facet size over mu. A softer penalty needs more updates of the multiplier."""
    max_iterations: int = 16
    smallest_step: float = 1.0 / 1024.0
    """Smallest sub-step, as a fraction of the interval between two wanted times."""
    start: float = 0.0
    """Time [s] of the undeformed state."""
    solver: str = "auto"


@dataclass
class State:
    """Unknowns x and contact multipliers at time t; `iterations`: those of the step that led here.

    x: u at the nodes [m], interleaved, p at the vertices [Pa], pressures of the cavities [Pa]. load: share of the dead
    forces and of the start values of cavities that acts; 1 once they are fully applied.
    """

    t: float
    load: float
    x: np.ndarray
    multiplier: np.ndarray
    """Multipliers from which the contact pressures follow with x, (no, nf, nq) [Pa]."""
    pressure: np.ndarray
    """The contact pressures, with which the multipliers of the next step start, so that separated points start with
    0."""
    iterations: int = 0
    stiffness: float = 1.0
    grip: Grip = NO_GRIP
    """The grip from which the tractions of stuck points follow with x."""
    hold: Grip = NO_GRIP
    """The grip with which the next step starts."""
    faces: np.ndarray = field(default_factory=lambda: NO_FACES)
    """As `multiplier`, between the faces of a cut, (nf, nq) [Pa]; of length 0 without any."""
    face_pressure: np.ndarray = field(default_factory=lambda: NO_FACES)
    """As `pressure`, between the faces of a cut."""


class Loads(NamedTuple):
    """The loads of one evaluation: dead forces (field_count,) [N], or 0, obstacles (no, 8), multipliers, penalty
    factor.

    filling (nc,): target volumes [m³] of the cavities, or prescribed pressures [Pa]. shift (no, 3) [m]:
    a further move of the obstacles to be linearised, None = none. faces, face_guess (nf, nq): as multiplier and guess,
    between the faces of a cut.
    """

    force: np.ndarray | float
    rows: np.ndarray
    multiplier: np.ndarray
    filling: np.ndarray = np.zeros(0)
    stiffness: float = 1.0
    shift: np.ndarray | None = None
    grip: Grip = NO_GRIP
    guess: np.ndarray = NO_GUESS
    faces: np.ndarray = NO_FACES
    face_guess: np.ndarray = NO_FACES
