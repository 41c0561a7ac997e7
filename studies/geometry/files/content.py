"""The content of a file of any format: points, triangles or tetrahedra, and parts, which are separated by name if the
file has names, else by connectivity."""

from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
from scipy.spatial import KDTree

from studies.base.errors import StudyError
from studies.geometry.mesh.organ_mesh import connected

WELD = 1e-7
"""Points nearer than this fraction of the diagonal are one point: the single precision of STL files."""
LISTED = 12
"""Most parts that a sentence or a table lists."""
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
        """Longest side of the box around the finite points of the cells (all, if a cell uses a point that does not
        exist), in the unit of the file; 0 without points."""
        used = self.points[np.unique(self.cells)] if self.has_all_points else self.points
        finite = used[np.isfinite(used).all(axis=1)]
        # Halved before the difference, which could overflow.
        return 2.0 * float(np.ptp(finite / 2.0, axis=0).max()) if len(finite) else 0.0

    @property
    def has_all_points(self) -> bool:
        return bool(self.cells.min(initial=0) >= 0 and self.cells.max(initial=-1) < len(self.points))


def check_content(content: Content, name: str) -> Content:
    """The content unchanged. Raises StudyError unless it has cells, all their points exist, and points have three
    coordinates; name: of the file."""
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


def parts_in(content: Content, metres: float) -> list[dict[str, Any]]:
    """Number, name, triangles and sides of the box [m] of each part of a surface, JSON-able; metres: per unit of the
    file. The triangles are one part if the file has tetrahedra, or if a coordinate is not finite."""
    numbers, names = numbered(content)
    rows = []
    for k in range(int(numbers.max(initial=-1)) + 1):
        own = content.triangles[numbers == k]
        size = np.ptp(content.points[np.unique(own)], axis=0) if len(own) else np.zeros(3)
        row = {"number": k + 1, "name": names[k] if names else "", "triangles": len(own)}
        rows.append(row | {"size": [metres * side for side in size.tolist()]})
    return rows


def chosen(content: Content, part: str | None, name: str) -> Content:
    """The content reduced to `part`, given by name or number; None: all of it. Raises StudyError for an unknown part,
    and for a part of a body of tetrahedra; name: of the file."""
    if part is None:
        return content
    if len(content.tetrahedra):
        raise StudyError(f"{name} holds one body of tetrahedra and no parts; leave --part out")
    numbers, names = numbered(content)
    count = int(numbers.max(initial=-1)) + 1
    by_number = {str(k + 1): k for k in range(count)}
    by_name = {label.lower(): k for k, label in reversed(list(enumerate(names)))}
    number = by_name.get(part.lower(), by_number.get(part))
    if number is None:
        raise StudyError(f"{name} has {listed(names, count)}; there is no {part!r} among them")
    return replace(content, triangles=content.triangles[numbers == number], names=(), part=numbers[:0])


def listed(names: tuple[str, ...], count: int) -> str:
    if not names:
        return f"{count} part{'s' * (count != 1)}, numbered from 1 by their size"
    more = f" and {count - LISTED} more" if count > LISTED else ""
    return f"the parts {', '.join(names[:LISTED])}{more}"


def numbered(content: Content) -> tuple[np.ndarray, tuple[str, ...]]:
    """The number of the part of each triangle from 0, (t,), and the names of the parts; without names the parts are the
    connected ones, the one with the largest box first."""
    if content.names:
        return content.part, content.names
    finite = np.isfinite(content.points).all()
    if len(content.tetrahedra) or not len(content.triangles) or not finite:
        return np.zeros(len(content.triangles), np.int64), ()
    same = coincident(content.points)[content.triangles]
    label = connected(np.concatenate([same[:, [0, 1]], same[:, [1, 2]]]), len(content.points))[same[:, 0]]
    kinds, label = np.unique(label, return_inverse=True)
    low, high = np.full((len(kinds), 3), np.inf), np.full((len(kinds), 3), -np.inf)
    for corner in content.triangles.T:
        np.minimum.at(low, label, content.points[corner])
        np.maximum.at(high, label, content.points[corner])
    rank = np.argsort(np.argsort(-np.linalg.norm(high - low, axis=1), kind="stable"))
    return rank[label], ()


def coincident(points: np.ndarray) -> np.ndarray:
    """For each point (n, 3) the index of the first one that coincides with it, (n,): within WELD of the diagonal, or
    joined by a chain of such points."""
    reach = WELD * float(np.linalg.norm(np.ptp(points, axis=0)))
    label = connected(KDTree(points).query_pairs(reach, output_type="ndarray"), len(points))
    _, first = np.unique(label, return_index=True)
    return first[label]
