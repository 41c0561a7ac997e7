"""What a load step starts from, what acts during it, and how hard to try."""

from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np

from reference_fem.contact.augmented import NO_GRIP, NO_GUESS, Grip

NO_FACES = np.zeros((0, 0))


@dataclass(frozen=True)
class NewtonSettings:
    """How hard to try. Tolerances are relative: force to the largest of reactions, contact and weight; volume to V0."""

    force_tol: float = 1e-6
    volume_tol: float = 1e-8
    penetration_tol: float = 3e-4
    """Deepest contact penetration over the largest displacement; more than that and the multiplier is updated. The
    force is then within 3e-4 of that at 1e-5."""
    penalty: float = 1500.0
    """Contact penalty times facet size over mu; the multiplier does the rest: the softer, the more updates."""
    max_iterations: int = 25
    smallest_step: float = 1.0 / 1024.0
    """Smallest sub-step, as a fraction of the interval between two wanted times."""
    start: float = 0.0
    """Time [s] of the undeformed state."""
    solver: str = "auto"


@dataclass
class State:
    """Unknowns x and contact multipliers at time t; `iterations` spent to come here.

    x: u at the displacement functions (P2: the nodes) [m], interleaved, p at the vertices [Pa] unless the element
    eliminates it, pressures of the cavities [Pa]. load: share of the dead forces and of the cavities' start values that
    acts, 1 once they are switched on.
    """

    t: float
    load: float
    x: np.ndarray
    multiplier: np.ndarray
    """With which the contact pressures follow from x, (no, nf, nq) [Pa]."""
    pressure: np.ndarray
    """The contact pressures: the multipliers the next step starts from, so that points that left start without."""
    iterations: int = 0
    stiffness: float = 1.0
    grip: Grip = NO_GRIP
    """With which the tractions of stuck points follow from x."""
    hold: Grip = NO_GRIP
    """The grip that the next step starts from."""
    faces: np.ndarray = field(default_factory=lambda: NO_FACES)
    """As `multiplier`, between the faces of a cut, (nf, nq) [Pa]; of length 0 without any."""
    face_pressure: np.ndarray = field(default_factory=lambda: NO_FACES)
    """As `pressure`, between them."""


class Loads(NamedTuple):
    """What acts during one evaluation: dead forces (field_count,) [N], or 0, obstacles (no, 8), multipliers, penalty
    factor.

    filling (nc,): wanted volumes [m³] of the cavities, or pressures [Pa] where those are prescribed. shift (no, 3) [m]:
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
