"""Second-order meshes that follow the true shape."""

from dataclasses import dataclass

import numpy as np
from scipy.sparse import coo_array, csr_array, diags_array
from scipy.sparse.linalg import cg

from studies.base.errors import StudyError
from studies.geometry.mesh.organ_mesh import OrganMesh, counted_edges, tetrahedron_volumes, unique_edges
from studies.geometry.mesh.quality import PAIRS, curved_volume, scaled_coefficients, smallest_jacobian
from studies.geometry.mesh.smooth_nodes import trial_moves
from studies.geometry.organs import make_shape
from studies.geometry.shape.levelset import Shape, at_depth, project
from studies.geometry.shape.regions import Region, region_from_dict

GOOD = 0.1
"""If the Jacobian of an element may fall below this fraction of the straight one, its inner mid-side nodes move."""
ROUNDS = 30
REACH = (0.2, 0.1, 0.04, 0.01, 0.003)
"""Trial moves in lengths of the edge."""
MOST_BAD = 0.05
"""Share of such elements beyond which moves of single nodes cannot repair the mesh."""


@dataclass(frozen=True, eq=False)
class CurvedMesh:
    """Quadratic tetrahedra whose mid-side nodes on the boundary lie on the true surface, none folded unless that was
    allowed. If the vertices lie on it too, the error of the surface is O(h^3) and that of the volume O(h^4).

    points: [m], shape (n2, 3); the vertices, numbered as in the straight mesh, come first
    cells: shape (k, 10), vertices and mid-side nodes in the order of the quadratic tetrahedron of VTK
    vertex_count: number of vertices
    """

    points: np.ndarray
    cells: np.ndarray
    vertex_count: int

    @property
    def volume(self) -> float:
        return curved_volume(self.points, self.cells)

    @property
    def smallest_jacobian(self) -> float:
        """Lower bound of the Jacobian over that of the straight element [1]; if positive, no element is folded."""
        return float(smallest_jacobian(self.points, self.cells).min())


def true_surfaces(mesh: OrganMesh, shape: Shape | None = None) -> list[tuple[np.ndarray, Shape]]:
    """Triangles (t, 3) of each curved part of the boundary, and the shape whose f = 0 they approximate.

    shape: the true shape of a scan, which its recipe does not contain. Raises StudyError if it is unknown.
    """
    if mesh.recipe.get("kind") == "organ":
        shape = make_shape(mesh.recipe["organ"], mesh.recipe["parameters"])
    if shape is None:
        raise StudyError(
            f"{mesh.name}: its true shape is not known, so it cannot be curved; ask for a number of nodes (--nodes)"
        )
    outer = [(mesh.outer_triangles, shape)]
    return [*outer, (mesh.lumen_triangles, at_depth(shape, shape.wall or 0.0))] if mesh.hollow else outer


def true_outlines(mesh: OrganMesh) -> list[tuple[np.ndarray, Region]]:
    """The edges (e, 2) of the outline of each attachment, and the region whose level = 0 they approximate."""
    outlines = []
    for name, data in mesh.recipe.get("regions", {}).items():
        edges, count = counted_edges(mesh.patch_triangles(name))
        outlines.append((edges[count == 1], region_from_dict(data)))
    return outlines


def make_curved(mesh: OrganMesh, may_fold: bool = False, shape: Shape | None = None) -> CurvedMesh:
    """The second-order mesh of a filled organ: mid-side nodes of the boundary lie on the true surfaces and outlines,
    the inner ones follow them.

    shape: as in `true_surfaces`. Raises StudyError for a mesh without tetrahedra or true shape, and (unless `may_fold`)
    for one so coarse that an element folds.
    """
    if not len(mesh.tetrahedra):
        raise StudyError(f"{mesh.name}: only a filled mesh can be curved; ask for fill=True")
    count = len(mesh.points)
    ends = np.sort(mesh.tetrahedra[:, np.array(PAIRS)].reshape(-1, 2), axis=1)
    edges, middle = np.unique(ends, axis=0, return_inverse=True)
    middle = middle.reshape(-1, 6)
    cells = np.concatenate([mesh.tetrahedra, count + middle], axis=1)
    moved = np.zeros((len(edges), 3))
    key = edges @ [count, 1]
    surfaces = true_surfaces(mesh, shape)
    for triangles, true in surfaces:
        here = np.searchsorted(key, unique_edges(triangles) @ [count, 1])
        straight = mesh.points[edges[here]].mean(axis=1)
        moved[here] = project(true, straight) - straight
    for rim, region in true_outlines(mesh):
        here = np.searchsorted(key, rim @ [count, 1])
        straight = mesh.points[rim].mean(axis=1)
        moved[here] = project(surfaces[0][1], straight, (region.level,)) - straight
    fixed = np.isin(key, unique_edges(mesh.triangles) @ [count, 1])
    moved = spread(mesh, middle, moved, fixed)
    points = np.concatenate([mesh.points, mesh.points[edges].mean(axis=1) + moved])
    points = unfold(points, cells, np.concatenate([np.zeros(count, bool), ~fixed]))
    worst = smallest_jacobian(points, cells)
    if worst.min() <= 0 and not may_fold:
        raise StudyError(
            f"{mesh.name}: {int((worst <= 0).sum())} of {len(cells)} elements fold when they follow the true shape at "
            f"{mesh.outer_count} surface nodes; use more nodes"
        )
    return CurvedMesh(points, cells, count)


def spread(mesh: OrganMesh, middle: np.ndarray, moved: np.ndarray, fixed: np.ndarray) -> np.ndarray:
    """Harmonic extension of the displacements of fixed mid-side nodes to all of them [m], shape (e, 3): the least
    integral of |grad u|^2 with the vertices at rest, so its condition number does not grow with refinement.

    middle (k, 6): mid-side nodes of each tetrahedron; moved (e, 3) [m]; fixed (e,) bool. Raises StudyError if the
    linear solver fails.
    """
    count = len(moved)
    rows, columns = np.repeat(middle, 6, axis=1).ravel(), np.tile(middle, (1, 6)).ravel()
    values = middle_stiffness(mesh.points, mesh.tetrahedra).ravel()
    stiffness = csr_array(coo_array((values, (rows, columns)), shape=(count, count)))
    free = np.flatnonzero(~fixed)
    matrix, load = stiffness[free][:, free], -(stiffness[free] @ moved)
    moved = moved.copy()
    for axis in range(3):
        solution, failed = cg(matrix, load[:, axis], rtol=1e-8, M=diags_array(1.0 / matrix.diagonal()))
        if failed:
            raise StudyError(f"{mesh.name}: its second-order nodes cannot be placed, the fill is too flat; mesh again")
        moved[free, axis] = solution
    return moved


def middle_stiffness(points: np.ndarray, tetrahedra: np.ndarray) -> np.ndarray:
    """Integrals of grad N_a . grad N_b [m], shape (k, 6, 6), of the quadratic functions N = 4 L_i L_j of the edges.

    Closed form from the constant gradients of the barycentric L and from int L_i L_j = V (1 + delta_ij) / 20.
    """
    x = points[tetrahedra]
    slopes = np.linalg.inv(x[:, 1:] - x[:, :1]).transpose(0, 2, 1)
    slopes = np.concatenate([-slopes.sum(axis=1, keepdims=True), slopes], axis=1)
    gram = np.einsum("kid,kjd->kij", slopes, slopes)
    mass = 16.0 / 20.0 * (1.0 + np.eye(4))
    stiffness = np.empty((len(tetrahedra), 6, 6))
    for a, (i, j) in enumerate(PAIRS):
        for b, (m, n) in enumerate(PAIRS):
            stiffness[:, a, b] = (
                mass[i, m] * gram[:, j, n]
                + mass[i, n] * gram[:, j, m]
                + mass[j, m] * gram[:, i, n]
                + mass[j, n] * gram[:, i, m]
            )
    return stiffness * tetrahedron_volumes(points, tetrahedra)[:, None, None]


def unfold(points: np.ndarray, cells: np.ndarray, movable: np.ndarray) -> np.ndarray:
    """The points after the movable mid-side nodes of nearly folded elements moved to reduce the folds around them.

    points (n, 3) [m], cells (k, 10), movable (n,) bool.
    """
    points = points.copy()
    trials = trial_moves(REACH)
    for _ in range(ROUNDS):
        jacobian = smallest_jacobian(points, cells)
        bad = np.flatnonzero(jacobian < GOOD)
        if len(bad) > MOST_BAD * len(cells) + 1:
            break
        nodes = np.unique(cells[bad, 4:])
        gained = [move_middle(points, cells, int(node), trials) for node in nodes[movable[nodes]]]
        if not any(gained):
            break
    return points


def move_middle(points: np.ndarray, cells: np.ndarray, node: int, trials: np.ndarray) -> bool:
    """Moves one mid-side node, in place, by the best of the trial moves (m, 3) [edge lengths]; False if none helps."""
    around = cells[(cells[:, 4:] == node).any(axis=1)]
    slot = int(np.flatnonzero(around[0] == node)[0]) - 4
    i, j = PAIRS[slot]
    places = points[node] + trials * np.linalg.norm(points[around[0, i]] - points[around[0, j]])
    corners = np.where((around == node)[None, :, :, None], places[:, None, None, :], points[around][None])
    stars = np.arange(10 * len(trials) * len(around)).reshape(-1, 10)
    costs = fold_cost(corners.reshape(-1, 3), stars).reshape(len(trials), -1).sum(axis=1)
    best = int(costs.argmin())
    if costs[best] >= 0.999 * fold_cost(points, around).sum():
        return False
    points[node] = places[best]
    return True


def fold_cost(points: np.ndarray, cells: np.ndarray) -> np.ndarray:
    """Sum of exp(-c / GOOD) over the scaled coefficients c of the Jacobian, shape (k,).

    It is smooth, unlike the smallest coefficient, with which moves of single nodes get stuck if several are equal.
    """
    return np.exp(-scaled_coefficients(points, cells) / GOOD).sum(axis=1)
