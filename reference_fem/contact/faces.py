"""Contact between the two faces of a cut, frictionless, at quadrature points (docs/theory.md, section 6).

Both faces have the same triangulation, so that a point is given by its place in a facet and in the copy of this facet.
With y- behind the cut, y+ in front of it and n the normal of the surface half-way between the faces, the gap is g =
n·(y+ - y-), and the pressure t = max(0, m - eps g) as for obstacles. n depends on both faces: the potential sum w (t² -
m²) / (2 eps) is exact, so forces and moments of the two sides cancel, and the tangent is its second derivative.
"""

from typing import NamedTuple

import numpy as np
from scipy.spatial import KDTree

from reference_fem.compiled import compiled
from reference_fem.elements.shapes import Facets
from reference_fem.elements.surface import scatter
from reference_fem.errors import SolveError

SAME_POINT = 1e-9
"""Fraction of the size of the body below which two nodes coincide at rest: far above round-off, far below an edge."""


class Faces(NamedTuple):
    """Tables of the faces of a cut for the kernel: nf pairs of facets, nq points each."""

    dofs: np.ndarray
    """Unknowns of the nodes behind the cut (u_x first, then u_y, u_z), then of those in front, (nf, 36) uint32."""
    positions: np.ndarray
    """Slots of the packed upper triangle of 36 x 36, (nf, 666) uint32."""
    rest: np.ndarray
    """Rest coordinates, interleaved like the unknowns, (3 N2,) [m]."""
    values: np.ndarray
    """Functions at the points, (nq, 6)."""
    slopes: np.ndarray
    """Their two derivatives, (nq, 2, 6)."""
    weights: np.ndarray
    """Rest areas, (nf, nq) [m²]."""
    penalty: np.ndarray
    """Basic eps of each pair, (nf,) [Pa/m]."""


class FaceTouch(NamedTuple):
    """State of the contact between faces."""

    multiplier: np.ndarray
    """m at every point, (nf, nq) [Pa]."""
    penalty: np.ndarray
    """eps of each pair of facets, (nf,) [Pa/m]."""
    guess: np.ndarray
    """Pressures on which the tangent is based, (nf, nq) [Pa]; of length 0: those are t."""
    pressure: np.ndarray
    """t at every point, overwritten, (nf, nq) [Pa]."""


def coincident(facets: Facets, x: np.ndarray) -> np.ndarray:
    """Nodes of the facets that coincide at rest: behind a cut and in front of it, in the same order,
    (nf, 2, 6). x: (N2, 3) [m]. Raises SolveError if there are none."""
    size, table = float(np.ptp(x)), facets.nodes
    middle = x[table[:, :3]].mean(axis=1)
    pairs = KDTree(middle).query_pairs(SAME_POINT * size, output_type="ndarray")
    if not len(pairs):
        raise SolveError("no two facets lie on each other at rest, so no faces can touch: open the mesh along a cut")
    behind, front = table[pairs.min(axis=1)], table[pairs.max(axis=1)]
    away = np.linalg.norm(x[behind][:, :, None] - x[front][:, None], axis=3)
    order = away.argmin(axis=2)
    if away.min(axis=2).max() > SAME_POINT * size:
        raise SolveError("two facets of a cut have the same middle and other nodes: open one mesh along its faces")
    return np.stack([behind, np.take_along_axis(front, order, axis=1)], axis=1)


@compiled()
def point_of(faces: Faces, nodes: np.ndarray, q: int, apart: np.ndarray, a1: np.ndarray, a2: np.ndarray):
    """y+ - y- (3,), and the tangents of the surface half-way between the faces (3,), at point q; nodes (2, 6, 3)."""
    for i in range(3):
        apart[i] = a1[i] = a2[i] = 0.0
        for a in range(nodes.shape[1]):
            half = 0.5 * (nodes[0, a, i] + nodes[1, a, i])
            apart[i] += faces.values[q, a] * (nodes[1, a, i] - nodes[0, a, i])
            a1[i] += faces.slopes[q, 0, a] * half
            a2[i] += faces.slopes[q, 1, a] * half


@compiled()
def cross_into(a: np.ndarray, b: np.ndarray, c: np.ndarray):
    """c = a × b."""
    c[0], c[1], c[2] = a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]


@compiled()
def slopes_into(
    faces: Faces, q: int, apart: np.ndarray, a1: np.ndarray, a2: np.ndarray, B: np.ndarray, n: np.ndarray, d: np.ndarray
):
    """g [m], |A| and dg/dx in `d` (36,) (eq. 6.15); n (3,) the normal, B (3, 18) = dA/d(half-way nodes)."""
    count, area, v1, v2 = faces.values.shape[1], np.empty(3), np.empty(3), np.empty(3)
    cross_into(a1, a2, area)
    size = np.sqrt(area[0] ** 2 + area[1] ** 2 + area[2] ** 2)
    g = 0.0
    for i in range(3):
        n[i] = area[i] / size
        g += n[i] * apart[i]
    unit, column = np.zeros(3), np.empty(3)
    for i in range(3):
        unit[:] = 0.0
        unit[i] = 1.0
        cross_into(unit, a2, v1)
        cross_into(a1, unit, v2)
        for a in range(count):
            turned = 0.0
            for k in range(3):
                column[k] = faces.slopes[q, 0, a] * v1[k] + faces.slopes[q, 1, a] * v2[k]
                B[k, count * i + a] = column[k]
                turned += (apart[k] - g * n[k]) / size * column[k]
            d[count * i + a] = 0.5 * turned - faces.values[q, a] * n[i]
            d[count * (3 + i) + a] = 0.5 * turned + faces.values[q, a] * n[i]
    return g, size


@compiled()
def add_curvature(
    faces: Faces,
    q: int,
    apart: np.ndarray,
    B: np.ndarray,
    n: np.ndarray,
    g: float,
    size: float,
    f: float,
    K: np.ndarray,
):
    """K += f d²g/dx² (36, 36) (eq. 6.16)."""
    count = faces.values.shape[1]
    half, shear, along, slip = np.empty(3 * count), np.empty((3 * count, 3 * count)), np.empty(3 * count), np.empty(3)
    for k in range(3):
        slip[k] = (apart[k] - g * n[k]) / size
    for r in range(3 * count):
        half[r] = along[r] = 0.0
        for k in range(3):
            half[r] += slip[k] * B[k, r]
            along[r] += n[k] * B[k, r]
    for j in range(3):
        for b in range(count):
            for r in range(3 * count):
                shear[r, count * j + b] = faces.values[q, b] * (B[j, r] - n[j] * along[r]) / size
    m = 3 * count
    for i in range(3):
        for a in range(count):
            r = count * i + a
            for j in range(3):
                for b in range(count):
                    s = count * j + b
                    inner = 0.0
                    for k in range(3):
                        inner += B[k, r] * B[k, s]
                    whole = -(half[r] * along[s] + along[r] * half[s] + g / size * (inner - along[r] * along[s])) / size
                    turn = faces.slopes[q, 0, a] * faces.slopes[q, 1, b] - faces.slopes[q, 1, a] * faces.slopes[q, 0, b]
                    if i != j:
                        k = 3 - i - j
                        sign = 1.0 if (j - i) % 3 == 1 else -1.0
                        whole += turn * sign * slip[k]
                    one, other = shear[r, s], shear[s, r]
                    K[r, s] += f * (0.25 * whole - 0.5 * (one + other))
                    K[m + r, m + s] += f * (0.25 * whole + 0.5 * (one + other))
                    K[r, m + s] += f * (0.25 * whole + 0.5 * (one - other))
                    K[m + r, s] += f * (0.25 * whole + 0.5 * (other - one))


@compiled()
def add_faces(x: np.ndarray, faces: Faces, touch: FaceTouch, values: np.ndarray, residual: np.ndarray, tangent: bool):
    """residual -= w t dg/dx and, if tangent, values += w (eps dg/dx dg/dx - t d²g/dx²); fills the pressures.

    With a guess s of the pressure the tangent is that of a point pressed by s, whether or not it touches."""
    count = faces.values.shape[1]
    width = 6 * count
    nodes, K = np.empty((2, count, 3)), np.empty((width, width))
    apart, a1, a2, n = np.empty(3), np.empty(3), np.empty(3), np.empty(3)
    B, d = np.empty((3, 3 * count)), np.empty(width)
    for f in range(faces.dofs.shape[0]):
        for side in range(2):
            for i in range(3):
                for a in range(count):
                    dof = faces.dofs[f, 3 * count * side + count * i + a]
                    nodes[side, a, i] = faces.rest[dof] + x[dof]
        touched = False
        for q in range(faces.weights.shape[1]):
            point_of(faces, nodes, q, apart, a1, a2)
            g, size = slopes_into(faces, q, apart, a1, a2, B, n, d)
            eps, w = touch.penalty[f], faces.weights[f, q]
            t = s = max(0.0, touch.multiplier[f, q] - eps * g)
            touch.pressure[f, q] = t
            if len(touch.guess):
                s = touch.guess[f, q]
            for r in range(width):
                residual[faces.dofs[f, r]] -= w * t * d[r]
            if tangent and s > 0.0:
                if not touched:
                    K[:] = 0.0
                touched = True
                for r in range(width):
                    for c in range(width):
                        K[r, c] += w * eps * d[r] * d[c]
                add_curvature(faces, q, apart, B, n, g, size, -w * s, K)
        if tangent and touched:
            # A node of the front of the cut is in both facets: of its symmetric pair of entries only one is stored.
            for r in range(3 * count):
                if faces.dofs[f, r] == faces.dofs[f, 3 * count + r]:
                    K[r, 3 * count + r] *= 2.0
            scatter(K, faces.positions[f], values)


def gaps_and_slopes(x: np.ndarray, faces: Faces) -> tuple[np.ndarray, np.ndarray]:
    """g (nf, nq) [m] and dg/dx (nf, nq, 36) of all points."""
    count = faces.values.shape[1]
    nodes = (faces.rest + x[: len(faces.rest)])[faces.dofs].reshape(-1, 2, 3, count)
    half, apart = nodes.mean(axis=1), np.einsum("qa,fia->fqi", faces.values, nodes[:, 1] - nodes[:, 0])
    a1, a2 = (np.einsum("qa,fia->fqi", faces.slopes[:, k], half) for k in range(2))
    area = np.cross(a1, a2)
    size = np.linalg.norm(area, axis=-1, keepdims=True)
    n = area / size
    g = np.einsum("fqi,fqi->fq", n, apart)
    slip = (apart - g[..., None] * n) / size
    turned = np.einsum("qa,fqi->fqia", faces.slopes[:, 0], np.cross(a2, slip))
    turned += np.einsum("qa,fqi->fqia", faces.slopes[:, 1], np.cross(slip, a1))
    push = np.einsum("qa,fqi->fqia", faces.values, n)
    both = np.concatenate([0.5 * turned - push, 0.5 * turned + push], axis=2)
    return g, both.reshape(*g.shape, 6 * count)


def no_faces(points: int, functions: int) -> Faces:
    """The faces of a body without a cut."""
    values, slopes = np.zeros((points, functions)), np.zeros((points, 2, functions))
    width = 6 * functions
    dofs, positions = np.zeros((0, width), np.uint32), np.zeros((0, width * (width + 1) // 2), np.uint32)
    return Faces(dofs, positions, np.zeros(0), values, slopes, np.zeros((0, points)), np.zeros(0))


def overlap(touch: FaceTouch) -> float:
    """Deepest overlap of the faces [m], from t = m - eps g where t > 0."""
    depth = (touch.pressure - touch.multiplier) / touch.penalty[:, None]
    return float(np.max(depth, initial=0.0, where=touch.pressure > 0.0))


def farthest_slip(x: np.ndarray, faces: Faces, touch: FaceTouch) -> float:
    """Largest slip of a pressed point over the other face, over the square root of the area of its facet [1]."""
    nodes = (faces.rest + x[: len(faces.rest)])[faces.dofs].reshape(len(faces.dofs), 2, 3, faces.values.shape[1])
    apart = np.einsum("qa,fia->fqi", faces.values, nodes[:, 1] - nodes[:, 0])
    square = np.sum(apart**2, axis=2) - gaps_and_slopes(x, faces)[0] ** 2
    slip = np.sqrt(np.maximum(0.0, square) / faces.weights.sum(axis=1)[:, None])
    return float(np.max(slip, initial=0.0, where=touch.pressure > 0.0))


def misplacement_of_faces(touch: FaceTouch) -> float:
    """Largest gap or overlap of a point with a contact pressure [m]."""
    off = np.abs(touch.pressure - touch.multiplier) / touch.penalty[:, None]
    return float(np.max(off, initial=0.0, where=touch.pressure > 0.0))
