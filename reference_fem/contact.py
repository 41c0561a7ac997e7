"""Frictionless contact with rigid planes and spheres at the quadrature points of the boundary.

Augmented Lagrangian (Alart & Curnier 1991; Wriggers, Computational Contact Mechanics, 2006, ch. 6): the nominal
pressure is t = max(0, m - eps g), m the multiplier [Pa], g the gap [m], eps the penalty [Pa/m], and the potential
sum w (t² - m²) / (2 eps). Never at the vertices of a six-node facet: an even pressure loads them with zero.

Order 4 has as many points to a facet as nodes. More points ask for more than the nodes can give where a facet is
partly in contact: active points flicker and Newton needs longer (order 8: half as many iterations again). Three
averages to a facet need fewer, but let points sink ten times deeper than the thousandth that is allowed.
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numba import njit

from reference_fem.errors import ReferenceProblem

PLANE, SPHERE = 0, 1


def finite_vector(value, name):
    vector = np.asarray(value, dtype=float)
    if vector.shape != (3,) or not np.isfinite(vector).all():
        raise ReferenceProblem(f"{name} is {value!r}: three finite numbers are needed")
    return vector


@dataclass(frozen=True)
class RigidPlane:
    """The body stays in normal·(x - point - motion(t)) >= 0. motion: t [s] -> displacement (3,) [m], None = rests."""

    point: tuple
    normal: tuple
    motion: Callable | None = None

    def row(self):
        """(kind, point, unit normal, radius) for the kernel."""
        normal = finite_vector(self.normal, "a plane's normal")
        size = np.linalg.norm(normal)
        if size == 0.0:
            raise ReferenceProblem("a plane's normal is (0, 0, 0): give a direction that points to the body's side")
        return np.array([PLANE, *finite_vector(self.point, "a plane's point"), *normal / size, 0.0])


@dataclass(frozen=True)
class RigidSphere:
    """The body stays outside |x - center - motion(t)| >= radius [m]. motion: t [s] -> (3,) [m], None = rests."""

    center: tuple
    radius: float
    motion: Callable | None = None

    def row(self):
        """(kind, centre, unused, radius) for the kernel."""
        if not (np.isfinite(self.radius) and self.radius > 0.0):
            raise ReferenceProblem(f"a sphere's radius is {self.radius} m: it must be positive and finite")
        return np.array([SPHERE, *finite_vector(self.center, "a sphere's center"), 0.0, 0.0, 0.0, self.radius])


class Surface(NamedTuple):
    """What the contact kernel reads of the boundary: nf facets, nq points each."""

    dofs: np.ndarray
    """Unknowns of the six nodes (three, for linear elements), u_x first, then u_y, u_z, (nf, 18) uint32."""
    positions: np.ndarray
    """Slots of the packed upper triangle of 18 x 18, (nf, 171) uint32."""
    rest: np.ndarray
    """Rest coordinates, interleaved like the unknowns, (3 N2,) [m]."""
    values: np.ndarray
    """Six functions at the points, (nq, 6)."""
    weights: np.ndarray
    """Rest areas, (nf, nq) [m²]."""
    penalty: np.ndarray
    """Basic eps of each facet, (nf,) [Pa/m]."""


class Touch(NamedTuple):
    """State of all contacts: no obstacles."""

    rows: np.ndarray
    """Obstacles where they are now, (no, 8)."""
    shift: np.ndarray
    """Further move to linearise, (no, 3) [m]; zero except in a predictor."""
    multiplier: np.ndarray
    """m at every point, (no, nf, nq) [Pa]."""
    penalty: np.ndarray
    """eps of each facet, (nf,) [Pa/m]."""
    pressure: np.ndarray
    """t at every point, overwritten, (no, nf, nq) [Pa]."""
    force: np.ndarray
    """Resultant on the body, overwritten, (no, 3) [N]."""


def touch(rows, shift, multiplier, penalty) -> Touch:
    """A Touch with room for its results."""
    return Touch(rows, shift, multiplier, penalty, np.zeros_like(multiplier), np.zeros((len(rows), 3)))


def place(rows, obstacles, t):
    """Rows of the obstacles moved to time t; raises ReferenceProblem when a motion is not finite."""
    moved = rows.copy()
    for k, obstacle in enumerate(obstacles):
        if obstacle.motion is not None:
            moved[k, 1:4] += finite_vector(obstacle.motion(t), f"the motion of obstacle {k} at t = {t:g} s")
    return moved


@njit(cache=True)
def gap_into(row, y, n):
    """Gap g [m] between point y and an obstacle, unit normal n towards the body, curvature of g [1/m]."""
    g = 0.0
    if row[0] == PLANE:
        for i in range(3):
            n[i] = row[4 + i]
            g += n[i] * (y[i] - row[1 + i])
        return g, 0.0
    for i in range(3):
        n[i] = y[i] - row[1 + i]
        g += n[i] * n[i]
    r = np.sqrt(g)
    for i in range(3):
        n[i] /= r
    return r - row[7], 1.0 / r


@njit(cache=True)
def add_contact(x, surface, touch, values, residual, tangent):
    """residual -= w t n N and, if tangent, values += w (eps n⊗n - t curvature (1 - n⊗n)) N N; fills touch."""
    dofs, positions, rest, shapes, weights, _ = surface
    rows, shift, multiplier, penalty, pressure, force = touch
    y, n, k = np.empty(3), np.empty(3), np.empty((3, 3))
    count = shapes.shape[1]
    K = np.empty((3 * count, 3 * count))
    force[:] = 0.0
    for o in range(rows.shape[0]):
        for f in range(dofs.shape[0]):
            touched = False
            for q in range(weights.shape[1]):
                for i in range(3):
                    y[i] = 0.0
                    for a in range(count):
                        dof = dofs[f, count * i + a]
                        y[i] += shapes[q, a] * (rest[dof] + x[dof])
                g, curvature = gap_into(rows[o], y, n)
                t = max(0.0, multiplier[o, f, q] - penalty[f] * g)
                pressure[o, f, q] = t
                if t == 0.0:
                    continue
                if tangent and not touched:
                    K[:] = 0.0
                touched = True
                w = weights[f, q]
                for i in range(3):
                    for j in range(3):
                        k[i, j] = w * (penalty[f] + t * curvature) * n[i] * n[j]
                    k[i, i] -= w * t * curvature
                for i in range(3):
                    push = w * t * n[i]
                    force[o, i] += push
                    for j in range(3):
                        push += k[i, j] * shift[o, j]
                    for a in range(count):
                        residual[dofs[f, count * i + a]] -= push * shapes[q, a]
                if tangent:
                    add_point_stiffness(shapes[q], k, K)
            if tangent and touched:
                scatter(K, positions[f], values)


@njit(cache=True)
def add_point_stiffness(N, k, K):
    """K[ia, jb] += k_ij N_a N_b."""
    count = len(N)
    for i in range(3):
        for a in range(count):
            for j in range(3):
                for b in range(count):
                    K[count * i + a, count * j + b] += k[i, j] * N[a] * N[b]


@njit(cache=True)
def scatter(K, positions, values):
    """values[positions] += packed upper triangle of K."""
    slot = 0
    for a in range(K.shape[0]):
        for b in range(a, K.shape[0]):
            values[positions[slot]] += K[a, b]
            slot += 1


def potential(x, surface: Surface, touch: Touch):
    """sum w (t² - m²) / (2 eps) [J] in plain NumPy, apart from the kernel, to check it."""
    moved = (surface.rest + x[: len(surface.rest)])[surface.dofs].reshape(len(surface.dofs), 3, -1)
    y = np.einsum("qa,fia->fqi", surface.values, moved)
    total, eps = 0.0, touch.penalty[:, None]
    for row, m in zip(touch.rows, touch.multiplier, strict=True):
        g = (y - row[1:4]) @ row[4:7] if row[0] == PLANE else np.linalg.norm(y - row[1:4], axis=2) - row[7]
        t = np.maximum(0.0, m - eps * g)
        total += np.sum(surface.weights * (t**2 - m**2) / (2.0 * eps))
    return float(total)


def penetration(touch: Touch):
    """Deepest point inside an obstacle [m], from t = m - eps g where t > 0."""
    depth = (touch.pressure - touch.multiplier) / touch.penalty[:, None]
    return float(np.max(depth, initial=0.0, where=touch.pressure > 0.0))


def misplacement(touch: Touch):
    """Farthest from the surface of its obstacle, on either side, that a point feels a contact pressure [m].

    Too deep, or on its way out and still pushed by a multiplier from before.
    """
    off = np.abs(touch.pressure - touch.multiplier) / touch.penalty[:, None]
    return float(np.max(off, initial=0.0, where=touch.pressure > 0.0))
