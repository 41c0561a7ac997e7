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

MODULES = (uniaxial, patch, thick_sphere, cylinder, cook, ringing, kappa, manufactured, ball, hertz)
ORACLES: tuple[Oracle, ...] = (*(module.ORACLE for module in MODULES), manufactured.OTHERS)
"""The pack; those that are `fast` are the half that every change must pass."""

__all__ = ["ORACLES", "Check", "Curve", "Oracle", "Outcome"]
