"""Oracles: problems with independent solutions, such as closed forms, published numbers, other codes
(docs/theory.md)."""

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
ORACLES: tuple[Oracle, ...] = tuple(module.ORACLE for module in MODULES)
"""All oracles. Every change must pass those that are `fast`, about half of them."""

__all__ = ["ORACLES", "Check", "Curve", "Oracle", "Outcome"]
