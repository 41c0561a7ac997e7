"""Baumgarte's stabilisation: the constraint as a damped oscillator.

Baumgarte, Computer Methods in Applied Mechanics and Engineering 1 (1972): instead of d²V/dt² = 0, which drifts, ask for
d²(V − V0)/dt² + 2 alpha d(V − V0)/dt + beta² (V − V0) = 0 (docs/theory.md, eq. 10.5).

Limits: stable for (beta dt)² + 4 alpha dt < 4 and 0 < 2 alpha dt < 2. Correcting a volume error takes time: the larger
root of eq. 10.6 is the share of it that a step leaves. 2 alpha = beta = 1/dt is HCJ05 with the convective term.
"""

from dataclasses import dataclass
from typing import ClassVar

from massspring.errors import MassSpringError
from massspring.kernels.arrays.layout import BoundaryConditions
from massspring.layout.state import State
from massspring.methods.capabilities import Capabilities
from massspring.methods.families.one_volume import Rule, advance_by
from massspring.methods.method import Method


@dataclass(frozen=True)
class Baumgarte(Method):
    """Lets a wrong volume die away like a damped oscillation, at rates per time step."""

    alpha: float = 0.5
    """alpha dt [1]. alpha = beta is critical damping, as Baumgarte chose; 0.5 leaves 75 % of a volume error after one
    step and 1 % after 16, with (beta dt)² + 4 alpha dt = 2.25 of the 4 that are stable."""
    beta: float = 0.5
    """beta dt [1]."""

    name: ClassVar[str] = "baumgarte"
    order: ClassVar[int] = 1
    volume_tol: ClassVar[float | None] = None
    capabilities: ClassVar[Capabilities] = Capabilities("whole", "limited", thin_probes=True)

    def __post_init__(self) -> None:
        for name in ("alpha", "beta"):
            value = getattr(self, name)
            if not 0.0 < value < float("inf"):
                raise MassSpringError(f"baumgarte's {name} is {value} (times dt); it must be positive and finite")

    @property
    def stable(self) -> bool:
        """Whether a volume error decays: (beta dt)² + 4 alpha dt < 4 and 2 alpha dt < 2 (eq. 10.6)."""
        return self.beta**2 + 4.0 * self.alpha < 4.0 and 2.0 * self.alpha < 2.0

    def advance(self, state: State, boundary: BoundaryConditions) -> State:
        return advance_by(Rule(self.beta * self.beta, 2.0 * self.alpha, True), state, boundary)
