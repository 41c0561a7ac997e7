"""One random trial of a method: every choice that makes it, drawn from a seed and a number."""

from dataclasses import dataclass, field
from typing import Any

import numpy as np

from massspring import METHODS, Method

ORGANS = "liver", "kidney"
LINEAR, QUADRATIC, SURFACE = "tetrahedral", "quadratic", "surface"
CHOICES: dict[str, tuple[Any, ...]] = {
    "shape": ("cloud", "needle", "sheet", "sliver", "two", "cell", *ORGANS),
    "kind": (LINEAR, LINEAR, QUADRATIC, SURFACE),
    "law": ("van_gelder", "uniform", "lloyd", "lloyd_matched", "cotangent", "edge_smoothed"),
    "volumes": ("whole", "whole", "nodal", "patches", "regions"),
    "method": tuple(method.name for method in METHODS),
    "start": ("rest", "rest", "flattened", "mirrored", "scrambled", "shrunk", "collapsed"),
    "load": ("none", "plane", "sphere", "capsule", "pinch", "probe", "jump"),
    "friction": (0.0, 0.0, 0.5, "no_slip"),
    "held": (False, True),
    "precision": ("float64", "float64", "float32"),
}
"""What is drawn evenly; a choice that stands there twice is drawn twice as often."""
WITHOUT_LENGTH = ("cotangent", "edge_smoothed")
WITH_LENGTH = tuple(law for law in CHOICES["law"] if law not in WITHOUT_LENGTH)
FRAMES = 12
FEW, SMALL = 24, 40
"""Steps and nodes at most with a method that is stable at any step: it solves equations, again and again where they are
hopeless."""
LONG, ONE_IN = 1_000_000, 2_000
"""Steps of the rare trial that only rests."""
UNFIT = 0.1
"""Share of trials whose choices are left although a method may refuse them."""


@dataclass(frozen=True)
class Trial:
    """A body, a method, a step and a world; the default of each choice is its gentlest value."""

    seed: int
    number: int
    shape: str = "cloud"
    kind: str = LINEAR
    law: str = "van_gelder"
    volumes: str = "whole"
    method: str = field(kw_only=True)
    nodes: int = 12
    """About; of a cell four, of an organ on its surface."""
    steps: int = FRAMES
    """Of the whole run, in FRAMES frames."""
    dt_fraction: float = 0.5
    """Step over the stability limit of the damped springs."""
    modulus: float = 2e3
    """[Pa]."""
    heaviest: float = 1.0
    """Largest mass over the smallest, over what the mesh gives."""
    start: str = "rest"
    target: float = 1.0
    """Of the volume, over that at rest; it jumps there."""
    load: str = "none"
    depth: float = 0.1
    """Over the body's smallest extent."""
    speed: float = 0.1
    """Of the obstacle [m/s]."""
    friction: float | str = 0.0
    held: bool = False
    """The lowest quarter of the body."""
    far: float = 0.0
    """From the origin [m]."""
    gravity: float = 0.0
    """[m/s²]."""
    damping: float = 0.0
    """Over the largest frequency of the springs."""
    precision: str = "float64"

    @property
    def line(self) -> str:
        """The command that repeats it."""
        return f"organbench fuzz --seed {self.seed} --trial {self.number}"


def draw(seed: int, number: int) -> Trial:
    """Trial `number` of the campaign of `seed`: the same on every machine."""
    rng = np.random.default_rng((seed, number))
    drawn = {name: _one(rng, values) for name, values in CHOICES.items()}
    rng.integers(4)  # release 0.3 drew threads here: its published trials stay what they are
    drawn |= {
        "nodes": int(rng.integers(8, 120)),
        "steps": int(FRAMES * rng.integers(1, 60)),
        "dt_fraction": float(2.0 ** rng.uniform(-4.0, 2.0)),
        "modulus": float(2e3 * 10.0 ** rng.uniform(-3.0, 3.0)),
        "heaviest": float(10.0 ** rng.uniform(0.0, 6.0)) if rng.random() < 0.3 else 1.0,
        "target": float(rng.uniform(0.3, 3.0)) if rng.random() < 0.2 else 1.0,
        "depth": float(rng.uniform(0.02, 0.9)),
        "speed": float(10.0 ** rng.uniform(-2.0, 1.0)),
        "far": 10.0 if rng.random() < 0.2 else 0.0,
        "gravity": 9.81 if rng.random() < 0.3 else 0.0,
        "damping": float(10.0 ** rng.uniform(-3.0, 0.3)) if rng.random() < 0.5 else 0.0,
    }
    if not method_of(drawn["method"]).capabilities.conditionally_stable:
        drawn |= {"steps": min(drawn["steps"], FEW), "nodes": min(drawn["nodes"], SMALL)}
        drawn["shape"] = "cloud" if drawn["shape"] in ORGANS else drawn["shape"]
    if rng.random() > UNFIT:
        drawn |= _fitted(drawn, rng)
    if rng.random() < 1.0 / ONE_IN:
        drawn |= {"steps": LONG, "shape": "cell", "kind": LINEAR, "start": "rest", "load": "none"}
    return Trial(seed, number, **drawn)


def _fitted(drawn: dict[str, Any], rng: np.random.Generator) -> dict[str, Any]:
    """Other choices for those that the method's table refuses."""
    able = method_of(drawn["method"]).capabilities
    kinds = {"points": (QUADRATIC,), "elements": (LINEAR,), "tetrahedra": (LINEAR,), "several": CHOICES["kind"]}
    kind = _one(rng, kinds.get(able.keeps, (LINEAR, SURFACE)))
    volumes = drawn["volumes"] if able.keeps == "several" and kind == LINEAR else "whole"
    law = drawn["law"]
    if not able.prestress or volumes not in ("nodal", "patches"):
        law = _one(rng, WITH_LENGTH)
    if able.keeps == "elements":
        volumes, law = "nodal", _one(rng, WITHOUT_LENGTH)
    choices: dict[str, Any] = {"kind": kind, "volumes": volumes, "law": law}
    choices |= {} if able.float32 and kind != QUADRATIC else {"precision": "float64"}
    choices |= {} if able.targets else {"target": 1.0}
    if drawn["load"] == "probe" and (not able.thin_probes or kind == QUADRATIC):
        choices["load"] = "sphere"
    if drawn["start"] != "rest" and choices.get("load", drawn["load"]) not in ("none", "jump"):
        choices |= {"start": "rest"} if rng.random() < 0.5 else {"load": "none"}
    if drawn["shape"] in ("two", "cell") and volumes == "regions":
        choices["volumes"] = "whole"
    return choices


def method_of(name: str) -> type[Method]:
    return {method.name: method for method in METHODS}[name]


def _one(rng: np.random.Generator, values: tuple[Any, ...]) -> Any:
    return values[int(rng.integers(len(values)))]
