"""The content of a file of any format: points, triangles or tetrahedra, and parts, which are separated by name if the
file has names, else by connectivity."""

from dataclasses import dataclass, field, replace
from typing import Any

import meshio
import numpy as np
from scipy.spatial import KDTree

from studies.base.errors import StudyError
from studies.geometry.mesh.organ_mesh import connected, tetrahedron_volumes

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
    part: index into `names` of each cell, shape (t,); empty if the file has no names
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
        raise StudyError(f"{name}: the file has no points, or no cell uses them; export a surface or a volume mesh")
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


CORNERS = {"triangle": 3, "quad": 4, "tetra": 4, "hexahedron": 8, "wedge": 6, "pyramid": 5}
"""Corners of a cell by its name in meshio without the number of its nodes: corners come first, then mid-side nodes."""
SIDES = {
    "tetra": ((0, 2, 1), (0, 1, 3), (1, 2, 3), (0, 3, 2)),
    "hexahedron": ((0, 3, 2, 1), (4, 5, 6, 7), (0, 1, 5, 4), (1, 2, 6, 5), (2, 3, 7, 6), (3, 0, 4, 7)),
    "wedge": ((0, 2, 1), (3, 4, 5), (0, 1, 4, 3), (1, 2, 5, 4), (2, 0, 3, 5)),
    "pyramid": ((0, 3, 2, 1), (0, 1, 4), (1, 2, 4), (2, 3, 4), (3, 0, 4)),
}
"""Sides of a solid cell, outward; the fourth corner of the tetrahedron of HAND lies inside of the first three."""
HAND = {"tetra": (0, 1, 2, 3), "hexahedron": (0, 1, 3, 4), "wedge": (0, 1, 2, 3), "pyramid": (0, 1, 3, 4)}
FLAT = "its curved sides are read as flat, by their corners"


def content_of(raw: meshio.Mesh, name: str) -> tuple[Content, str | None]:
    """The content of a mesh, and a remark for the user or None. Cells are read by their corners; points and lines are
    left out; polygons are cut into triangles; of solids that are not all tetrahedra the boundary is taken, and
    triangles next to solids are left out. Raises StudyError for cells of other kinds."""
    flat, solid, curved = [np.empty((0, 3), np.int64)], list[tuple[str, np.ndarray]](), False
    for block in raw.cells:
        kind, data = block.type.rstrip("0123456789"), np.asarray(block.data).astype(np.int64)
        if kind in ("vertex", "line"):
            continue
        if kind not in CORNERS and kind != "polygon":
            raise StudyError(f"{name}: cells of kind {block.type!r} are not supported; convert to tetrahedra")
        corners = data if kind == "polygon" else data[:, : CORNERS[kind]]
        curved |= corners.shape[1] < data.shape[1]
        if kind in SIDES:
            solid.append((kind, corners))
        else:
            flat.append(fans(corners))
    points = np.asarray(raw.points, float)
    tetrahedra = np.concatenate([np.empty((0, 4), np.int64), *(cells for kind, cells in solid if kind == "tetra")])
    if any(kind != "tetra" for kind, _ in solid):
        tetrahedra, flat = tetrahedra[:0], boundary_of(points, solid)
    triangles, remarks = np.concatenate(flat), [FLAT] if curved else []
    if len(tetrahedra) and not np.isin(triangles, tetrahedra).all():
        same = coincident(points) if np.isfinite(points).all() else np.arange(len(points))
        alone = int((~np.isin(same[triangles], same[tetrahedra])).any(axis=1).sum())
        remarks += [f"{alone:,} triangles that bound no tetrahedron are left out"] if alone else []
    data = {key: np.asarray(values) for key, values in raw.point_data.items()}
    return Content(points, triangles, tetrahedra, data), "; ".join(remarks) or None


def boundary_of(points: np.ndarray, solid: list[tuple[str, np.ndarray]]) -> list[np.ndarray]:
    """Outward triangles (t, 3), in groups, on the sides that only one solid cell has; solid: kinds and corners."""
    sides: dict[int, list[np.ndarray]] = {3: [], 4: []}
    for kind, cells in solid:
        inverted = tetrahedron_volumes(points, cells[:, HAND[kind]]) < 0
        for side in SIDES[kind]:
            faces = cells[:, side]
            sides[len(side)].append(np.where(inverted[:, None], faces[:, ::-1], faces))
    outer = []
    for faces in (np.concatenate(group) for group in sides.values() if group):
        _, first, count = np.unique(np.sort(faces, axis=1), axis=0, return_index=True, return_counts=True)
        outer.append(fans(faces[first[count == 1]]))
    return outer


def fans(polygons: np.ndarray) -> np.ndarray:
    """Triangles (k (m - 2), 3) of convex polygons (k, m): each polygon becomes a fan from its first corner."""
    corners = polygons.shape[1]
    return np.concatenate(
        [np.empty((0, 3), np.int64), *(polygons[:, [0, k, k + 1]] for k in range(1, corners - 1))]
    ).reshape(-1, 3)


def parts_in(content: Content, metres: float) -> list[dict[str, Any]]:
    """Number, name, number of cells and sides of the box [m] of each part, JSON-able; metres: per unit of the file. All
    cells are one part if a coordinate is not finite."""
    numbers, names = numbered(content)
    rows = []
    for k in range(int(numbers.max(initial=-1)) + 1):
        own = content.cells[numbers == k]
        size = np.ptp(content.points[np.unique(own)], axis=0) if len(own) else np.zeros(3)
        row = {"number": k + 1, "name": names[k] if names else "", "cells": len(own)}
        rows.append(row | {"size": [metres * side for side in size.tolist()]})
    return rows


def chosen(content: Content, part: str | None, name: str) -> Content:
    """The content reduced to `part`, given by name or number; None: all of it. Raises StudyError for an unknown part;
    name: of the file."""
    if part is None:
        return content
    numbers, names = numbered(content)
    count = int(numbers.max(initial=-1)) + 1
    by_number = {str(k + 1): k for k in range(count)}
    by_name = {label.lower(): k for k, label in reversed(list(enumerate(names)))}
    number = by_name.get(part.lower(), by_number.get(part))
    if number is None:
        raise StudyError(f"{name} has {listed(names, count)}; there is no {part!r} among them")
    cells = {"tetrahedra" if len(content.tetrahedra) else "triangles": content.cells[numbers == number]}
    return replace(content, **cells, names=(), part=numbers[:0])


def listed(names: tuple[str, ...], count: int) -> str:
    if not names:
        return f"{count} part{'s' * (count != 1)}, numbered from 1 by their size"
    more = f" and {count - LISTED} more" if count > LISTED else ""
    return f"the parts {', '.join(names[:LISTED])}{more}"


def numbered(content: Content) -> tuple[np.ndarray, tuple[str, ...]]:
    """The number of the part of each cell from 0, (k,), and the names of the parts; without names the parts are the
    connected ones, the one with the largest box first."""
    if content.names:
        return content.part, content.names
    cells = content.cells
    if not len(cells) or not np.isfinite(content.points).all():
        return np.zeros(len(cells), np.int64), ()
    same = coincident(content.points)[cells]
    pairs = np.concatenate([same[:, k : k + 2] for k in range(cells.shape[1] - 1)])
    label = connected(pairs, len(content.points))[same[:, 0]]
    kinds, label = np.unique(label, return_inverse=True)
    low, high = np.full((len(kinds), 3), np.inf), np.full((len(kinds), 3), -np.inf)
    for corner in cells.T:
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
