"""Cuts through meshes made without a mesher: faces between the layers of a block."""

import numpy as np

from massspring import Material, Volumes, quadratic_body, tetrahedral_body
from massspring.body.opening import Opening, opened
from massspring.body.partition import tetrahedron_faces
from tests.massspring.conftest import SOFT, block, boundary
from tests.massspring.quadratic import second_order

CELLS = (4, 3, 3)


def layer_faces(tetrahedra: np.ndarray, cells=CELLS, at: int = 2, reach: float = np.inf) -> np.ndarray:
    """Faces of a block's mesh between its layers `at` and `at` + 1 along x, fronts to +x, up to height `reach` of z."""
    x, _, z = np.unravel_index(np.arange(np.prod(np.add(cells, 1))), np.add(cells, 1))
    faces, _, second = tetrahedron_faces(tetrahedra)
    faces = faces.astype(np.int64)
    chosen = (x[faces] == at).all(axis=1) & (z[faces] <= reach).all(axis=1) & (second >= 0)
    grid = np.stack(np.unravel_index(np.arange(len(x)), np.add(cells, 1)), axis=1)
    a, b, c = grid[faces[chosen]].transpose(1, 0, 2)
    turned = np.cross(b - a, c - a)[:, 0] < 0
    faces = faces[chosen]
    faces[turned] = faces[turned][:, ::-1]
    return faces


def cut_block(reach: float = np.inf, cells=CELLS, quadratic: bool = False) -> tuple[np.ndarray, np.ndarray, Opening]:
    """Points and cells of a block, and the same opened along x between its middle layers."""
    points, _, tetrahedra = block(cells)
    faces = layer_faces(tetrahedra, cells, cells[0] // 2, reach)
    if quadratic:
        points, tetrahedra = second_order(points, tetrahedra)
    return points, tetrahedra, opened(tetrahedra, faces, len(points))


def body_of_cells(points: np.ndarray, cells: np.ndarray, law: str = "van_gelder", material: Material = SOFT):
    """A body of linear or quadratic cells, one volume per vertex for springs without length."""
    if cells.shape[1] == 10:
        return quadratic_body(points, cells, material)
    body = tetrahedral_body(points, boundary(cells), cells, material, law)
    return body.keeping(Volumes.nodal(body)) if body.rest_pressure else body


def mirrored_block() -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Points and cells of a distorted block that is its own mirror image, 0.04 m on both sides of its middle plane, and
    the faces in that plane, fronts to +x."""
    points, _, cells = block((2, 3, 3))
    flat = np.unravel_index(np.arange(len(points)), (3, 4, 4))[0] == 2
    points[flat, 0] = 0.04
    other = np.where(flat, np.arange(len(points)), len(points) + np.cumsum(~flat) - 1)
    cells = np.vstack([cells, other[cells][:, [0, 2, 1, 3]]])
    points = np.vstack([points, points[~flat] * [-1, 1, 1] + [0.08, 0, 0]])
    all_faces, _, second = tetrahedron_faces(cells)
    faces = all_faces.astype(np.int64)[second >= 0]
    faces = faces[(points[faces][:, :, 0] == 0.04).all(axis=1)]
    a, b, c = points[faces].transpose(1, 0, 2)
    turned = np.cross(b - a, c - a)[:, 0] < 0
    faces[turned] = faces[turned][:, ::-1]
    return points, cells, faces
