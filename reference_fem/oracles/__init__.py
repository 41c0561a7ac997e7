"""Problems whose answers are known from elsewhere: closed forms, published numbers, other codes (docs/theory.md)."""

from reference_fem.oracles import (
    ball,
    cook,
    cylinder,
    hertz,
    kappa,
    manufactured,
    patch,
    ringing,
    thick_sphere,
    uniaxial,
)
from reference_fem.oracles.base import Check, Curve, Oracle, Outcome

ORACLES: tuple[Oracle, ...] = tuple(
    module.ORACLE
    for module in (uniaxial, patch, thick_sphere, cylinder, cook, ringing, kappa, manufactured, ball, hertz)
)

__all__ = ["ORACLES", "Check", "Curve", "Oracle", "Outcome"]
