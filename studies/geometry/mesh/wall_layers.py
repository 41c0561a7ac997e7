"""The wall of a hollow organ: layers of prisms between its surface and its lumen, cut into tetrahedra.

A general mesher cannot fill well a wall that is thinner than the edges of the mesh. Here every node of the outer
surface has a partner on the lumen, so the fill conforms by construction, and the quality of its elements depends mainly
on the ratio of wall thickness to edge length.
"""

from itertools import pairwise

import numpy as np

from studies.base.errors import StudyError
from studies.geometry.mesh.organ_mesh import mean_edge, vertex_normals
from studies.geometry.mesh.quality import MIN_WALL_RATIO, tetrahedron_radius_ratio
from studies.geometry.mesh.smooth_nodes import mend_nodes
from studies.geometry.shape.levelset import Shape, at_depth, project

LONGEST_STEP = 0.5
"""Largest inward step of the surface, in mean edges, before its normals are computed again."""
GOOD_WALL_RATIO = 0.2
"""Radius ratio below which the nodes of an element are moved, except those of the outer surface."""
MOST_LAYERS = 12


def suggested_layers(points: np.ndarray, triangles: np.ndarray, wall: float) -> int:
    """Number of layers, 1 to MOST_LAYERS, that makes the prisms of a wall [m] about as high as their edges are long."""
    return int(np.clip(round(wall / mean_edge(points, triangles)), 1, MOST_LAYERS))


def fill_wall(
    shape: Shape, points: np.ndarray, triangles: np.ndarray, layers: int | None
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Points (n (layers + 1), 3) [m], triangles (2 t, 3) and tetrahedra (3 layers t, 4) of the wall of a hollow shape.

    points (n, 3) [m] on f = 0 and triangles (t, 3) are the outer surface, whose nodes come first; then those of the
    lumen, whose node i + n faces node i; then those of the layers between, from outside. The triangles of the lumen
    look out of the tissue. layers: None: `suggested_layers`. Raises StudyError for a solid shape, for layers outside 1
    to MOST_LAYERS, and for a wall that does not fit or folds or flattens elements.
    """
    if shape.wall is None:
        raise StudyError(f"{shape.name} is solid; give it a wall to make it hollow")
    layers = suggested_layers(points, triangles, shape.wall) if layers is None else layers
    if not 1 <= layers <= MOST_LAYERS:
        raise StudyError(f"{shape.name}: {layers} layers asked for its wall; choose 1 to {MOST_LAYERS}")
    rings = offset_rings(shape, points, triangles, layers)
    count = len(points)
    # Nodes of ring k start at first[k]; those of the lumen directly follow those of the outer surface.
    first = np.array([0, *range(2 * count, (layers + 1) * count, count), count])
    tetrahedra = split_prisms(triangles, first)
    everything = mend_wall(shape, np.concatenate([rings[0], rings[-1], *rings[1:-1]]), tetrahedra, layers)
    worst = float(tetrahedron_radius_ratio(everything, tetrahedra).min())
    if worst < MIN_WALL_RATIO:
        raise StudyError(
            f"{shape.name}: its wall of {1e3 * shape.wall:.3g} mm folds or flattens an element at {count} surface nodes"
            f" (radius ratio {worst:.2g} under {MIN_WALL_RATIO:g}); use more nodes or a thinner wall"
        )
    return everything, np.concatenate([triangles, triangles[:, ::-1] + count]), tetrahedra


def mend_wall(shape: Shape, points: np.ndarray, tetrahedra: np.ndarray, layers: int) -> np.ndarray:
    """The points (n (layers + 1), 3) [m] after nodes of poor elements moved on their level sets, except outer nodes."""
    count = len(points) // (layers + 1)
    wall = float(shape.wall or 0.0)
    depths = wall * np.repeat([0.0, 1.0, *np.arange(1, layers) / layers], count)

    def bring(nodes: np.ndarray, places: np.ndarray) -> np.ndarray:
        return project(at_depth(shape, float(depths[nodes[0]])), places)

    return mend_nodes(points, tetrahedra, np.arange(len(points)) >= count, bring, GOOD_WALL_RATIO)


def offset_rings(shape: Shape, points: np.ndarray, triangles: np.ndarray, layers: int) -> list[np.ndarray]:
    """Nodes of the layers from the outer surface (first) to the lumen f = -wall (last), each (n, 3) [m].

    The nodes take short steps along the normals of the triangulation, which fan out less in a crease than those of f.
    Each step ends exactly on its level. Raises StudyError for a wall that does not fit into the shape.
    """
    wall = float(shape.wall or 0.0)
    steps = max(1, int(np.ceil(wall / layers / (LONGEST_STEP * mean_edge(points, triangles)))))
    rings = [points]
    try:
        for layer in range(layers):
            x = rings[-1]
            for step in range(1, steps + 1):
                depth = wall * (layer + step / steps) / layers
                inward = -vertex_normals(x, triangles) * (wall / layers / steps)
                x = project(at_depth(shape, depth), x + inward)
            rings.append(x)
    except StudyError as error:
        raise StudyError(
            f"{shape.name}: a wall of {1e3 * wall:.3g} mm does not fit into it; make it thinner or the organ larger"
        ) from error
    return rings


def split_prisms(triangles: np.ndarray, first: np.ndarray) -> np.ndarray:
    """Tetrahedra, shape (3 layers t, 4), of positive volume, of the prisms between rings of nodes.

    triangles (t, 3): outward on the outermost ring; first (layers + 1,): index of node 0 of each ring, outermost first.
    A diagonal joins the outer node of the lower column number to the inner node of the higher one, so neighbours agree.
    """
    columns = np.sort(triangles, axis=1)
    even = (np.argsort(triangles, axis=1, kind="stable") * [1, 3, 9]).sum(axis=1)
    # Orders 012, 120, 201 keep the orientation of the triangle.
    even = np.isin(even, [0 + 3 + 18, 1 + 6 + 0, 2 + 0 + 9])
    a, b, c = columns.T
    cells = []
    for above, below in pairwise(first):
        cells += [
            np.stack([a + above, b + above, c + above, c + below], axis=1),
            np.stack([a + above, b + above, c + below, b + below], axis=1),
            np.stack([a + above, b + below, c + below, a + below], axis=1),
        ]
    tetrahedra = np.concatenate(cells)
    # With outward triangles the fourth node lies behind the first three, so two of them are swapped.
    turned = np.tile(even, len(cells))
    tetrahedra[turned] = tetrahedra[turned][:, [0, 2, 1, 3]]
    return tetrahedra
