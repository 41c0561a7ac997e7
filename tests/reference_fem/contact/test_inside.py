"""The middle of a sphere or capsule that has slipped through the surface is seen, and the path says so."""

import numpy as np
import pytest
from skfem import MeshTet

from reference_fem import (
    NeoHookean,
    NewtonSettings,
    PrescribedDisplacement,
    Problem,
    RigidCapsule,
    RigidPlane,
    RigidSphere,
    SolveError,
    equilibrium_path,
)
from reference_fem.system.saddle_point import System
from tests.reference_fem.bodies import whole_ball

LOW = PrescribedDisplacement(lambda x: x[2] < -0.8)


def boxes(edge: float = 1.0) -> MeshTet:
    """A cube round the origin with a cubic hole of a third of its edge."""
    at = edge * np.array([-0.5, -1.0 / 6.0, 1.0 / 6.0, 0.5])
    mesh = MeshTet.init_tensor(at, at, at)
    middle = mesh.p[:, mesh.t].mean(axis=1)
    return mesh.restrict(np.flatnonzero(np.abs(middle).max(axis=0) > edge / 6.0))


def first_inside(mesh, obstacle, shift):
    held = PrescribedDisplacement(lambda x: x[2] < x[2].min() + 1e-6)
    system = System(Problem(mesh, NeoHookean(1.0, 1000.0), [held], [obstacle]), NewtonSettings())
    rows = system.obstacles_at(0.0)
    rows[:, 1:4] += shift
    return system.inside.first(rows, np.zeros(system.total))


@pytest.mark.parametrize(
    ("obstacle", "shift", "seen"),
    [
        (RigidSphere((0.0, 0.0, 0.7), 0.1), (0.0, 0.0, 0.0), None),
        (RigidSphere((0.0, 0.0, 0.7), 0.1), (0.03, 0.02, -0.25), 0),  # in the wall
        (RigidSphere((0.0, 0.0, 0.7), 0.1), (0.03, 0.02, -0.65), 0),  # in the hole, through the wall
        (RigidSphere((0.0, 0.0, 0.7), 0.1), (0.03, 0.02, -1.5), None),  # beyond
        (RigidSphere((0.0, 0.0, 0.0), 0.05), (0.03, 0.02, 0.25), None),  # it starts in the hole
        (RigidCapsule((-0.1, 0.0, 0.7), (1.0, 0.0, 0.7), 0.1), (0.0, 0.02, -0.25), 0),
        (RigidCapsule((0.6, 0.0, 0.7), (1.6, 0.0, 0.7), 0.05), (0.0, 0.02, -0.25), None),
        (RigidPlane((0.0, 0.0, 0.6), (0.0, 0.0, -1.0)), (0.0, 0.0, -0.4), None),
    ],
)
def test_what_surrounds_the_middle_of_an_obstacle_is_seen(obstacle, shift, seen):
    assert first_inside(boxes(), obstacle, shift) == seen


def test_a_sphere_that_slips_between_the_points_of_large_facets_has_no_equilibrium():
    """It is kept out of the points of contact alone, and would be pushed on once it has passed them."""
    probe = RigidSphere((0.0, 0.0, 1.05), 0.04, lambda t: (0.0, 0.0, -0.5 * t))
    with pytest.raises(SolveError, match="obstacle 0 slips through the surface, whose facets may be too large"):
        equilibrium_path(Problem(whole_ball(2), NeoHookean(1.0, 1000.0), [LOW], [probe]), [0.5, 1.0])
