"""All that gmsh does for organs, but the sections of cuts (section.py): surfaces, fills, the octant of a ball. In the
mesher's process only (process.py)."""

from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

import gmsh
import numpy as np

from studies.base.errors import StudyError
from studies.geometry.mesh.organ_mesh import boundary_triangles, same_triangles, surface_first, turn_inverted
from studies.geometry.mesh.quality import MIN_DIHEDRAL, MIN_RATIO, dihedral_angles, tetrahedron_radius_ratio
from studies.geometry.shape.regions import Region

TRIANGLE, TETRAHEDRON = 2, 4
DELAUNAY, FRONTAL, HXT = 1, 4, 10
MANY = 3000
"""Surface nodes beyond which the fill is graded, that is, elements grow inwards; else most would lie deep inside."""
FEW_ATTEMPTS = ((DELAUNAY, True, False), (FRONTAL, True, False), (HXT, False, False))
MANY_ATTEMPTS = ((HXT, False, True), (DELAUNAY, False, True), (HXT, False, False))
"""(algorithm, whether the Netgen optimiser runs, whether graded). Netgen doubles the worst angle, but takes seconds for
many elements."""


@contextmanager
def fresh_model(seed: int = 1, **options: float) -> Iterator[None]:
    """A new gmsh session; `options` such as Mesh_Algorithm=6 set "Mesh.Algorithm", the others have default values.

    Options would survive `clear`, so the session is finalised at the end. One thread, an explicit seed and no user
    configuration make a mesh a function of its recipe. Raises StudyError for an error of gmsh.
    """
    gmsh.initialize(readConfigFiles=False, interruptible=False)
    try:
        settings = {
            "General.Terminal": 0,
            "General.NumThreads": 1,
            "Mesh.RandomSeed": seed,
            "Mesh.MeshSizeFromPoints": 0,
        }
        settings |= {name.replace("_", "."): value for name, value in options.items()}
        for name, value in settings.items():
            gmsh.option.setNumber(name, value)
        yield
    except Exception as error:
        # gmsh raises plain Exceptions; a StudyError passes unchanged.
        if type(error) is Exception:
            raise StudyError(f"gmsh gave up: {error}; try another node count, or smooth the surface") from error
        raise
    finally:
        gmsh.finalize()


def add_surface(points: np.ndarray, triangles: np.ndarray) -> int:
    """Adds a triangulation to the model as one discrete surface and returns its tag. Node i gets tag i + 1."""
    tag = gmsh.model.addDiscreteEntity(2)
    gmsh.model.mesh.addNodes(2, tag, np.arange(1, len(points) + 1), points.ravel())
    gmsh.model.mesh.addElementsByType(tag, TRIANGLE, [], (triangles + 1).ravel())
    return tag


def read_elements(kind: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Tags (n,) and points (n, 3) of the nodes that elements of this kind use, and the elements (k, m) by index."""
    tags, coordinates, _ = gmsh.model.mesh.getNodes()
    _, corners = gmsh.model.mesh.getElementsByType(kind)
    width = 3 if kind == TRIANGLE else 4
    order = np.argsort(tags)
    used = np.unique(corners)
    points = np.asarray(coordinates).reshape(-1, 3)[order][np.searchsorted(tags[order], used)]
    return used, points, np.searchsorted(used, corners).reshape(-1, width).astype(np.int64)


class Remesher:
    """A surface that is parametrised once and meshed with any number of sizes. Use inside `fresh_model`."""

    def __init__(self, points: np.ndarray, triangles: np.ndarray):
        """Parametrise a closed triangulation: points (n, 3) [m], triangles (t, 3)."""
        add_surface(points, triangles)
        gmsh.model.mesh.classifySurfaces(np.pi, True, True, np.pi)
        gmsh.model.mesh.createGeometry()
        gmsh.option.setNumber("Mesh.MeshSizeExtendFromBoundary", 0)
        self.center = points.mean(axis=0)
        self.regions: list[Region] = []

    def finer_in(self, regions: list[Region]) -> None:
        """From now on edges in the regions are half as long as elsewhere; [] makes them even again."""
        self.regions = regions
        if not regions:
            gmsh.model.mesh.removeSizeCallback()

    def mesh(self, size: float) -> tuple[np.ndarray, np.ndarray]:
        """Points (n, 3) [m] near the surface and outward triangles (t, 3) with edges of length `size` [m]."""
        gmsh.option.setNumber("Mesh.MeshSizeMin", 0.5 * size if self.regions else size)
        gmsh.option.setNumber("Mesh.MeshSizeMax", size)
        if self.regions:
            gmsh.model.mesh.setSizeCallback(lambda dim, tag, x, y, z, lc: self.size_at(size, np.array([[x, y, z]])))
        gmsh.model.mesh.clear()
        gmsh.model.mesh.generate(2)
        _, points, triangles = read_elements(TRIANGLE)
        a, b, c = (points[triangles] - self.center).transpose(1, 0, 2)
        if np.einsum("ij,ij->", a, np.cross(b, c)) < 0:
            triangles = triangles[:, ::-1].copy()
        return points, triangles

    def size_at(self, size: float, point: np.ndarray) -> float:
        """Edge length [m] at a point (1, 3) [m]: half of `size` in the regions, rising to `size` at level 2 `size`."""
        outside = min(float(region.level(point)[0]) for region in self.regions)
        return size * (0.5 + 0.25 * min(max(outside / size, 0.0), 2.0))


def fill_once(
    points: np.ndarray, triangles: np.ndarray, algorithm: int, netgen: bool, graded: bool
) -> tuple[np.ndarray, np.ndarray]:
    """Fills a closed surface: all points (n, 3) [m], those of the surface first and unchanged, and tetrahedra (k, 4).

    algorithm: number of gmsh's Mesh.Algorithm3D; netgen: whether the Netgen optimiser runs; graded: whether elements
    grow inwards. Raises StudyError if gmsh fails or changes a node or triangle of the surface.
    """
    with fresh_model(Mesh_Algorithm3D=algorithm, Mesh_Optimize=1, Mesh_OptimizeNetgen=float(netgen)):
        surface = add_surface(points, triangles)
        loop = gmsh.model.geo.addSurfaceLoop([surface])
        gmsh.model.geo.addVolume([loop])
        gmsh.model.geo.synchronize()
        if graded:  # from the size of the facets to an eighth of the smallest extent of the body
            extent, field = float(np.ptp(points, axis=0).min()), gmsh.model.mesh.field.add("Extend")
            gmsh.model.mesh.field.setNumbers(field, "SurfacesList", [surface])
            gmsh.model.mesh.field.setNumber(field, "DistMax", extent / 2.0)
            gmsh.model.mesh.field.setNumber(field, "SizeMax", extent / 8.0)
            gmsh.model.mesh.field.setAsBackgroundMesh(field)
            gmsh.option.setNumber("Mesh.MeshSizeExtendFromBoundary", 0)
        gmsh.model.mesh.generate(3)
        tags, all_points, tetrahedra = read_elements(TETRAHEDRON)
    count = len(points)
    if len(tags) < count or (tags[:count] != np.arange(1, count + 1)).any():
        raise StudyError("gmsh dropped nodes of the surface when filling it; repair the surface first")
    if (all_points[:count] != points).any() or not same_triangles(boundary_triangles(tetrahedra), triangles):
        raise StudyError("gmsh changed the surface when filling it; repair the surface first")
    return all_points, turn_inverted(all_points, tetrahedra)


def fill_surface(points: np.ndarray, triangles: np.ndarray, strict: bool = True) -> tuple[np.ndarray, np.ndarray]:
    """Fills a closed surface: all points (n, 3) [m], those of the surface first, and tetrahedra (k, 4): the best fill
    of several algorithms, tried until the worst element is good enough. Raises StudyError if all fail, and, if
    `strict`, for an element worse than MIN_DIHEDRAL or MIN_RATIO."""
    attempts, enough = (FEW_ATTEMPTS, 1.5) if len(points) <= MANY else (MANY_ATTEMPTS, 1.25)
    best: tuple[float, np.ndarray, np.ndarray] | None = None
    failures: list[str] = []
    for algorithm, netgen, graded in attempts:
        try:
            all_points, tetrahedra = fill_once(points, triangles, algorithm, netgen, graded)
        except StudyError as error:
            failures.append(str(error))
            continue
        score = fill_score(all_points, tetrahedra)
        if best is None or score > best[0]:
            best = (score, all_points, tetrahedra)
        if score >= enough:
            break
    if best is None:
        raise StudyError(f"the surface of {len(points)} nodes could not be filled with tetrahedra: {failures[-1]}")
    if strict and best[0] < 1.0:
        raise StudyError(
            f"the best fill of the surface of {len(points)} nodes has an element with a dihedral angle under "
            f"{MIN_DIHEDRAL:g} degrees or a radius ratio under {MIN_RATIO:g}; "
            "use more nodes where it is thin, or a smoother surface"
        )
    return best[1], best[2]


def fill_score(points: np.ndarray, tetrahedra: np.ndarray) -> float:
    """The smaller of worst dihedral angle and worst radius ratio, each over its limit [1]; 1 is just acceptable."""
    angle = dihedral_angles(points, tetrahedra).min() / MIN_DIHEDRAL
    ratio = tetrahedron_radius_ratio(points, tetrahedra).min() / MIN_RATIO
    return float(min(angle, ratio))


def build_octant(recipe: dict[str, Any], arrays: dict[str, np.ndarray]) -> dict[str, np.ndarray]:
    """Octant x, y, z >= 0 of the ball of `radius` [m]: the arrays of jobs.PARTS. The element size grows from `h_pole`
    [m] at (0, 0, radius) to `h` [m] at a distance of one radius. Nodes of the planes of symmetry have exactly
    coordinate 0."""
    radius, h, h_pole = recipe["radius"], recipe["h"], recipe["h_pole"]
    with fresh_model(Mesh_Algorithm3D=1, Mesh_Optimize=1, Mesh_OptimizeNetgen=1, Mesh_MeshSizeExtendFromBoundary=0):
        # Unit radius inside gmsh: its geometric tolerances are absolute.
        gmsh.model.occ.addSphere(0, 0, 0, 1.0, angle1=0, angle2=np.pi / 2, angle3=np.pi / 2)
        gmsh.model.occ.synchronize()
        size = f"{h_pole / radius!r} + {(h - h_pole) / radius!r} * Min(1, Sqrt(x*x + y*y + (z - 1)*(z - 1)))"
        field = gmsh.model.mesh.field.add("MathEval")
        gmsh.model.mesh.field.setString(field, "F", size)
        gmsh.model.mesh.field.setAsBackgroundMesh(field)
        gmsh.model.mesh.generate(3)
        _, points, tetrahedra = read_elements(TETRAHEDRON)
    points[np.abs(points) < 1e-9] = 0.0
    distance = np.linalg.norm(points, axis=1)
    on_sphere = np.abs(distance - 1.0) < 1e-9
    points[on_sphere] /= distance[on_sphere][:, None]
    points, triangles, tetrahedra, count = surface_first(radius * points, turn_inverted(points, tetrahedra))
    counts = {"surface_count": np.array(count), "outer_count": np.array(count)}
    return {"points": points, "triangles": triangles, "tetrahedra": tetrahedra, **counts}
