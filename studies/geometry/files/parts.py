"""Several bodies in one file, separated by name if the file has names, else by connectivity."""

from dataclasses import dataclass, replace

import numpy as np
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components
from scipy.spatial import KDTree

from studies.base.errors import StudyError
from studies.geometry.files.content import Content

WELD = 1e-7
"""Points nearer than this fraction of the diagonal are one point: the single precision of STL files."""
LISTED = 12
"""Most parts that a sentence or a table lists."""


@dataclass(frozen=True)
class Part:
    """One body of a file."""

    number: int
    """From 1: in the order of the file if parts have names, else the largest box first."""
    name: str
    triangles: int
    size: tuple[float, float, float]
    """Sides of its box in the unit of the file."""


def parts_in(content: Content) -> list[Part]:
    """The parts of a surface; none without triangles.

    The triangles are one part if the file has tetrahedra, or if a coordinate is not finite.
    """
    numbers, names = numbered(content)
    parts = []
    for k in range(int(numbers.max(initial=-1)) + 1):
        rows = content.triangles[numbers == k]
        size = np.ptp(content.points[np.unique(rows)], axis=0) if len(rows) else np.zeros(3)
        sides = float(size[0]), float(size[1]), float(size[2])
        parts.append(Part(k + 1, names[k] if names else "", len(rows), sides))
    return parts


def chosen(content: Content, part: str | None, name: str) -> Content:
    """The content reduced to `part`, given by name or number; None: all of it. name: of the file.

    Raises StudyError for an unknown part, and for a part of a body of tetrahedra.
    """
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
    """The parts in words."""
    if not names:
        return f"{count} part{'s' * (count != 1)}, numbered from 1 by their size"
    more = f" and {count - LISTED} more" if count > LISTED else ""
    return f"the parts {', '.join(names[:LISTED])}{more}"


def numbered(content: Content) -> tuple[np.ndarray, tuple[str, ...]]:
    """The number of the part of each triangle from 0, (t,), and the names of the parts.

    Without names in the file the parts are the connected ones, the one with the largest box first.
    """
    if content.names:
        return content.part, content.names
    finite = np.isfinite(content.points).all()
    if len(content.tetrahedra) or not len(content.triangles) or not finite:
        return np.zeros(len(content.triangles), np.int64), ()
    same = coincident(content.points)[content.triangles]
    ends = same[:, [0, 1]].T, same[:, [1, 2]].T
    i, j = np.concatenate(ends, axis=1)
    graph = coo_array((np.ones(len(i)), (i, j)), shape=(len(content.points),) * 2)
    label = connected_components(graph, directed=False)[1][same[:, 0]]
    kinds, label = np.unique(label, return_inverse=True)
    low, high = np.full((len(kinds), 3), np.inf), np.full((len(kinds), 3), -np.inf)
    for corner in content.triangles.T:
        np.minimum.at(low, label, content.points[corner])
        np.maximum.at(high, label, content.points[corner])
    rank = np.argsort(np.argsort(-np.linalg.norm(high - low, axis=1), kind="stable"))
    return rank[label], ()


def coincident(points: np.ndarray) -> np.ndarray:
    """For each point (n, 3) the index of the first point that coincides with it, (n,).

    Points coincide if they are within WELD of the diagonal, or if a chain of such points joins them.
    """
    reach = WELD * float(np.linalg.norm(np.ptp(points, axis=0)))
    i, j = KDTree(points).query_pairs(reach, output_type="ndarray").T
    graph = coo_array((np.ones(len(i)), (i, j)), shape=(len(points), len(points)))
    _, label = connected_components(graph, directed=False)
    _, first = np.unique(label, return_index=True)
    return first[label]
