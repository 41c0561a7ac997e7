"""A slit like a penny inside a large ball, against closed forms for an infinite incompressible body.

Sneddon, Proc. R. Soc. Lond. A 187 (1946): under a far tension s, or under a pressure s inside, the sides of a slit of
radius a part by 2 s a/(pi mu) √(1 − r²/a²), and it holds 4 s a³/(3 mu). A ball of radius R adds about 1.7 (a/R)³, here
0.2 %. The slit of the meshes is a polygon of 32 sides: a is the radius of a circle of its area.
"""

import numpy as np
import pytest
from scipy.sparse import block_array, csr_array, csr_matrix, triu, vstack
from skfem import MeshTet, MeshTet2

from massspring import Material, quadratic_body
from massspring.analysis.stiffness import stiffness_at_rest
from massspring.body.opening import opened
from massspring.body.quadratic import boundary_facets
from reference_fem import Cavity, NeoHookean, PrescribedDisplacement, Problem, Traction, equilibrium_path, nodes
from reference_fem.system.linear import SymmetricSolver
from studies.meshing.opened_mesh import opened_elements
from tests.massspring.conftest import boundary
from tests.massspring.quadratic import second_order, upright
from tests.studies.geometry.boxes import split

pytestmark = pytest.mark.slow
EDGE = 0.01  # of the polygon that stands for the slit's edge, from the axis to its corners [m]
BALL = 10.0 * EDGE
SHELLS = (0.0, 0.15, 0.3, 0.5, 0.75, 1.05, 1.4, 1.9, 2.4, np.arccosh(BALL / EDGE))
"""u of the shells, whose points are (cosh u cos v, sinh u sin v): near the edge they are as fine as the stress there
asks for, and the last is a ball."""
LEVELS = 3


def area(levels: int = LEVELS) -> float:
    """Of the whole slit [m²], a polygon."""
    sides = 2 ** (levels + 2)
    return 0.5 * sides * EDGE**2 * np.sin(2.0 * np.pi / sides)


def quarter_sphere(levels: int) -> tuple[np.ndarray, np.ndarray]:
    """Points of an octahedron's quarter x, y >= 0, split `levels` times, those on the equator first, and triangles."""
    points, triangles = np.array([[1.0, 0, 0], [0, 1, 0], [0, 0, 1], [0, 0, -1]]), np.array([[0, 1, 2], [1, 0, 3]])
    for _ in range(levels):
        points, triangles = split(points, triangles)
    order = np.argsort(points[:, 2] != 0, kind="stable")
    return points[order] / np.linalg.norm(points[order], axis=1)[:, None], np.argsort(order)[triangles]


def penny(levels: int = LEVELS, innermost: float = 0.0) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Points (n, 3) [m], tetrahedra (k, 4), and triangles (f, 3) of the innermost shell with z >= 0, seen from above.

    The innermost shell is u = 0: both its sides lie on each other and are glued, so its triangles are faces between
    tetrahedra. With another u it is the wall of a lumen."""
    direction, triangles = quarter_sphere(levels)
    n, shells = len(direction), (innermost, *SHELLS[1:])
    points = np.vstack([EDGE * direction * [np.cosh(u), np.cosh(u), np.sinh(u)] for u in shells])
    cells = []
    for shell in range(len(shells) - 1):
        # Nodes of the equator have the least numbers: no tetrahedron lies flat in its plane.
        a, b, c = (shell * n + np.sort(triangles, axis=1)).T
        p, q, r = (a + n, b + n, c + n)
        cells += [np.column_stack(part) for part in ((a, b, c, r), (a, b, q, r), (a, p, q, r))]
    _, first, inverse = np.unique(np.round(points / EDGE, 9) + 0.0, axis=0, return_index=True, return_inverse=True)
    inverse, cells = inverse.reshape(-1), np.vstack(cells)
    above = triangles[(direction[triangles, 2] >= 0).all(axis=1)]
    return points[first], upright(points[first], inverse[cells]), inverse[above]


A = np.sqrt(area() / np.pi)
BALL_ADDS = 1.0 + 1.7 * (A / BALL) ** 3
MU = 1800.0
TENSION = 1e-3 * MU
TOLERANCE = 0.015
THIN = 0.005
"""u of a slit that is a little open at rest: its half thickness over its radius."""


def sneddon(r: np.ndarray, s: float = TENSION) -> np.ndarray:
    """Opening [m] at distances `r` [m] from the axis."""
    return 2 * s * A / (np.pi * MU) * np.sqrt(1 - (r / A) ** 2) * BALL_ADDS


def pressure_of(content: float) -> float:
    """[Pa] that opens a slit by `content` [m³]."""
    return 3 * MU * content / (4 * A**3) / BALL_ADDS


def fitted(r: np.ndarray, gap: np.ndarray, s: float = TENSION) -> float:
    """Openings over those of the closed form, at nodes that are not next to the edge."""
    inside = r < 0.9 * A
    assert inside.sum() > 40
    truth = sneddon(r[inside], s)
    assert np.abs(gap[inside] - truth).max() < 0.03 * truth.max()
    return float(gap[inside] @ truth / (truth @ truth))


class SlitBody:
    """The quadratic body of the opened ball, and small displacements of it under loads, all volumes kept."""

    def __init__(self):
        points, tetrahedra, faces = penny()
        points, cells = second_order(points, tetrahedra)
        opening = opened(cells, faces, len(points))
        self.x, self.pairs = points[opening.parent], opening.pairs
        self.body = quadratic_body(self.x, opening.cells, Material(MU, 1060.0))
        facets = boundary_facets(opening.cells).astype(np.int64)
        corner = np.linalg.norm(self.x[facets[:, :3]], axis=2)
        self.outer, self.slit = facets[corner.min(axis=1) > 0.9 * BALL], facets[corner.max(axis=1) < 1.01 * EDGE]

        self.held = np.zeros(self.x.shape, dtype=bool)
        self.held[:, :2] = np.abs(self.x[:, :2]) < 1e-12 * BALL
        self.held[np.linalg.norm(self.x - [BALL, 0, 0], axis=1).argmin(), 2] = True

    def pull(self) -> np.ndarray:
        """Forces [N] of the far tension on the flat outer facets, (n, 3)."""
        force = np.zeros_like(self.x)
        np.add.at(force[:, 2], self.outer[:, 3:], TENSION * self.areas(self.outer)[:, 2:] / 3)
        return force

    def content(self) -> np.ndarray:
        """What each displacement adds to the content of the quarter of the slit [m²], (n, 3)."""
        row = np.zeros_like(self.x)
        for middle in range(3, 6):
            np.add.at(row, self.slit[:, middle], -self.areas(self.slit) / 3)
        return row

    def areas(self, facets: np.ndarray) -> np.ndarray:
        """Area normals [m²] of flat facets (f, 6), (f, 3); quadratic functions have a third of it at each middle."""
        a, b, c = self.x[facets[:, :3]].transpose(1, 0, 2)
        return 0.5 * np.cross(b - a, c - a)

    def moved(self, force: np.ndarray, rows: tuple = (), values: tuple = ()) -> tuple[np.ndarray, np.ndarray]:
        """Displacements (n, 3) [m] under forces (n, 3) [N] where further `rows` (n, 3) have `values`, and the
        multipliers of these [Pa]."""
        free = np.flatnonzero(~self.held.ravel())
        stiffness, scale = stiffness_at_rest(self.body)[free][:, free], MU / A  # scales all rows alike
        kept = scale * vstack(
            [self.body.kept.jacobian(self.x), *(csr_array(row.reshape(1, -1)) for row in rows)], "csr"
        )
        kept = kept[:, free]
        whole = block_array([[stiffness, kept.T], [kept, None]], format="csr")
        zero = csr_matrix((np.zeros(len(free) + kept.shape[0]), (np.arange(whole.shape[0]),) * 2))
        upper = csr_matrix(triu(csr_matrix(whole))) + zero
        upper.sort_indices()
        solver = SymmetricSolver()
        solver.factor(upper)
        targets = scale * np.asarray(values, dtype=float)
        solution = solver.solve(np.concatenate([force.ravel()[free], np.zeros(self.body.kept.count), targets]))
        solver.release()
        u = np.zeros(self.x.size)
        u[free] = solution[: len(free)]
        return u.reshape(-1, 3), -scale * solution[len(solution) - len(rows) :]

    def gap(self, u: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Distance from the axis of each pair of nodes [m], (p,), and how far they have parted, (p,) [m]."""
        behind, front = self.pairs.T
        return np.linalg.norm(self.x[behind], axis=1), (u[front] - u[behind])[:, 2]


@pytest.fixture(scope="module")
def body() -> SlitBody:
    return SlitBody()


def test_the_quadratic_body_opens_a_penny_as_sneddon_says(body):
    u, _ = body.moved(body.pull())
    r, gap = body.gap(u)
    assert fitted(r, gap) == pytest.approx(1.0, abs=TOLERANCE)
    assert 4 * np.vdot(body.content(), u) == pytest.approx(
        4 * TENSION * A**3 / (3 * MU) * BALL_ADDS, rel=TOLERANCE, abs=0
    )


def test_the_quadratic_body_with_a_filled_penny_has_its_pressure_and_its_gap(body):
    content = 1e-3 * A**3
    u, (pressure,) = body.moved(np.zeros_like(body.x), (body.content(),), (content / 4,))
    assert 4 * np.vdot(body.content(), u) == pytest.approx(content, rel=1e-6, abs=0)
    assert pressure == pytest.approx(pressure_of(content), rel=TOLERANCE)
    r, gap = body.gap(u)
    assert gap[r.argmin()] == pytest.approx(3 * content / (2 * np.pi * A**2), rel=TOLERANCE)


HELD = (
    PrescribedDisplacement(lambda x: np.abs(x[0]) < 1e-12 * BALL, (0,)),
    PrescribedDisplacement(lambda x: np.abs(x[1]) < 1e-12 * BALL, (1,)),
    PrescribedDisplacement(lambda x: np.linalg.norm(x.T - [BALL, 0, 0], axis=1) < 1e-9 * BALL, (2,)),
)
MATERIAL = NeoHookean(MU, 1e4 * MU)


def straight(points: np.ndarray, tetrahedra: np.ndarray) -> MeshTet2:
    return MeshTet2.from_mesh(MeshTet(np.ascontiguousarray(points.T), np.ascontiguousarray(tetrahedra.T)))


class FarTension:
    """A tension along z at the flat outer facets of a mesh; the place of a point gives the facet and its normal."""

    def __init__(self, points: np.ndarray, tetrahedra: np.ndarray):
        outer = boundary(tetrahedra)
        outer = outer[np.linalg.norm(points[outer], axis=2).min(axis=1) > 0.9 * BALL]
        a, b, c = points[outer].transpose(1, 0, 2)
        normal = np.cross(b - a, c - a)
        self.normal = normal / np.linalg.norm(normal, axis=1)[:, None]
        self.level = np.einsum("fi,fi->f", self.normal, a)

    def where(self, x: np.ndarray) -> np.ndarray:
        """Not in the planes of symmetry, nor at the slit."""
        return (np.linalg.norm(x, axis=0) > 0.9 * BALL) & (np.abs(x[:2]).min(axis=0) > 1e-9 * BALL)

    def value(self, t: float, x: np.ndarray) -> np.ndarray:
        """[Pa], (3, N): the facets are convex, and a point lies on the one that it is farthest out of."""
        facet = (self.normal @ x / self.level[:, None]).argmax(axis=0)
        return t * TENSION * np.outer([0, 0, 1], self.normal[facet, 2])


def test_the_reference_opens_a_penny_as_sneddon_says():
    points, tetrahedra, faces = penny()
    mesh, parent = opened_elements(straight(points, tetrahedra), faces)
    far = FarTension(points, tetrahedra)
    problem = Problem(mesh, MATERIAL, HELD, loads=(Traction(far.where, far.value),))
    (state,) = equilibrium_path(problem, [1.0])
    twice = np.flatnonzero(np.bincount(parent)[parent] == 2)
    copies = twice[np.argsort(parent[twice], kind="stable")].reshape(-1, 2)
    r = np.linalg.norm(nodes(mesh)[copies[:, 0]], axis=1)
    assert fitted(r, np.abs(np.diff(state.u[copies, 2], axis=1)[:, 0])) == pytest.approx(1.0, abs=TOLERANCE)


def test_the_reference_with_a_filled_penny_has_its_pressure_and_its_gap():
    """Of a slit that is a little open at rest: one without content is no lumen."""
    points, tetrahedra, _ = penny(innermost=THIN)
    mesh, grown = straight(points, tetrahedra), 1.1
    slit = Cavity(lambda x: np.linalg.norm(x, axis=0) < 1.01 * EDGE, volume=lambda t: grown)
    (state,) = equilibrium_path(Problem(mesh, MATERIAL, HELD, cavities=(slit,)), [1.0])
    x = nodes(mesh)
    content = 4 * state.cavity_volume[0] * (1 - 1 / grown)
    assert state.cavity_pressure[0] == pytest.approx(pressure_of(content), rel=TOLERANCE)
    pole = np.flatnonzero((np.abs(x[:, :2]).max(axis=1) < 1e-12) & (np.abs(x[:, 2]) < 1.01 * EDGE * np.sinh(THIN)))
    assert np.ptp(state.u[pole, 2]) == pytest.approx(3 * content / (2 * np.pi * A**2), rel=TOLERANCE)
