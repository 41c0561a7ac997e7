"""Checks that raise SolveError, with a message of one sentence, for problems that cannot be solved."""

import numpy as np
from numpy.typing import ArrayLike
from skfem import MeshTet, MeshTet2

from reference_fem.elements.shapes import check_neighbours, facet_nodes, nodes
from reference_fem.elements.surface import Surface, point_positions
from reference_fem.errors import SolveError
from reference_fem.model.obstacles import gaps
from reference_fem.model.problem import Problem

START_DEPTH = 1e-3
"""Depth at the start that still counts as touching, over the size of the body: the deviation of a coarse facet from a
curved surface."""


def check_mesh(mesh: MeshTet):
    """Refuse non-finite points, vertices that no element uses, and elements turned inside out."""
    x = mesh.doflocs.T
    bad = np.flatnonzero(~np.isfinite(x).all(axis=1))
    if bad.size:
        raise SolveError(f"node {bad[0]} of the mesh is at {x[bad[0]]}: all coordinates must be finite [m]")
    # all points of a straight mesh are vertices, including those after the last one in use
    count = mesh.nvertices if isinstance(mesh, MeshTet2) else len(x)
    unused = np.setdiff1d(np.arange(count), mesh.t)
    if unused.size:
        raise SolveError(
            f"vertex {unused[0]} belongs to no tetrahedron ({unused.size} such vertices): remove unused vertices"
        )
    check_neighbours(mesh)


def check_loads(problem: Problem):
    """Refuse non-finite gravity, negative or missing density."""
    gravity = np.asarray(problem.gravity, dtype=float)
    if gravity.shape != (3,) or not np.isfinite(gravity).all():
        raise SolveError(f"gravity is {problem.gravity!r}: three finite numbers [m/s²] are needed")
    if not (np.isfinite(problem.density) and problem.density >= 0.0):
        raise SolveError(f"the density is {problem.density} kg/m³: it must be zero or positive and finite")
    if gravity.any() and problem.density == 0.0:
        raise SolveError("gravity acts but the density is 0 kg/m³: give the density, or no gravity")
    count = len(nodes(problem.mesh))
    for hung in problem.masses:
        if not (np.isfinite(hung.mass) and hung.mass > 0.0 and 0 <= hung.node < count):
            raise SolveError(
                f"a mass of {hung.mass} kg hangs at node {hung.node}: give a positive mass, and a node from 0 to "
                f"{count - 1}"
            )
    for name in ("order", "contact_order"):
        given = getattr(problem, name)
        if given < 4:
            raise SolveError(f"the quadrature {name} is {given}: 4 is the least that integrates p J exactly")


def check_inertia(problem: Problem):
    """Raises SolveError for a body without mass."""
    if problem.density == 0.0:
        raise SolveError("the density is 0 kg/m³: a body that moves needs its mass, give the density")


def rigid_motions(x: np.ndarray):
    """Six rigid velocities of nodes x (n, 3) about their centre, scaled to unit size: (n, 3, 6)."""
    arm = x - x.mean(axis=0)
    arm = arm / np.linalg.norm(arm, axis=1).max()
    turns = np.stack([np.cross(axis, arm) for axis in np.eye(3)], axis=2)
    return np.concatenate((np.broadcast_to(np.eye(3), (len(x), 3, 3)), turns), axis=2)


def null_space(matrix: np.ndarray):
    """Orthonormal columns that the matrix sends to zero (relative singular value below 1e-6)."""
    _, s, vt = np.linalg.svd(matrix, full_matrices=True)
    rank = int(np.sum(s > 1e-6 * np.sqrt(len(matrix))))
    return vt[rank:].T


def rigid_freedoms(x: np.ndarray, held_dofs: np.ndarray):
    """Rigid motions that the held unknowns leave free, in the columns of rigid_motions, (6, 0 to 6)."""
    return null_space(held_rigid_motions(x, held_dofs))


def held_rigid_motions(x: np.ndarray, held_dofs: np.ndarray):
    """The six rigid motions at the held unknowns, padded with zeros to at least six rows."""
    return np.vstack((rigid_motions(x).reshape(-1, 6)[held_dofs], np.zeros((6, 6))))


def check_held(x: np.ndarray, held_dofs: np.ndarray):
    """Refuse a body that can still move rigidly, naming the motion. x: (N2, 3); held_dofs: unknown numbers."""
    seen = held_rigid_motions(x, held_dofs)
    slides = null_space(seen[:, :3])
    names = [f"slide along {direction(v)}" for v in slides.T]
    fixed = np.vstack((seen, np.hstack((slides.T, np.zeros((slides.shape[1], 3)))) * 10.0))
    names += [f"turn about {direction(v[3:])}" for v in null_space(fixed).T]
    if names:
        raise SolveError(
            f"the body is free to {' and '.join(names)}: hold a patch of it or use symmetry planes "
            f"(contact holds nothing before it is made, and a lumen never does)"
        )


def direction(v: np.ndarray):
    """Text for a unit vector, with positive leading sign."""
    v = v / np.linalg.norm(v)
    v = v * np.sign(v[np.argmax(np.abs(v))])
    return "(" + ", ".join(f"{c + 0.0:.2g}" if abs(c) > 1e-6 else "0" for c in v) + ")"


def check_start(surface: Surface, rows: np.ndarray, size: float):
    """Refuse an obstacle that starts deeper than START_DEPTH of the body's size in the undeformed body."""
    y = point_positions(np.zeros(len(surface.rest)), surface)
    for k, row in enumerate(rows):
        depth = -float(gaps(row, y).min())
        if depth > START_DEPTH * size:
            raise SolveError(
                f"obstacle {k} starts {depth:.3g} m inside the body (limit {START_DEPTH * size:.3g} m): "
                f"move it back, or turn its normal towards the body"
            )


def check_times(times: ArrayLike, start: float):
    """Times as an array; refuse an empty, non-finite or non-increasing list, and times before the start."""
    times = np.atleast_1d(np.asarray(times, dtype=float))
    if times.size == 0 or not np.isfinite(times).all():
        raise SolveError(f"the times are {times}: give at least one finite time [s]")
    if np.any(np.diff(times) <= 0.0) or times[0] < start:
        raise SolveError(f"the times {times} s must increase and not lie before the start, {start:g} s")
    return times


def boundary_size(mesh: MeshTet):
    """Diagonal of the box around the body [m]."""
    x = nodes(mesh)[np.unique(facet_nodes(mesh))]
    return float(np.linalg.norm(np.ptp(x, axis=0)))
