"""Independent solutions by NGSolve. They need the extra `crosscheck`; no other part of the project does."""

from reference_fem.crosscheck.cases import clamped_ball, pulled_organ, thick_sphere
from reference_fem.crosscheck.ngsolve_code import NgsolveSolution, available, solve
from reference_fem.crosscheck.opinions import opinions

__all__ = ["NgsolveSolution", "available", "clamped_ball", "opinions", "pulled_organ", "solve", "thick_sphere"]
