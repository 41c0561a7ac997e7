"""Oracles: problems with independent solutions, such as closed forms, published numbers, other codes
(docs/theory.md)."""

from reference_fem.oracles import ball, cook, cylinder, kappa, manufactured, ringing, thick_sphere, uniaxial
from reference_fem.oracles.base import Check, Curve, Oracle, Outcome

MODULES = (uniaxial, thick_sphere, cylinder, cook, ringing, kappa, manufactured, ball)
ORACLES: tuple[Oracle, ...] = (uniaxial.PATCH_ORACLE, *(module.ORACLE for module in MODULES), ball.TOUCH_ORACLE)
"""All oracles. Every change must pass those that are `fast`, about half of them."""

__all__ = ["ORACLES", "Check", "Curve", "Oracle", "Outcome"]
