"""Hollow bodies: an enclosed lumen, its volume and its pressure.

The lumen's pressure p_c is a Lagrange multiplier: Pi_c = -p_c (V - V_target). V is a cubic in the positions, and its
second derivative is the follower load's stiffness, symmetric because the surface is closed (Bufler, Pressure loaded
structures under large deformations, ZAMM 64, 1984). docs/theory.md, eq. 6.6.
"""

import itertools
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from typing import Any, NamedTuple

import numpy as np
from skfem import ElementTriP2
from skfem.quadrature import get_quadrature
from skfem.refdom import RefTri

from reference_fem.compiled import compiled
from reference_fem.elements.shapes import basis_table, nodes
from reference_fem.elements.surface import scatter
from reference_fem.errors import SolveError


@dataclass(frozen=True, eq=False)
class Cavity:
    """A lumen enclosed by the tissue. A lumen that is open to the outside is not a cavity.

    where: (3, N) rest centroids of boundary facets -> bool (N,): the wall of the lumen. volume: t [s] -> filling
    V/V0, None = 1 (incompressible content). pressure: t [s] -> gauge pressure in the lumen [Pa], instead of a volume.
    Values that are not zero at the start are applied there first, together with gravity. The wall may end on symmetry
    planes: coordinate planes whose component is held at zero along the whole edge.
    """

    where: Callable
    volume: Callable | None = None
    pressure: Callable | None = None

    def target(self, t: float, number: int):
        """Target of the filling V/V0, or of the pressure [Pa], at time t."""
        given = self.volume if self.pressure is None else self.pressure
        value = float(1.0 if given is None else given(t))
        if not np.isfinite(value) or (self.pressure is None and value <= 0.0):
            what, unit = ("filling", "of V0, positive") if self.pressure is None else ("pressure", "Pa")
            raise SolveError(f"the {what} of cavity {number} is {value} at t = {t:g} s: give a number {unit}")
        return value


class Wall(NamedTuple):
    """Tables of the wall of a cavity for the kernel: nf facets of nn nodes."""

    dofs: np.ndarray
    """Unknowns of the nodes, u_x first, then u_y, u_z, (nf, 3 nn) uint32."""
    positions: np.ndarray
    """Slots of the packed upper triangle, (nf, 3 nn (3 nn + 1) / 2) uint32."""
    rest: np.ndarray
    """Rest coordinates about the cavity's origin, interleaved like the unknowns [m]."""
    triples: np.ndarray
    """Node triples a < b < c of a facet, (nt, 3)."""
    shares: np.ndarray
    """C_abc: V = sum over facets and triples of C_abc det(y_a, y_b, y_c), (nt,)."""


@dataclass(frozen=True, eq=False)
class Lumen:
    """One cavity on one mesh."""

    wall: Wall
    volume0: float
    """Rest volume [m³]."""
    cavity: Cavity = field(repr=False)
    number: int = 0
    normals: np.ndarray | None = None
    """N_abc: integral of phi_a n dA over a facet = sum of N_abc y_b × y_c, (nn, nn, nn); None for a closed wall."""

    @property
    def by_pressure(self):
        """Whether the pressure is prescribed, not the volume."""
        return self.cavity.pressure is not None

    def target(self, t: float, load: float):
        """Target volume [m³] or pressure [Pa] at time t, with a share `load` of the start values."""
        value = self.cavity.target(t, self.number)
        return load * value if self.by_pressure else (1.0 + load * (value - 1.0)) * self.volume0

    def add(self, x: np.ndarray, pressure: float, gradient: np.ndarray, values: np.ndarray, tangent: bool):
        """Adds dV/dx to gradient, -pressure d²V/dx² to values if tangent; returns V [m³]."""
        return add_wall(x, self.wall, pressure, gradient, values, tangent)

    def beyond_pressure(self, x: np.ndarray):
        """The part of dV/dx on held unknowns that is not area times normal of the wall, in the shape of x [m²].

        The volume is computed as that of a cone over the wall. If the edge of the wall moved off its symmetry plane,
        the cone would grow, but the content would do no work on it: its pressure acts only on the wall.
        """
        beyond = np.zeros(len(x))
        if self.normals is None:
            return beyond
        add_wall(x, self.wall, 0.0, beyond, np.zeros(1), False)
        dofs = self.wall.dofs.astype(np.int64)
        y = (self.wall.rest[dofs] + x[dofs]).reshape(len(dofs), 3, -1)
        turned = np.cross(y[:, :, :, None], y[:, :, None, :], axis=1)
        area = np.einsum("abc,fibc->fia", self.normals, turned).reshape(dofs.shape)
        return beyond - np.bincount(dofs.ravel(), area.ravel(), minlength=len(x))


def facet_normals():
    """N_abc of a facet: integral of phi_a (phi_b,r phi_c,s), (nn, nn, nn)."""
    points, w = get_quadrature(RefTri, 4)  # degree 2 + 1 + 1
    N, dN = basis_table(ElementTriP2(), points)
    return np.einsum("q,qa,qb,qc->abc", w, N, dN[:, 0], dN[:, 1])


def facet_shares():
    """Triples and their shares C_abc of the cone over one facet: integral of y·(y_r × y_s) / 3, antisymmetrised."""
    T = facet_normals() / 3.0
    triples = np.array(list(itertools.combinations(range(len(T)), 3)))
    even, odd = ((0, 1, 2), (1, 2, 0), (2, 0, 1)), ((0, 2, 1), (2, 1, 0), (1, 0, 2))
    shares = sum(T[tuple(triples[:, p].T)] for p in even) - sum(T[tuple(triples[:, p].T)] for p in odd)
    return triples.astype(np.uint32), np.asarray(shares)


@compiled()
def add_wall(x: np.ndarray, wall: Wall, pressure: float, gradient: np.ndarray, values: np.ndarray, tangent: bool):
    """gradient += dV/dx [m²] and, if tangent, values -= pressure d²V/dx²; returns the enclosed V [m³] (eq. 6.6).

    det(a, b, c) = a·(b × c): d/da = b × c, and d²/da_i db_j = e_ijk c_k.
    """
    dofs, positions, rest, triples, shares = wall
    count = dofs.shape[1] // 3
    y, K = np.empty((count, 3)), np.empty((3 * count, 3 * count))
    V = 0.0
    for f in range(dofs.shape[0]):
        for i in range(3):
            for a in range(count):
                dof = dofs[f, count * i + a]
                y[a, i] = rest[dof] + x[dof]
        K[:] = 0.0
        for t in range(triples.shape[0]):
            share = shares[t]
            for turn in range(3):
                a, b, c = triples[t, turn], triples[t, (turn + 1) % 3], triples[t, (turn + 2) % 3]
                for i in range(3):
                    j, k = (i + 1) % 3, (i + 2) % 3
                    slope = share * (y[b, j] * y[c, k] - y[b, k] * y[c, j])
                    gradient[dofs[f, count * i + a]] += slope
                    V += y[a, i] * slope / 3.0
                    bent = -pressure * share * y[c, k]
                    K[count * i + a, count * j + b] += bent
                    K[count * j + b, count * i + a] += bent
                    K[count * j + a, count * i + b] -= bent
                    K[count * i + b, count * j + a] -= bent
        if tangent:
            scatter(K, positions[f], values)
    return V


def find_lumens(problem: Any, pattern: Any, table: np.ndarray, held: Sequence[Any]) -> list[Lumen]:
    """The cavities of a problem on its mesh; table: facet nodes (nf, nn), held: HeldNodes.

    Raises SolveError for a wall that has no facet, shares one with another wall, is open, or encloses a negative
    volume.
    """
    x, lumens = nodes(problem.mesh), []
    corners = table[:, :3]
    for number, chosen in enumerate(find_walls(problem.cavities, x[corners].mean(axis=1).T)):
        origin, is_open = wall_origin(number, corners[chosen], x, held)
        wall = build_wall(problem, pattern, table[chosen], origin)
        nothing = np.zeros(len(pattern.rank))
        volume0 = add_wall(nothing, wall, 0.0, nothing.copy(), np.zeros(1), False)
        if volume0 <= 0.0:
            raise SolveError(
                f"cavity {number} encloses {volume0:.3g} m³ (limit > 0): choose the inner surface of the tissue"
            )
        normals = -facet_normals() if is_open else None
        lumens.append(Lumen(wall, volume0, problem.cavities[number], number, normals))
    return lumens


def find_walls(cavities: Sequence[Cavity], centroids: np.ndarray):
    """Numbers of the facets of each cavity; centroids: (3, nf) rest positions [m] of all boundary facets."""
    owners, walls = np.full(centroids.shape[1], -1), []
    for number, cavity in enumerate(cavities):
        if cavity.volume is not None and cavity.pressure is not None:
            raise SolveError(f"cavity {number} has both a volume and a pressure: give one of them")
        chosen = np.flatnonzero(np.asarray(cavity.where(centroids), dtype=bool))
        shared = chosen[owners[chosen] >= 0]
        if chosen.size == 0:
            raise SolveError(
                f"cavity {number} contains none of the {len(owners)} boundary facets: let `where` choose its wall"
            )
        if shared.size:
            raise SolveError(
                f"cavities {owners[shared[0]]} and {number} share {shared.size} facets: a facet bounds one lumen"
            )
        owners[chosen] = number
        walls.append(chosen)
    return walls


def build_wall(problem: Any, pattern: Any, table: np.ndarray, origin: np.ndarray) -> Wall:
    """Tables of the facets in `table` (nf, nn), outward of the tissue and so into the lumen: hence the sign."""
    triples, shares = facet_shares()
    dofs = np.hstack([3 * table + c for c in range(3)])
    rest = np.ascontiguousarray((nodes(problem.mesh) - origin).ravel())
    return Wall(dofs.astype(np.uint32), pattern.positions(dofs), rest, triples, -shares)


def wall_origin(number: int, corners: np.ndarray, x: np.ndarray, held: Sequence[Any]):
    """(point (3,) [m] on all symmetry planes that close the wall, the centre of the wall if there are none; whether
    there are any)."""
    edges = np.sort(np.concatenate((corners[:, :2], corners[:, 1:], corners[:, ::2])), axis=1)
    edges, count = np.unique(edges, axis=0, return_counts=True)
    border = edges[count == 1]
    origin, size, closed = x[corners].mean(axis=(0, 1)), np.ptp(x), np.zeros(len(border), dtype=bool)
    for region in held:
        if region.motion is not None:
            continue
        for c in region.components:
            inside = np.isin(border, region.nodes).all(axis=1) & ~closed
            if inside.any() and np.ptp(x[border[inside], c]) < 1e-9 * size:
                origin[c] = x[border[inside][0, 0], c]
                closed |= inside
    if not closed.all():
        raise SolveError(
            f"the wall of cavity {number} is open along {np.sum(~closed)} edges (limit 0): choose the whole inner "
            f"surface, which may only end on coordinate planes held at zero"
        )
    return origin, len(border) > 0
