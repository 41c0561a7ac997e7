"""A ball between planes or held at its caps, reduced to a quarter of its meridian: NGSolve, third order, with a
separate mesh.

The ball is a body of revolution with a plane of symmetry: in cylindrical coordinates (r, z) the quarter disc r, z >= 0
is sufficient. F = 1 + [[u_r,r, u_r,z, 0], [u_z,r, u_z,z, 0], [0, 0, u_r/r]], and an integral over the body is 2π ∫ r …
of the quarter, twice. Elements shrink towards the cap's edge, where the stress is singular, and towards the pole.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import Any

import numpy as np

from reference_fem.crosscheck.newton import Newton
from reference_fem.crosscheck.ngsolve_code import load
from reference_fem.model.material import NeoHookean

ORDER = 3
"""Order of the displacement; that of the pressure is one less."""
STIFF = 2e4
"""Stiffness of contact times radius over shear modulus: under a pressure of mu a point penetrates by 5e-5 of the
radius."""
POLE = 0.85
"""Height over the radius beyond which elements are halved for contact: the largest contact ends there."""
AT = 1e-9
"""Distance over the radius within which a vertex counts as that at the edge of the cap."""


@dataclass(frozen=True)
class MeridianMesh:
    """Settings for the triangulation of a quarter of the meridian."""

    size: float
    """Element size over the radius of the ball."""
    halvings: int
    """How often elements at the edge of a cap are halved at their longest side."""


@dataclass(frozen=True)
class Ball:
    """Radius [m] and material."""

    radius: float
    material: NeoHookean

    @property
    def scale(self) -> float:
        """Force that residuals are compared with [N]."""
        return self.material.mu * self.radius**2


@dataclass(frozen=True, eq=False)
class MeridianSolution:
    """The end of a path."""

    radius: float
    force: np.ndarray
    """Force of the upper plane or cap on the ball, downwards, at each step (s,) [N]."""
    unknowns: int
    mesh: Any
    u: Any
    """NGSolve's displacement (u_r, u_z) of the quarter."""

    def displacement(self, points: np.ndarray) -> np.ndarray:
        """(n, 3) [m] at rest points (n, 3) [m] of the ball, about its centre: the equator moves in its plane only."""
        r, z = np.hypot(points[:, 0], points[:, 1]), np.abs(points[:, 2])
        inward = 1.0 - 1e-6  # the curved mesh may lie inside the sphere by so much
        moves = np.array([self.u(self.mesh(a * inward, b * inward)) for a, b in zip(r, z, strict=True)])
        outward = points[:, :2] / np.where(r > 0, r, 1.0)[:, None]
        return np.column_stack((outward * moves[:, :1], np.sign(points[:, 2]) * moves[:, 1]))


def quarter(radius: float, edge_at: float, mesh: MeridianMesh) -> Any:
    """NGSolve's mesh of the quarter disc; boundaries "equator", "side", "top" (beyond the height `edge_at`), "axis"."""
    geometry = load("netgen.geom2d").SplineGeometry()
    angle = np.arcsin(edge_at / radius)
    outline = (float(radius * np.cos(angle)), float(edge_at))
    corners = ((0.0, 0.0), (radius, 0.0), outline, (0.0, radius))
    centre, east, edge, pole = (geometry.AppendPoint(*corner) for corner in corners)

    def arc(start: float, end: float) -> int:
        half = 0.5 * (start + end)
        reach = radius / np.cos(0.5 * (end - start))
        return geometry.AppendPoint(float(reach * np.cos(half)), float(reach * np.sin(half)))

    geometry.Append(["line", centre, east], bc="equator")
    geometry.Append(["spline3", east, arc(0.0, angle), edge], bc="side")
    geometry.Append(["spline3", edge, arc(angle, 0.5 * np.pi), pole], bc="top")
    geometry.Append(["line", pole, centre], bc="axis")
    disc = load("ngsolve").Mesh(geometry.GenerateMesh(maxh=mesh.size * radius))
    for _ in range(mesh.halvings):
        for element in disc.Elements():
            near = [np.hypot(*np.subtract(disc[v].point, outline)) < AT * radius for v in element.vertices]
            disc.SetRefinementFlag(element, any(near))
        disc.Refine()
    disc.Curve(ORDER + 1)
    return disc


class Quarter:
    """The neo-Hookean quarter in NGSolve: space, potential of the whole ball, and which unknowns are held.

    top: "held" (its edge is the cap's), or "pressed" by a plane whose place is `plane` [m], NGSolve's parameter.
    """

    def __init__(self, mesh: Any, ball: Ball, top: str):
        ng, material = load("ngsolve"), ball.material
        held = "|top" if top == "held" else ""
        self.mesh, self.plane = mesh, ng.Parameter(np.inf)
        across = ng.H1(mesh, order=ORDER, dirichlet="axis" + held)
        along = ng.H1(mesh, order=ORDER, dirichlet="equator" + held)
        self.space = across * along * ng.H1(mesh, order=ORDER - 1)
        self.state = ng.GridFunction(self.space)
        self.form = ng.BilinearForm(self.space, symmetric=True)
        (ur, uz, p), turn = self.space.TrialFunction(), 4.0 * np.pi * ng.x
        flat = ng.Id(2) + ng.CF((ng.grad(ur), ng.grad(uz)), dims=(2, 2))
        hoop = 1.0 + ur / ng.x  # no point of Gauss' rules lies on the axis
        J = ng.Det(flat) * hoop
        first = ng.InnerProduct(flat, flat) + hoop * hoop
        energy = 0.5 * material.mu * (J ** (-2.0 / 3.0) * first - 3.0) + p * (J - 1.0) - p * p / (2.0 * material.kappa)
        self.form += ng.Variation((turn * energy).Compile() * ng.dx(bonus_intorder=2 * ORDER))
        if top == "pressed":
            self.stiffness = STIFF * material.mu / ball.radius
            into = ng.y + uz - self.plane
            pressed = ng.IfPos(into, 0.5 * self.stiffness * into**2, 0.0)
            self.form += ng.Variation((turn * pressed).Compile() * ng.ds("side|top", bonus_intorder=2 * ORDER))
        self.newton = Newton(self.form, self.state, self.space.FreeDofs())

    def plane_force(self) -> float:
        """Force on the upper plane [N], upwards."""
        ng = load("ngsolve")
        into = ng.y + self.state.components[1] - self.plane
        density = 2.0 * np.pi * ng.x * ng.IfPos(into, self.stiffness * into, 0.0)
        return float(ng.Integrate(density, self.mesh, definedon=self.mesh.Boundaries("side|top"), order=4 * ORDER))

    def outward(self) -> np.ndarray:
        """All unknowns of a field whose top moves by 1 along the axis."""
        ng = load("ngsolve")
        field = ng.GridFunction(self.space)
        field.components[1].Set(ng.CF(1.0), definedon=self.mesh.Boundaries("top"))
        return field.vec.FV().NumPy().copy()

    def solution(self, radius: float, forces: list[float]) -> MeridianSolution:
        """The result that is kept of the current state."""
        u = load("ngsolve").CF((self.state.components[0], self.state.components[1]))
        return MeridianSolution(radius, np.array(forces), self.space.ndof, self.mesh, u)


def clamped_caps(ball: Ball, cap: float, pushes: Sequence[float], mesh: MeridianMesh) -> MeridianSolution:
    """A ball held where |z| > cap · radius; each cap is pushed in by `pushes` [m], one after the other.

    Raises SolveError for steps that are too long.
    """
    body = Quarter(quarter(ball.radius, cap * ball.radius, mesh), ball, "held")
    one, forces = body.outward(), []
    for before, push in pairwise((0.0, *pushes)):
        body.newton.lift((before - push) * one)
        body.newton.converge(ball.scale)
        # where `one` is 1 both caps move outward by 1, and the potential is that of the whole ball
        forces.append(-0.5 * float(one @ body.newton.residual()))
    return body.solution(ball.radius, forces)


def between_planes(ball: Ball, pushes: Sequence[float], mesh: MeridianMesh) -> MeridianSolution:
    """A ball between two frictionless planes that touch it; each is pushed in by `pushes` [m], one after the other.

    Raises SolveError for steps that are too long.
    """
    body = Quarter(quarter(ball.radius, POLE * ball.radius, mesh), ball, "pressed")
    forces = []
    for push in pushes:
        body.plane.Set(ball.radius - push)
        body.newton.converge(ball.scale)
        forces.append(body.plane_force())
    return body.solution(ball.radius, forces)
