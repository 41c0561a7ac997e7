"""An organ's mesh of quadratic elements whose sides follow its true shape as far as none of them folds."""

import warnings
from dataclasses import replace

import numpy as np

from studies.geometry import CurvedMesh, OrganMesh, curved
from studies.geometry.mesh.quality import PAIRS
from studies.geometry.shape.levelset import Shape
from studies.meshing.shaping import moved, upright_against


def curved_mesh(mesh: OrganMesh, shape: Shape | None = None) -> CurvedMesh:
    """`studies.geometry.curved`, but where an element would fold, its sides are curved less, and a warning states the
    deviation.

    shape: the true shape of a scan, which its recipe does not contain. Raises StudyError as `studies.geometry.curved`.
    """
    target = curved(mesh, may_fold=True, shape=shape)
    if target.smallest_jacobian > 0.0:
        return target
    straight = target.points.copy()
    straight[target.cells[:, 4:]] = mesh.points[mesh.tetrahedra[:, np.array(PAIRS)]].mean(axis=2)
    points = moved(straight, target.points, target.cells, upright_against(straight, target.cells), mesh.name)
    off = np.linalg.norm(points - target.points, axis=1)
    boundary = np.isin(np.arange(len(points)), boundary_facets(mesh, target.cells))
    held = boundary & (off > 0.0)
    if held.any():
        warnings.warn(
            f"{mesh.name}: {int(held.sum())} of {int(boundary.sum())} boundary nodes stay up to "
            f"{1e3 * off[held].max():.2g} mm off the true shape, or elements would fold; use more nodes",
            stacklevel=2,
        )
    return replace(target, points=points)


def boundary_facets(mesh: OrganMesh, cells: np.ndarray) -> np.ndarray:
    """The boundary of the quadratic elements `cells` (k, 10) of a mesh, (t, 6): corners, then the nodes between first
    and second, second and third, third and first."""
    count = len(mesh.points)
    sides = np.sort(cells[:, np.array(PAIRS)].reshape(-1, 2), axis=1) @ [count, 1]
    keys, first = np.unique(sides, return_index=True)
    middles = cells[:, 4:].ravel()[first]
    pairs = [np.sort(mesh.triangles[:, pair], axis=1) @ [count, 1] for pair in ([0, 1], [1, 2], [2, 0])]
    return np.column_stack([mesh.triangles, *(middles[np.searchsorted(keys, pair)] for pair in pairs)])
