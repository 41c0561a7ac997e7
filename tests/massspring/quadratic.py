"""Elastic bodies of linear and quadratic elements: meshes, energies from the definition, and a closed form."""

from itertools import product

import gmsh
import numpy as np
from scipy.optimize import brentq

from massspring import Body, Volumes, quadratic_body, tetrahedral_body
from massspring.body.laws import Edges
from massspring.body.points import PAIRS, PointVolumes
from massspring.body.quadratic import boundary_facets
from tests.massspring.conftest import SOFT, block, hollow_block, icosphere

RADIUS = 0.05
BENT = 0.06
"""Of an edge: how far mid-side nodes of a curved block leave the middle, and the amplitude of its waves."""


def second_order(points: np.ndarray, tetrahedra: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Points (n, 3) [m] and cells (k, 10) in VTK's order of straight quadratic tetrahedra."""
    ends = np.sort(tetrahedra[:, PAIRS].reshape(-1, 2), axis=1)
    edges, middle = np.unique(ends, axis=0, return_inverse=True)
    return np.vstack([points, points[edges].mean(axis=1)]), np.hstack([tetrahedra, len(points) + middle.reshape(-1, 6)])


def quadratic_block(cells=(2, 2, 2), edge: float = 0.02, distortion: float = 0.15) -> tuple[np.ndarray, np.ndarray]:
    """A straight block with moved nodes."""
    points, _, tetrahedra = block(cells, edge, distortion)
    return second_order(points, tetrahedra)


def bricks(cells: tuple[int, int, int], size: tuple[float, float, float]) -> tuple[np.ndarray, np.ndarray]:
    """A block of `size` [m] from the origin on, six straight elements in each brick."""
    points, _, tetrahedra = block(cells, 1.0, 0.0)
    return second_order(points * np.divide(size, cells), tetrahedra)


def round_bricks(cells: int, radius: float, height: float) -> tuple[np.ndarray, np.ndarray]:
    """A cylinder of `radius` and `height` [m] round the z-axis: the squares of a block of `cells`³ bricks moved onto
    circles."""
    points, nodes = bricks((cells, cells, cells), (2.0, 2.0, height))
    across = points[: int(nodes[:, :4].max()) + 1] - [1.0, 1.0, 0.0]
    square, circle = np.abs(across[:, :2]).max(axis=1), np.hypot(*across[:, :2].T)
    across[:, :2] *= (radius * square / np.where(circle > 0.0, circle, 1.0))[:, None]
    return second_order(across, nodes[:, :4])


def gmsh_block(edge: float, size: tuple[float, float, float]) -> tuple[np.ndarray, np.ndarray]:
    """The block of `bricks` in irregular elements of about `edge` [m]."""
    gmsh.initialize(interruptible=False)
    try:
        gmsh.option.setNumber("General.Terminal", 0)
        gmsh.option.setNumber("Mesh.MeshSizeMin", edge)
        gmsh.option.setNumber("Mesh.MeshSizeMax", edge)
        gmsh.model.occ.addBox(0.0, 0.0, 0.0, *size)
        gmsh.model.occ.synchronize()
        gmsh.model.mesh.generate(3)
        tags, points, _ = gmsh.model.mesh.getNodes()
        tetrahedra = np.searchsorted(np.sort(tags), gmsh.model.mesh.getElementsByType(4)[1]).reshape(-1, 4)
    finally:
        gmsh.finalize()
    points = np.reshape(points, (-1, 3))[np.argsort(tags)]
    return second_order(points, upright(points, tetrahedra))


def curved_block(cells=(2, 2, 2), edge: float = 0.02) -> tuple[np.ndarray, np.ndarray]:
    """A block whose sides are bent."""
    points, nodes = quadratic_block(cells, edge, 0.1)
    waves = np.sin(2.0 * points[:, [1, 2, 0]] / edge) * np.cos(1.5 * points[:, [2, 0, 1]] / edge)
    return points + BENT * edge * waves, nodes


def ball_mesh(levels: int = 1, shells=(0.55, 1.0), inner: float = 0.0) -> tuple[np.ndarray, np.ndarray]:
    """A ball of `RADIUS` in shells of curved elements; with `inner` > 0 a wall from that share of the radius."""
    sphere, triangles = icosphere(levels, 1.0)
    radii, n = [*([inner] if inner else []), *shells], len(sphere)
    points = np.vstack([np.zeros((0 if inner else 1, 3)), *(radius * sphere for radius in radii)])
    first, ordered = 0 if inner else 1, np.sort(triangles, axis=1)
    centre = np.zeros(len(triangles), dtype=int)
    parts = [] if inner else [np.column_stack([centre, first + ordered])]
    for shell in range(len(radii) - 1):
        a, b, c = (first + shell * n + ordered).T
        p, q, r = (first + (shell + 1) * n + ordered).T
        parts += [np.column_stack(part) for part in ((a, b, c, r), (a, b, q, r), (a, p, q, r))]
    tetrahedra = upright(points, np.vstack(parts))
    points, nodes = second_order(points, tetrahedra)
    count = int(tetrahedra.max()) + 1
    reach = np.linalg.norm(points[:count], axis=1)
    distance = np.zeros(len(points))
    for a, (i, j) in enumerate(PAIRS, start=4):
        distance[nodes[:, a]] = 0.5 * (reach[nodes[:, i]] + reach[nodes[:, j]])
    middle = points[count:]
    points[count:] = middle * (distance[count:] / np.linalg.norm(middle, axis=1))[:, None]
    return RADIUS * points, nodes


def upright(points: np.ndarray, tetrahedra: np.ndarray) -> np.ndarray:
    """The same with positive volumes."""
    a, b, c, d = points[tetrahedra].transpose(1, 0, 2)
    negative = np.einsum("ij,ij->i", np.cross(b - a, c - a), d - a) < 0
    return np.where(negative[:, None], tetrahedra[:, [0, 2, 1, 3]], tetrahedra)


def lumen_of(points: np.ndarray, nodes: np.ndarray) -> np.ndarray:
    """Facets of the inner sheet of a hollow body, turned so that they enclose it, (f, 6)."""
    facets = boundary_facets(nodes)
    centre = points.mean(axis=0)
    x = points[facets[:, :3]]
    away = np.einsum("fi,fi->f", np.cross(x[:, 1] - x[:, 0], x[:, 2] - x[:, 0]), x.mean(axis=1) - centre)
    return facets[away < 0][:, [0, 2, 1, 5, 4, 3]]


def hollow_ball(mixed: bool = False, **options) -> Body:
    """A wall between 0.6 and 1 of the radius, its lumen kept."""
    points, nodes = ball_mesh(1, (1.0,), inner=0.6)
    own = every_third(nodes) if mixed else None
    return quadratic_body(points, nodes, SOFT, lumen_of(points, nodes), own_volumes=own, **options)


def straight_hollow() -> tuple[np.ndarray, np.ndarray]:
    """A hollow block with straight sides."""
    points, _, tetrahedra, _ = hollow_block()
    return second_order(points, tetrahedra)


MESHES = {"straight": quadratic_block, "curved": curved_block, "ball": ball_mesh}


def bodies(**options) -> dict[str, Body]:
    """One of every mesh, and the hollow ball with its lumen."""
    solid = {name: quadratic_body(*mesh(), SOFT, **options) for name, mesh in MESHES.items()}
    return {**solid, "hollow": hollow_ball(**options)}


def jiggled(body: Body, share: float = 0.03, seed: int = 5) -> np.ndarray:
    """Positions [m] away from rest by `share` of the mean spring length, at random, and sheared."""
    from massspring.body.springs import lengths

    scale = share * lengths(body.rest, body.springs.ends).mean()
    shear = np.eye(3) + np.array([[0.1, 0.2, 0.0], [-0.1, -0.05, 0.1], [0.05, 0.0, 0.1]])
    return body.rest @ shear.T + scale * np.random.default_rng(seed).standard_normal(body.rest.shape)


def volumes_of(body: Body) -> PointVolumes:
    assert isinstance(body.kept, PointVolumes)
    return body.kept


def local_force(body: Body, x: np.ndarray) -> np.ndarray:
    """Of the pressure −b (J_q − 1) at the points [N], (3n,)."""
    volumes = volumes_of(body)
    pressure = -body.local_bulk * (volumes.jacobians(x) - 1.0)
    each = np.einsum("kq,kqai->kai", pressure, volumes.areas(x))
    force = np.zeros_like(x)
    np.add.at(force, volumes.cells, each)
    return force.ravel()


def shape_functions(b: np.ndarray) -> np.ndarray:
    """At barycentric places (p, 4), (p, 10), from their values at the nodes alone: a fit of all quadratics."""
    nodes = np.vstack([np.eye(4), 0.5 * (np.eye(4)[PAIRS[:, 0]] + np.eye(4)[PAIRS[:, 1]])])
    return terms(b) @ np.linalg.inv(terms(nodes))


def terms(b: np.ndarray) -> np.ndarray:
    x, y, z = b[:, 1:].T
    return np.column_stack([np.ones(len(b)), x, y, z, x * x, y * y, z * z, x * y, y * z, z * x])


def exact_volume(points: np.ndarray, cells: np.ndarray) -> float:
    """Of curved elements: det dx/db is a cubic, met exactly by Gauss' three points in each collapsed direction."""
    at, weight = np.polynomial.legendre.leggauss(3)
    at, weight, step, total = 0.5 * (at + 1.0), 0.5 * weight, 1e-4, 0.0
    for (r, wr), (s, ws), (t, wt) in product(zip(at, weight, strict=True), repeat=3):
        place = np.array([r, s * (1 - r), t * (1 - r) * (1 - s)])
        sides = []
        for axis in np.eye(3):
            ends = np.array([place - step * axis, place + step * axis])
            b = np.column_stack([1.0 - ends.sum(axis=1), ends])
            sides.append(np.tensordot(np.diff(shape_functions(b), axis=0)[0] / (2 * step), points[cells], (0, 1)))
        total += wr * ws * wt * (1 - r) ** 2 * (1 - s) * float(np.linalg.det(np.stack(sides, axis=1)).sum())
    return total


MU = SOFT.shear_modulus


def linear_solid(cells=(3, 3, 2), **options) -> Body:
    """Linear tetrahedra with one volume per node."""
    body = tetrahedral_body(*block(cells, **options), SOFT, "cotangent")
    return body.keeping(Volumes.nodal(body))


def curved_solid(**options) -> Body:
    """Quadratic tetrahedra with bent sides."""
    return quadratic_body(*curved_block(), SOFT, **options)


def mixed_solid(make=curved_block, **options) -> Body:
    """The same with a volume of its own in every third element."""
    points, cells = make()
    return quadratic_body(points, cells, SOFT, own_volumes=every_third(cells), **options)


def every_third(cells: np.ndarray) -> np.ndarray:
    return np.arange(len(cells)) % 3 == 0


def straight_solid(cells=(2, 2, 2), distortion=0.15, **options) -> Body:
    """Quadratic tetrahedra with straight sides."""
    return quadratic_body(*quadratic_block(cells, distortion=distortion), SOFT, **options)


def deformation(body: Body, x: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """F at the points of all elements at `x` (n, 3), (p, 3, 3), and their weights [m³], (p,)."""
    if isinstance(body.kept, PointVolumes):
        return body.kept.deformation(x).reshape(-1, 3, 3), body.kept.weight.ravel()
    edges = Edges(body.rest, body.tetrahedra)
    return np.einsum("kai,kaj->kij", x[body.tetrahedra], edges.gradients()), edges.volumes


def energy_without_volume(body: Body, x: np.ndarray) -> float:
    """∫ mu/2 (|F|² − 3) − mu (J − 1) + b/2 (J − 1)² [J], straight from the definition."""
    f, weight = deformation(body, x)
    j = np.linalg.det(f)
    density = MU / 2 * ((f * f).sum(axis=(1, 2)) - 3) - MU * (j - 1) + body.local_bulk / 2 * (j - 1) ** 2
    return float(weight @ density)


def nodal_energy(body: Body, x: np.ndarray, ratio: float) -> float:
    """The same with K/2 Σ V0_r (V_r/V0_r − 1)²: a pressure for each kept volume."""
    strain = body.kept.measure(x) / body.rest_volumes - 1
    return energy_without_volume(body, x) + 0.5 * ratio * MU * float(body.rest_volumes @ strain**2)


def uniaxial(stretch: float, bulk: float) -> tuple[float, float]:
    """(stretch across, nominal stress [Pa]) of a bar drawn to `stretch` with free sides, W = mu/2 (|F|² − 3) − mu
    (J − 1) + bulk/2 (J − 1)² [Pa].

    Free sides: mu c = (mu − bulk (J − 1)) · a c with the stretch along a, J = a c²; stress mu a − (mu − bulk (J − 1))
    c².
    """
    a = stretch

    def side(c: float) -> float:
        return MU - (MU - bulk * (a * c * c - 1.0)) * a

    c = float(brentq(side, 0.3, 3.0, xtol=1e-15))
    return c, MU * a - (MU - bulk * (a * c * c - 1.0)) * c * c


def stretched(rest: np.ndarray, stretch: float, bulk: float) -> np.ndarray:
    """A body in uniaxial stretch along z."""
    across, _ = uniaxial(stretch, bulk)
    return rest * np.array([across, across, stretch])
