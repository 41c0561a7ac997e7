"""Oracles that another code answers, NGSolve on the same mesh with the same quadrature points."""

from collections.abc import Callable, Sequence
from importlib.metadata import version

import numpy as np
from scipy.spatial import KDTree
from skfem import MeshTet

from massspring import Sphere
from reference_fem import (
    NeoHookean,
    NewtonSettings,
    PrescribedDisplacement,
    Problem,
    SolveError,
    equilibrium_path,
    facet_nodes,
    nodes,
)
from reference_fem.oracles import Check, Oracle, Outcome
from reference_fem.oracles.base import unknowns
from reference_fem.oracles.bodies import shell_octant, straight, symmetry, whole_ball
from studies import LIVER_PROBE, organ
from studies.lab.verify.ngsolve_code import available, solve

STEPS = (0.25, 0.5, 0.75, 1.0)
"""Times of the loading path; all motions end at 1."""
CLOSE = NewtonSettings(force_tol=1e-10, volume_tol=1e-12)
"""Tight tolerances, so that differences are due to the codes and not to where their iterations stop."""
AGREEMENT = 1e-8
"""Two codes with the same quadrature points solve the same equations: they differ only by Newton's tolerance, 1e-9, and
round-off. Other points would change the force by 4e-6 to 6e-3."""
REACH, PULL = 0.03, 0.02
"""Radius of the gripped patch, and how far it moves [m]."""
GAP = 5e-4
"""Between the probe of liver_probe and the liver at rest [m]."""


def second_opinions() -> tuple[Oracle, ...]:
    """Ball with clamped caps, thick sphere, liver and a ball that is cut, solved by NGSolve too; empty without it."""
    if not available():
        return ()
    return (
        oracle("second_ball", "ball with clamped caps, second code", clamped_ball),
        oracle("second_sphere", "thick sphere, second code", thick_sphere),
        oracle("second_organ", "organ pulled by a patch, second code", pulled_liver),
        oracle("second_cut", "ball that is cut open, second code", incised_ball),
    )


def oracle(name: str, title: str, build: Callable[[], Problem]) -> Oracle:
    """An oracle that solves the problem in both codes when it is measured."""
    source = f"NGSolve {version('ngsolve')}, same mesh, same quadrature points"
    return Oracle(name, title, source, lambda: Outcome(opinion(build(), title)), fast=False)


def opinion(problem: Problem, what: str) -> tuple[Check, ...]:
    """Force of the first held region, displacement and pressure of both codes at the end of STEPS."""
    ours, theirs = equilibrium_path(problem, STEPS, CLOSE)[-1], solve(problem, STEPS)
    place = f"{what}, {problem.mesh.nelements:,} straight elements, order {problem.order} in both"
    count = unknowns(problem)
    force, our_force = (float(np.linalg.norm(solution.held_force[0])) for solution in (theirs, ours))
    size, our_size = (float(np.sqrt(np.mean(solution.u**2))) for solution in (theirs, ours))
    apart = float(np.abs(theirs.u - ours.u).max() / np.abs(theirs.u).max())
    pressure = float(np.abs(theirs.p - ours.p).max() / np.abs(theirs.p).max())
    return (
        Check("force", "N", force, our_force, AGREEMENT, place, count),
        Check("rms displacement", "m", size, our_size, AGREEMENT, place, count),
        Check("largest difference of displacements over the largest", "1", 0.0, apart, AGREEMENT, place, count, True),
        Check("largest difference of pressures over the largest", "1", 0.0, pressure, AGREEMENT, place, count, True),
    )


def facets_where(mesh: MeshTet, inside: Callable) -> Callable:
    """A function for `where` that selects the boundary facets all of whose vertices are `inside`: (3, n) points -> bool
    (n,). Half a facet would hold a mid-side node beside a free vertex, which NGSolve's edge functions cannot."""
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
    return between_caps(straight(whole_ball(n)), (0.1, 0.0, -0.3))


def incised_ball(n: int = 4) -> Problem:
    """The same cut half open, its caps pulled apart: elements above the cut get nodes of their own behind its front."""
    mesh = straight(whole_ball(n))
    inside = (np.abs(mesh.p[2]) < 1e-9) & (mesh.p[0] < -1e-9)
    copies = np.arange(mesh.nvertices)
    copies[inside] = mesh.nvertices + np.arange(inside.sum())
    above = mesh.p[2, mesh.t].mean(axis=0) > 0
    corners = np.where(above, copies[mesh.t], mesh.t)
    return between_caps(MeshTet(np.hstack((mesh.p, mesh.p[:, inside])), corners), (0.0, 0.0, 0.2))


def between_caps(mesh: MeshTet, move: Sequence[float]) -> Problem:
    """A ball whose upper cap moves (3,) [R]."""
    top, bottom = (facets_where(mesh, lambda x, sign=sign: sign * x[2] > 0.8) for sign in (1.0, -1.0))
    push = PrescribedDisplacement(top, motion=lambda t: tuple(t * np.asarray(move)))
    return Problem(mesh, NeoHookean(1.0, 500.0), [push, PrescribedDisplacement(bottom)])


def thick_sphere(n: int = 6, layers: int = 4) -> Problem:
    """An eighth of a shell, 0.5 to 1 of the radius, whose inner surface is blown up by 0.3 of its radius."""
    mesh = straight(shell_octant(0.5, n, layers))
    wall = facets_where(mesh, lambda x: np.abs(np.linalg.norm(x, axis=0) - 0.5) < 1e-9)
    blow = PrescribedDisplacement(wall, motion=lambda t: (0.15 * t,) * 3, shape=lambda x: x / np.linalg.norm(x, axis=0))
    return Problem(mesh, NeoHookean(1.0, 5000.0), [blow, *symmetry()])


def pulled_liver() -> Problem:
    """The liver on its bare area, a patch about the place where liver_probe touches it pulled outward."""
    mesh, (probe,) = organ("liver", 300), LIVER_PROBE.obstacles
    assert isinstance(probe, Sphere)
    normal = -np.asarray(probe.path.displacements[-1]) / np.linalg.norm(probe.path.displacements[-1])
    place = np.asarray(probe.centre) - (probe.radius + GAP) * normal
    grip = np.flatnonzero(np.linalg.norm(mesh.points[: mesh.surface_count] - place, axis=1) < REACH)
    attached = np.unique(np.concatenate(list(mesh.patches.values())))
    tissue = MeshTet(np.ascontiguousarray(mesh.points.T), np.ascontiguousarray(mesh.tetrahedra.T))

    def patch(numbers: np.ndarray):
        return facets_where(tissue, lambda x: np.isin(np.arange(x.shape[1]), numbers))

    pull = PrescribedDisplacement(patch(grip), motion=lambda t: tuple(t * PULL * normal))
    return Problem(tissue, NeoHookean(1800.0, 1800.0 * 5000.0), [pull, PrescribedDisplacement(patch(attached))])
