"""Problems whose answers are known from elsewhere: closed forms, published numbers, other codes (docs/theory.md)."""

from reference_fem.oracles import patch, uniaxial
from reference_fem.oracles.base import Check, Curve, Oracle, Outcome

ORACLES: tuple[Oracle, ...] = (uniaxial.ORACLE, patch.ORACLE)

__all__ = ["ORACLES", "Check", "Curve", "Oracle", "Outcome"]
