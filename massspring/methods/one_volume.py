"""Variants of implicit constraint enforcement that keep one volume by other rules (docs/theory.md, section 10)."""

from dataclasses import dataclass
from typing import ClassVar

from massspring.errors import MassSpringError
from massspring.kernels.arrays.layout import BoundaryConditions
from massspring.layout.state import State
from massspring.methods.capabilities import Capabilities, No
from massspring.methods.families.one_volume import Rule, advance_by
from massspring.methods.method import Method


@dataclass(frozen=True)
class Shake(Method):
    """Pushes along the old volume gradient exactly so far that the step ends at V0.

    Ryckaert, Ciccotti, Berendsen, Journal of Computational Physics 23 (1977), for bond lengths; here the constraint is
    a cubic along the line, so its root has a closed form and needs no iteration (docs/theory.md, eq. 10.1, 10.2). HCJ05
    is one Newton step of it.
    """

    name: ClassVar[str] = "shake"
    order: ClassVar[int] = 1
    volume_tol: ClassVar[float | None] = 1e-12
    capabilities: ClassVar[Capabilities] = Capabilities("whole", "full", thin_probes=True)

    def advance(self, state: State, boundary: BoundaryConditions) -> State:
        return advance_by(Rule(exact=True), state, boundary)


@dataclass(frozen=True)
class Projection(Method):
    """Projects each predicted shape onto the right volume, along that shape's own gradient.

    Promayon, Baconnier, Puech, Computer Graphics Forum 15 (1996) and CVRMed-MRCAS (1997; "PBP97"): move all nodes along
    the volume gradient of the *predicted* shape until the volume is right; velocities follow. The step length is the
    root of the cubic (docs/theory.md, eq. 10.1–10.3).

    Limits: the pressure acts along a gradient that is a step ahead of the positions, so that under sustained pressure
    and without damping the body gains energy at the rate of eq. 10.4, and angular momentum if it turns. HCJ05 and SHAKE
    gain neither.
    """

    name: ClassVar[str] = "projection"
    order: ClassVar[int] = 1
    volume_tol: ClassVar[float | None] = 1e-12
    conserves_angular_momentum: ClassVar[bool] = False
    capabilities: ClassVar[Capabilities] = Capabilities("whole", "full", thin_probes=True)

    def advance(self, state: State, boundary: BoundaryConditions) -> State:
        return advance_by(Rule(exact=True, at_prediction=True), state, boundary)


@dataclass(frozen=True)
class PostStabilization(Method):
    """Keeps the volume's rate by a pressure, and the volume itself by moving nodes afterwards.

    Cline and Pai, IEEE International Conference on Robotics and Automation (2003). First dV/dt = 0 at the end of the
    step, then x += W̃ G (V0 − V)/(G·W̃·G) at the new positions, velocities untouched (docs/theory.md, eq. 10.5, 10.7).

    Limits: the correction ignores the dynamics. It moves nodes without a change of velocity, which excites the springs
    slightly and does not conserve angular momentum exactly. Only the positions follow a moving target.
    """

    name: ClassVar[str] = "post_stabilization"
    order: ClassVar[int] = 1
    volume_tol: ClassVar[float | None] = 1e-4
    conserves_angular_momentum: ClassVar[bool] = False
    capabilities: ClassVar[Capabilities] = Capabilities(
        "whole",
        "limited",
        thin_probes=No("it moves nodes once more after the step, where no probe is looked for"),
    )

    def advance(self, state: State, boundary: BoundaryConditions) -> State:
        return advance_by(Rule(pull=0.0, stabilised=True), state, boundary)


@dataclass(frozen=True)
class Baumgarte(Method):
    """Lets a wrong volume die away like a damped oscillation, at rates per time step.

    Baumgarte, Computer Methods in Applied Mechanics and Engineering 1 (1972): instead of d²V/dt² = 0, which drifts, ask
    for d²(V − V0)/dt² + 2 alpha d(V − V0)/dt + beta² (V − V0) = 0 (docs/theory.md, eq. 10.5).

    Limits: stable for (beta dt)² + 4 alpha dt < 4 and 0 < 2 alpha dt < 2. Correcting a volume error takes time: the
    larger root of eq. 10.6 is the share of it that a step leaves. 2 alpha = beta = 1/dt is HCJ05 with the convective
    term.
    """

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
