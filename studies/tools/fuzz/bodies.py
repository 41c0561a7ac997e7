"""Bodies that no mesher would make: Delaunay meshes of random points, drawn out, flattened, in two parts."""

from dataclasses import replace

import numpy as np
from scipy.spatial import Delaunay

from massspring import Body, Material, Volumes, quadratic_body, surface_body, tetrahedral_body
from massspring.body.points import PAIRS
from studies.geometry import organ
from studies.geometry.mesh.organ_mesh import boundary_triangles, surface_first, tetrahedron_volumes
from studies.tools.fuzz.trial import ORGANS, QUADRATIC, SURFACE, Trial

RADIUS, DENSITY = 0.05, 1000.0
FLATTEST = 1e-12
"""Volume of a tetrahedron over the cube of the radius below which it is none: Delaunay leaves such at the hull."""
STRETCH = {"needle": (20.0, 1.0, 1.0), "sheet": (1.0, 1.0, 0.03)}
ORGAN_NODES = 150, 230
REGIONS = 4
Mesh = tuple[np.ndarray, np.ndarray]


def body_of(trial: Trial) -> Body:
    """The body of a trial. Raises MassSpringError or StudyError for one that cannot be."""
    points, cells = mesh_of(trial)
    points = points + trial.far * np.array([1.0, -1.0, 1.0]) / np.sqrt(3.0)
    material = Material(trial.modulus, DENSITY)
    body = _built(trial, points, cells, material)
    rng = np.random.default_rng((trial.seed, trial.number, 2))
    if trial.heaviest > 1.0:
        body = replace(body, mass=body.mass * trial.heaviest ** rng.random(body.node_count))
    return body


def _built(trial: Trial, points: np.ndarray, cells: np.ndarray, material: Material) -> Body:
    if trial.kind == QUADRATIC:
        return quadratic_body(*second_order(points, cells), material)
    if trial.kind == SURFACE:
        points, triangles, _, count = surface_first(points, cells)
        return surface_body(points[:count], triangles, material)
    body = tetrahedral_body(points, boundary_triangles(cells), cells, material, trial.law)
    kept = {"nodal": Volumes.nodal, "patches": Volumes.patches, "regions": lambda b: Volumes.regions(b, REGIONS)}
    return body.keeping(kept[trial.volumes](body)) if trial.volumes in kept else body


def mesh_of(trial: Trial) -> Mesh:
    """Points (n, 3) [m] and tetrahedra (k, 4), positive."""
    rng = np.random.default_rng((trial.seed, trial.number, 1))
    if trial.shape in ORGANS:
        mesh = organ(trial.shape, ORGAN_NODES[trial.nodes % len(ORGAN_NODES)])
        return mesh.points, mesh.tetrahedra
    if trial.shape == "cell":
        return upright(RADIUS * rng.standard_normal((4, 3)), np.array([[0, 1, 2, 3]]))
    points, cells = cloud(rng, trial.nodes, trial.shape == "sliver")
    if trial.shape == "two":
        other, more = cloud(rng, trial.nodes)
        return np.vstack([points, other + 3 * RADIUS * np.eye(3)[2]]), np.vstack([cells, more + len(points)])
    return upright(points * STRETCH.get(trial.shape, (1.0, 1.0, 1.0)), cells)


def cloud(rng: np.random.Generator, nodes: int, slivers: bool = False) -> Mesh:
    """Random points in a ball and what Delaunay makes of them; `slivers`: a third of them nearly in one plane."""
    directions = rng.standard_normal((nodes, 3))
    points = RADIUS * rng.random((nodes, 1)) ** (1 / 3) * directions / np.linalg.norm(directions, axis=1, keepdims=True)
    points[: len(points) // 3, 2] *= 1e-3 if slivers else 1.0
    return upright(points, Delaunay(points).simplices.astype(np.int64))


def upright(points: np.ndarray, cells: np.ndarray) -> Mesh:
    """With positive volumes, without cells that have none, and without points that no cell uses."""
    volume = tetrahedron_volumes(points, cells)
    cells = np.where(volume[:, None] < 0, cells[:, [0, 2, 1, 3]], cells)[np.abs(volume) > FLATTEST * RADIUS**3]
    used, cells = np.unique(cells, return_inverse=True)
    return points[used], cells.reshape(-1, 4)


def second_order(points: np.ndarray, cells: np.ndarray) -> Mesh:
    """Points and cells (k, 10), in VTK's order, of straight quadratic tetrahedra."""
    edges, middle = np.unique(np.sort(cells[:, PAIRS].reshape(-1, 2), axis=1), axis=0, return_inverse=True)
    return np.vstack([points, points[edges].mean(axis=1)]), np.hstack([cells, len(points) + middle.reshape(-1, 6)])
