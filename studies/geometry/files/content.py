"""The content of a file of any format: points, triangles or tetrahedra, and named parts."""

from dataclasses import dataclass, field

import numpy as np

from studies.base.errors import StudyError

NONE = np.empty(0, np.int64)


@dataclass(frozen=True, eq=False)
class Content:
    """The mesh of a file in the unit of the file.

    points: shape (n, 3)
    triangles: shape (t, 3)
    tetrahedra: shape (k, 4)
    point_data: name -> one row of values per point
    names: parts that the file names, in its order; empty where it names none
    part: of each triangle the index into `names`, shape (t,); empty where the file names none
    unit: what the file's format or its header says, or None
    unit_by_custom: whether the header states no unit, so that the usual one of the format is assumed
    """

    points: np.ndarray
    triangles: np.ndarray
    tetrahedra: np.ndarray
    point_data: dict[str, np.ndarray] = field(default_factory=dict)
    names: tuple[str, ...] = ()
    part: np.ndarray = field(default_factory=lambda: NONE)
    unit: str | None = None
    unit_by_custom: bool = False

    @property
    def cells(self) -> np.ndarray:
        """The tetrahedra where there are any, else the triangles."""
        return self.tetrahedra if len(self.tetrahedra) else self.triangles

    @property
    def longest_side(self) -> float:
        """Of the box around the finite points that a cell uses, in the file's unit; 0 where there are none."""
        used = self.points[np.unique(self.cells)] if self.has_all_points else self.points
        finite = used[np.isfinite(used).all(axis=1)]
        # Halved before the difference: coordinates may be as large as numbers get.
        return 2.0 * float(np.ptp(finite / 2.0, axis=0).max()) if len(finite) else 0.0

    @property
    def has_all_points(self) -> bool:
        """Whether no cell names a point that is not there."""
        return bool(self.cells.min(initial=0) >= 0 and self.cells.max(initial=-1) < len(self.points))


def check_content(content: Content, name: str) -> Content:
    """The content, if it has cells whose points are there, with three coordinates each; else raises StudyError."""
    points = content.points
    if not points.size:
        raise StudyError(f"{name}: the file has no points; export a surface or a volume mesh")
    if points.ndim != 2 or points.shape[1] != 3:
        raise StudyError(f"{name}: points have shape {points.shape}; a body needs three coordinates per point")
    if not len(content.cells):
        raise StudyError(f"{name}: the file has no triangles and no tetrahedra; export a surface or a volume mesh")
    if not content.has_all_points:
        worst = int(content.cells.max()) if content.cells.min() >= 0 else int(content.cells.min())
        raise StudyError(
            f"{name}: a cell uses point {worst}, but the file has only {len(points)} points; export it again"
        )
    return content


def fans(polygons: np.ndarray) -> np.ndarray:
    """Triangles (k (m - 2), 3) of convex polygons (k, m), each a fan from its first corner."""
    corners = polygons.shape[1]
    return np.concatenate(
        [np.empty((0, 3), np.int64), *(polygons[:, [0, k, k + 1]] for k in range(1, corners - 1))]
    ).reshape(-1, 3)
