"""General calls of gmsh, in the worker process only: gmsh may hang or crash, and is not thread-safe."""

from collections.abc import Iterator
from contextlib import contextmanager

import gmsh
import numpy as np

from studies.base.errors import StudyError
from studies.geometry.mesh.organ_mesh import boundary_triangles, same_triangles, tetrahedron_volumes
from studies.geometry.shape.regions import Region

TRIANGLE, TETRAHEDRON = 2, 4


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
        if graded:
            grow_inwards(surface, points)
        gmsh.model.mesh.generate(3)
        tags, all_points, tetrahedra = read_elements(TETRAHEDRON)
    count = len(points)
    if len(tags) < count or (tags[:count] != np.arange(1, count + 1)).any():
        raise StudyError("gmsh dropped nodes of the surface when filling it; repair the surface first")
    if (all_points[:count] != points).any() or not same_triangles(boundary_triangles(tetrahedra), triangles):
        raise StudyError("gmsh changed the surface when filling it; repair the surface first")
    inverted = tetrahedron_volumes(all_points, tetrahedra) < 0
    tetrahedra[inverted] = tetrahedra[inverted][:, [0, 2, 1, 3]]
    return all_points, tetrahedra


def grow_inwards(surface: int, points: np.ndarray) -> None:
    """Lets elements grow inwards from the size of the facets to an eighth of the smallest extent of the body."""
    extent = float(np.ptp(points, axis=0).min())
    field = gmsh.model.mesh.field.add("Extend")
    gmsh.model.mesh.field.setNumbers(field, "SurfacesList", [surface])
    gmsh.model.mesh.field.setNumber(field, "DistMax", extent / 2.0)
    gmsh.model.mesh.field.setNumber(field, "SizeMax", extent / 8.0)
    gmsh.model.mesh.field.setAsBackgroundMesh(field)
    gmsh.option.setNumber("Mesh.MeshSizeExtendFromBoundary", 0)
