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
    point_data: name -> values, one row per point
    names: names of the parts in the order of the file; empty if it has none
    part: index into `names` of each triangle, shape (t,); empty if the file has no names
    unit: the unit that the header or the format defines, or the usual one of the format; None if it is unknown
    unit_by_custom: whether `unit` is only the usual one of the format, because the header states none
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
        """The tetrahedra (k, 4) if there are any, else the triangles (t, 3)."""
        return self.tetrahedra if len(self.tetrahedra) else self.triangles

    @property
    def longest_side(self) -> float:
        """Longest side of the box around the finite points of the cells, in the unit of the file; 0 without points.

        If a cell uses a point that does not exist, all finite points count.
        """
        used = self.points[np.unique(self.cells)] if self.has_all_points else self.points
        finite = used[np.isfinite(used).all(axis=1)]
        # Halved before the difference, which could overflow.
        return 2.0 * float(np.ptp(finite / 2.0, axis=0).max()) if len(finite) else 0.0

    @property
    def has_all_points(self) -> bool:
        """Whether all points that cells use exist."""
        return bool(self.cells.min(initial=0) >= 0 and self.cells.max(initial=-1) < len(self.points))


def check_content(content: Content, name: str) -> Content:
    """The content unchanged; name: of the file.

    Raises StudyError unless it has cells, all their points exist, and points have three coordinates.
    """
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
    """Triangles (k (m - 2), 3) of convex polygons (k, m): each polygon becomes a fan from its first corner."""
    corners = polygons.shape[1]
    return np.concatenate(
        [np.empty((0, 3), np.int64), *(polygons[:, [0, k, k + 1]] for k in range(1, corners - 1))]
    ).reshape(-1, 3)
