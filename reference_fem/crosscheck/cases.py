"""Three problems that both codes solve on the same mesh with the same quadrature points."""

from collections.abc import Callable, Sequence

import numpy as np
from scipy.spatial import KDTree
from skfem import MeshTet

from reference_fem.elements.shapes import facet_nodes, nodes
from reference_fem.errors import SolveError
from reference_fem.model.material import NeoHookean
from reference_fem.model.problem import PrescribedDisplacement, Problem
from reference_fem.oracles.bodies import shell_octant, symmetry, whole_ball

STEPS = (0.25, 0.5, 0.75, 1.0)
"""Times of the loading path; all motions end at 1."""


def straight(mesh: MeshTet) -> MeshTet:
    """The vertices of a curved mesh, joined by straight edges: NGSolve curves elements differently."""
    return MeshTet(np.ascontiguousarray(mesh.doflocs[:, : mesh.nvertices]), mesh.t)


def facets_where(mesh: MeshTet, inside: Callable) -> Callable:
    """A function for `where` that selects the boundary facets all of whose vertices are `inside`: (3, n) points -> bool
    (n,)."""
    table, x = facet_nodes(mesh), nodes(mesh)
    whole = np.asarray(inside(x.T), dtype=bool)[table[:, :3]].all(axis=1)
    if not whole.any():
        raise SolveError("a patch contains no whole boundary facet: choose a larger one, or a finer mesh")
    tree = KDTree(x[np.unique(table[whole])])
    # far above round-off, far below an edge
    return lambda points: tree.query(points.T)[0] < 1e-9 * float(np.ptp(x))


def clamped_ball(n: int = 4) -> Problem:
    """A ball between clamped caps (those beyond 0.8 of the radius), one of which is pushed in by 0.3 of the radius and
    sideways."""
    mesh = straight(whole_ball(n))
    top, bottom = (facets_where(mesh, lambda x, sign=sign: sign * x[2] > 0.8) for sign in (1.0, -1.0))
    push = PrescribedDisplacement(top, motion=lambda t: (0.1 * t, 0.0, -0.3 * t))
    return Problem(mesh, NeoHookean(1.0, 500.0), [push, PrescribedDisplacement(bottom)])


def thick_sphere(n: int = 6, layers: int = 4) -> Problem:
    """An eighth of a shell, 0.5 to 1 of the radius, whose inner surface is blown up by 0.3 of its radius."""
    mesh = straight(shell_octant(0.5, n, layers))
    wall = facets_where(mesh, lambda x: np.abs(np.linalg.norm(x, axis=0) - 0.5) < 1e-9)
    blow = PrescribedDisplacement(wall, motion=lambda t: (0.15 * t,) * 3, shape=lambda x: x / np.linalg.norm(x, axis=0))
    return Problem(mesh, NeoHookean(1.0, 5000.0), [blow, *symmetry()])


def pulled_organ(mesh: MeshTet, attached: np.ndarray, grip: np.ndarray, move: np.ndarray | Sequence[float]) -> Problem:
    """An organ of mu = 1.8 kPa, attached at some vertices and gripped at others (numbers); move: (3,) [m]."""
    if len(np.intersect1d(attached, grip)):
        raise SolveError("the attached and the gripped patch share vertices: take patches that lie apart")

    def patch(numbers: np.ndarray):
        return facets_where(mesh, lambda x: np.isin(np.arange(x.shape[1]), numbers))

    pull = PrescribedDisplacement(patch(grip), motion=lambda t: tuple(t * np.asarray(move, dtype=float)))
    return Problem(mesh, NeoHookean(1800.0, 1800.0 * 5000.0), [pull, PrescribedDisplacement(patch(attached))])
