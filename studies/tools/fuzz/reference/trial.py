"""One trial of the reference: every choice that makes it, drawn from a seed and a number."""

from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np

from reference_fem import ELEMENTS
from studies.tools.fuzz.choices import Choices
from studies.tools.fuzz.trial import ORGANS, UNFIT

OBSTACLES = "plane", "sphere", "capsule"
MOVED = "press", "pull", "shear"
FILLED = "fill", "pump"
SHELL = "shell"
CHOICES: dict[str, tuple[Any, ...]] = {
    "shape": ("cloud", "cloud", "sliver", "two", "octant", "octant", "box", "box", SHELL, SHELL),
    "element": tuple(ELEMENTS),
    "law": ("neo_hookean", "mooney_rivlin"),
    "load": ("none", *OBSTACLES, *OBSTACLES, *MOVED),
    "slip": ("frictionless", "frictionless", "no_slip"),
    "steps": (1, 2, 4, 10, 30),
    "iterations": (5, 10, 25, 25, 50),
    "smallest_step": (1.0, 1.0 / 16.0, 1.0 / 64.0),
    "solver": ("scipy", "scipy", "scipy", "scipy", "scipy", "scipy", "scipy", "auto"),
}
"""What is drawn evenly; a choice that stands there twice is drawn twice as often."""
FLAWS = "inside_out", "open", "unused", "not_finite", "flat", "loose"
FLAWED, ONE_ORGAN_IN, MOVING = 0.08, 40, 0.12
MOVING_ELEMENTS = "P2/P1", "P2/P0"
"""Those that motions have; others are left in few trials, and refused."""


@dataclass(frozen=True)
class ReferenceTrial(Choices):
    """A body, an element, a material, a load and how hard to try."""

    COMMAND: ClassVar[str] = "organbench fuzz --reference"

    shape: str = "octant"
    flaw: str = "none"
    """What is wrong with the mesh; of "loose", with what holds it."""
    bend: float = 0.0
    """How far mid-side nodes of the surface are moved, over the length of their edge; 0: straight as drawn."""
    nodes: int = 8
    """Vertices, about; of an organ on its surface."""
    element: str = "P2/P1"
    law: str = "neo_hookean"
    mu: float = 2e3
    """[Pa]."""
    bulk: float = 1e3
    """kappa / mu."""
    load: str = "none"
    slip: str = "frictionless"
    depth: float = 0.1
    """Over the body's height; of a lumen, how far it is filled: 0.9 is three times its volume, or a pressure of mu."""
    gravity: float = 0.0
    """[m/s²]."""
    steps: int = 1
    """Wanted times."""
    force_tol: float = 1e-6
    volume_tol: float = 1e-8
    penetration_tol: float = 3e-4
    penalty: float = 1500.0
    iterations: int = 25
    smallest_step: float = 1.0 / 64.0
    solver: str = "scipy"
    speed: float = 0.0
    """Size of the body over the time that the load takes, over the speed of shear waves; 0: a path of rest."""


def draw(seed: int, number: int) -> ReferenceTrial:
    """Trial `number` of the reference's campaign of `seed`: the same on every machine."""
    rng = np.random.default_rng((seed, number, 18))
    drawn = {name: values[int(rng.integers(len(values)))] for name, values in CHOICES.items()}
    drawn |= {
        "flaw": FLAWS[int(rng.integers(len(FLAWS)))] if rng.random() < FLAWED else "none",
        "bend": float(10.0 ** rng.uniform(-3.0, -0.8)) if rng.random() < 0.25 else 0.0,
        "nodes": int(rng.integers(6, 26)),
        "mu": float(2e3 * 10.0 ** rng.uniform(-3.0, 3.0)),
        "bulk": float(10.0 ** rng.uniform(0.0, 6.0)),
        "depth": float(rng.uniform(0.02, 0.9)),
        "gravity": 9.81 if rng.random() < 0.3 else 0.0,
        "force_tol": float(10.0 ** rng.uniform(-8.0, -3.0)),
        "volume_tol": float(10.0 ** rng.uniform(-9.0, -5.0)),
        "penetration_tol": float(10.0 ** rng.uniform(-5.0, -2.0)),
        "penalty": float(10.0 ** rng.uniform(2.0, 4.5)),
        "speed": float(10.0 ** rng.uniform(-2.0, 0.5)) if rng.random() < MOVING else 0.0,
    }
    if drawn["shape"] == SHELL and rng.random() < 0.7:
        drawn["load"] = FILLED[int(rng.integers(2))]
    if drawn["speed"] > 0.0 and rng.random() > UNFIT:
        drawn["element"] = MOVING_ELEMENTS[int(rng.integers(2))]
    if rng.random() < 1.0 / ONE_ORGAN_IN:
        drawn |= {"shape": ORGANS[int(rng.integers(len(ORGANS)))], "steps": min(drawn["steps"], 4)}
    return ReferenceTrial(seed, number, **drawn)
