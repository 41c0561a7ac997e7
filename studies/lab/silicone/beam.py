"""The beam for both solvers: its mesh, what holds it, what hangs at its tip, and where the markers are."""

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from skfem import MeshTet, MeshTet2

from massspring import (
    Attachment,
    Body,
    Clock,
    Material,
    Method,
    Setup,
    Volumes,
    make_clock,
    quadratic_body,
    simulate,
    step_limit,
    tetrahedral_body,
)
from reference_fem import (
    DynamicsSettings,
    NeoHookean,
    PointMass,
    PrescribedDisplacement,
    Problem,
    equilibrium_path,
    motion_path,
    nodes,
)
from studies import StudyError
from studies.geometry.mesh.organ_mesh import boundary_triangles
from studies.lab.silicone.measured import GRAVITY, Load

LENGTH, SIDE = 0.1, 0.03
"""[m]."""
DENSITY, POISSON = 1070.0, 0.499
MARKERS = np.array([[0.0, 0.015, 0.036], [0.0, -0.006, 0.024], [0.0, 0.036, 0.006]])
"""[m]: on the sides of the tip, 6 mm outside; x along the beam, 0 at the tip, z up, 0 at its lower side."""
EDGES = np.array([[0, 1], [1, 2], [0, 2], [0, 3], [1, 3], [2, 3]])
"""Of a quadratic tetrahedron in VTK's order."""
FRAME = 0.01
"""Of the cameras [s]; moments of the reference and frames of the bodies are as long."""


@dataclass(frozen=True)
class Beam:
    """The box in `across` × `across` × `along` bricks of six tetrahedra each."""

    across: int
    along: int

    @cached_property
    def mesh(self) -> MeshTet:
        """Straight tetrahedra."""
        side = np.linspace(0.0, SIDE, self.across + 1)
        return MeshTet.init_tensor(np.linspace(-LENGTH, 0.0, self.along + 1), side, side)

    @cached_property
    def corners(self) -> tuple[np.ndarray, np.ndarray]:
        """Points (n, 3) [m] and tetrahedra (k, 4), positive."""
        return upright(self.mesh.p.T.copy(), self.mesh.t.T.astype(np.int64))

    @cached_property
    def quadratic(self) -> tuple[np.ndarray, np.ndarray]:
        """Points with those in the middle of edges (n, 3) [m], and cells (k, 10) in VTK's order."""
        return second_order(*self.corners)


def upright(points: np.ndarray, cells: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Points (n, 3) and tetrahedra (k, 4), turned so that all are positive."""
    a, b, c, d = points[cells].transpose(1, 0, 2)
    wrong = np.einsum("ki,ki->k", np.cross(b - a, c - a), d - a) < 0.0
    cells[wrong] = cells[wrong][:, [0, 2, 1, 3]]
    return points, cells


def second_order(points: np.ndarray, cells: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Points with those in the middle of edges (n, 3), and cells (k, 10) in VTK's order, of tetrahedra (k, 4)."""
    ends = np.sort(cells[:, EDGES].reshape(-1, 2), axis=1)
    edges, which = np.unique(ends, axis=0, return_inverse=True)
    middles = len(points) + which.reshape(-1, len(EDGES))
    return np.concatenate([points, points[edges].mean(axis=1)]), np.concatenate([cells, middles], axis=1)


def glued(points: np.ndarray) -> np.ndarray:
    """Which of the points (n, 3) [m] are on the glued face, (n,)."""
    return points[:, 0] < 1e-9 - LENGTH


def hung(points: np.ndarray, mass: float, height: float) -> tuple[np.ndarray, np.ndarray]:
    """Nodes of the tip's face at `height` [m], (k,), and their shares of `mass` [kg], (k,): by the length of the line
    that is nearest to each. The mesh has nodes there."""
    on_line = np.flatnonzero((points[:, 0] > -1e-9) & (np.abs(points[:, 2] - height) < 1e-9))
    order = on_line[np.argsort(points[on_line, 1])]
    length = np.gradient(points[order, 1])
    length[[0, -1]] *= 0.5
    return order, mass / SIDE * length


def marker_sag(points: np.ndarray, moved: np.ndarray) -> np.ndarray:
    """How far each marker is below its rest [m], (K, 3), for nodes at `points` (n, 3) that are at `moved` (K, n, 3).

    A marker follows the rigid motion nearest to that of the tip's face (Kabsch 1976)."""
    tip = np.flatnonzero(points[:, 0] > -1e-9)
    rest, now = points[tip], moved[:, tip]
    middle, centre = rest.mean(axis=0), now.mean(axis=1)
    u, _, vt = np.linalg.svd(np.einsum("kni,nj->kij", now - centre[:, None], rest - middle))
    u[:, :, 2] *= np.linalg.det(u @ vt)[:, None]
    seen = centre[:, None] + np.einsum("kij,mj->kmi", u @ vt, MARKERS - middle)
    return MARKERS[:, 2] - seen[:, :, 2]


def shear_modulus(youngs: float) -> float:
    """mu [Pa] of E [Pa]."""
    return youngs / (2.0 * (1.0 + POISSON))


def reference_problem(beam: Beam, youngs: float, load: Load) -> Problem:
    """The beam as the reference has it, the load on its upper edge; E = `youngs` [Pa]."""
    mesh, mu = MeshTet2.from_mesh(beam.mesh), shear_modulus(youngs)
    where, shares = hung(nodes(mesh), load.mass, SIDE)
    return Problem(
        mesh=mesh,
        material=NeoHookean(mu, mu * 2.0 * (1.0 + POISSON) / (3.0 * (1.0 - 2.0 * POISSON))),
        held=(PrescribedDisplacement(where=lambda x: glued(x.T)),),
        gravity=(0.0, 0.0, -GRAVITY),
        density=DENSITY,
        masses=tuple(PointMass(int(n), float(m)) for n, m in zip(where, shares, strict=True) if m > 0.0),
    )


def reference_rest(beam: Beam, youngs: float, load: Load) -> np.ndarray:
    """Sag of the markers at rest [m], (3,). Raises SolveError."""
    problem = reference_problem(beam, youngs, load)
    end = equilibrium_path(problem, (0.5, 1.0))[-1]
    points = nodes(problem.mesh)
    return marker_sag(points, (points + end.u)[None])[0]


def reference_swing(
    beam: Beam, youngs: float, load: Load, damping: float, duration: float, dt: float
) -> tuple[np.ndarray, np.ndarray]:
    """Times (K,) [s] and sags (K, 3) [m] of the release, damped by −c M v with c = `damping` [1/s], in steps dt [s].
    Raises SolveError."""
    problem, t = reference_problem(beam, youngs, load), FRAME * np.arange(round(duration / FRAME) + 1)
    points = nodes(problem.mesh)
    path = motion_path(problem, tuple(t), DynamicsSettings(dt, damping))
    return t, marker_sag(points, np.array([points + moment.u for moment in path]))


@dataclass(frozen=True)
class Contestant:
    """A body of ours and the method that moves it."""

    name: str
    beam: Beam
    kind: str
    """"quadratic", or the stiffness law of a body of linear tetrahedra."""
    method: Method
    nodal: bool = False
    """Whether a linear body keeps one volume per node, not one in all."""
    dt: float | None = None
    """Step of a method without a stability limit [s]."""
    height: float = SIDE
    """Where on the tip's face the load hangs [m]: the authors have it on the upper edge."""

    def body(self, youngs: float, load: Load) -> Body:
        """The body with what hangs at its tip; E = `youngs` [Pa]. Raises MassSpringError."""
        material = Material(shear_modulus(youngs), DENSITY)
        if self.kind == "quadratic":
            body = quadratic_body(*self.beam.quadratic, material)
        else:
            points, cells = self.beam.corners
            body = tetrahedral_body(points, boundary_triangles(cells), cells, material, self.kind)
            body = body.keeping(Volumes.nodal(body)) if self.nodal else body
        where, shares = hung(body.rest, load.mass, self.height)
        mass = body.mass.copy()
        mass[where] += shares
        return replace(body, mass=mass)

    def swing(self, youngs: float, load: Load, damping: float, duration: float) -> tuple[np.ndarray, np.ndarray]:
        """As `reference_swing`. Raises MassSpringError; StudyError for a run that breaks off."""
        body, frames = self.body(youngs, load), round(duration / FRAME)
        limit = step_limit(body, damping, None, self.method.added_stiffness(body))
        clock = (
            make_clock(duration, frames, 0.8 * limit.damped, limit)
            if self.dt is None
            else Clock(FRAME, frames, max(1, round(FRAME / self.dt)))
        )
        hold = (Attachment(np.flatnonzero(glued(body.rest))),)
        setup = Setup(body, self.method, clock, (), hold, (0.0, 0.0, -GRAVITY), damping)
        history = simulate(setup, list(range(1, frames + 1)))
        if history.outcome != "finished":
            raise StudyError(f"{self.name} with {load.name} at the tip: {history.message}")
        t = FRAME * np.arange(frames + 1)
        return t, marker_sag(body.rest, np.concatenate([body.rest[None], history.snapshots]))
