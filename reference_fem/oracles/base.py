"""Results of an oracle: numbers compared with the truth, and errors over mesh size."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from reference_fem.elements.shapes import nodes
from reference_fem.model.problem import Problem


@dataclass(frozen=True)
class Check:
    """One number compared with the truth."""

    quantity: str
    unit: str
    expected: float
    got: float
    tolerance: float
    """Largest deviation allowed: relative to the expected value, or in `unit` when `absolute`."""
    mesh: str
    unknowns: int
    absolute: bool = False

    @property
    def deviation(self) -> float:
        """Distance from the expected value, relative to it unless `absolute`."""
        gap = abs(self.got - self.expected)
        return gap if self.absolute else gap / abs(self.expected)

    @property
    def met(self) -> bool:
        """Whether the check passes; NaN never does."""
        return self.deviation <= self.tolerance


@dataclass(frozen=True)
class Curve:
    """Error of one quantity over mesh size."""

    panel: str
    """Name of the panel; curves of one panel share axes."""
    label: str
    sizes: tuple[float, ...]
    """Element size over the size of the body, from coarse to fine."""
    errors: tuple[float, ...]
    """Relative errors."""

    @property
    def order(self) -> float:
        """Slope between the two finest meshes."""
        (h1, h0), (e1, e0) = self.sizes[-2:], self.errors[-2:]
        return float(np.log(e1 / e0) / np.log(h1 / h0))


@dataclass(frozen=True)
class Outcome:
    """The result of one oracle."""

    checks: tuple[Check, ...]
    curves: tuple[Curve, ...] = ()


@dataclass(frozen=True)
class Oracle:
    """A problem with an independent solution."""

    name: str
    title: str
    source: str
    measure: Callable[[], Outcome]
    fast: bool = True
    """Whether it belongs to the half that every change must pass."""


def unknowns(problem: Problem) -> int:
    """Number of unknowns of a problem, including held ones."""
    return 3 * len(nodes(problem.mesh)) + problem.mesh.nvertices
