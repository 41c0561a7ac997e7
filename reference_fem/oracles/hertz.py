"""The first touch of a ball between two planes: Hertz's force is the limit of a vanishing approach."""

from reference_fem import exact
from reference_fem.oracles.ball import squeeze, whole_force
from reference_fem.oracles.base import Check, Oracle, Outcome, unknowns
from reference_fem.oracles.bodies import ball_octant

SHARES = (0.01, 0.02)
"""Approaches over the diameter. Finite strain adds a term that is about linear in the approach (3 % at 0.01, 5 % at
0.02)."""
CELLS, GRADE, RADIAL = 10, 0.1, 0.8
"""Elements at the pole are a hundredth of the radius: eight or more per contact radius of 0.1."""


def measure() -> Outcome:
    """Force over that of Hertz at two approaches, extrapolated linearly to approach 0."""
    mesh = ball_octant(CELLS, GRADE, RADIAL)
    problem, path = squeeze(mesh, SHARES)
    ratios = [whole_force(state) / exact.hertz_plane_force(1.0, 1.0, state.t) for state in path]
    limit = ratios[0] - (ratios[1] - ratios[0]) * SHARES[0] / (SHARES[1] - SHARES[0])
    mesh_name = f"octant, {mesh.nelements} elements, graded to the pole"
    check = Check("force over Hertz's, d -> 0", "1", 1.0, limit, 0.02, mesh_name, unknowns(problem))
    return Outcome((check,))


ORACLE = Oracle("hertz", "First touch of a ball between planes", "Hertz 1881, E* = 4 mu", measure, fast=False)
