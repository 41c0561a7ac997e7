"""Repairs that need no guess: duplicate and collapsed triangles, parts, orientation, holes."""

from dataclasses import dataclass

import numpy as np

from studies.base.errors import StudyError
from studies.geometry.mesh.organ_mesh import Surface, compact, connected, counted_edges, signed_volume, triangle_areas

TWISTED = 0.01
"""Largest share of triangles with a neighbour of the other orientation that are replaced in a one-sided surface."""

FILLED = 0.005
"""Share of the volume that an outer surface encloses up to which lumens in it are filled: the bound of our bodies."""


@dataclass(frozen=True, eq=False)
class RepairedSurface:
    """A repaired surface and what was done to it."""

    points: np.ndarray
    triangles: np.ndarray
    remarks: tuple[str, ...]
    """One sentence for each kind of change, for the user."""
    volume: float
    """Of the file [m³]: all its closed parts, less its lumens."""
    lumen: Surface | None = None
    """Surface of the lumens, if they are more than FILLED: what looks inwards inside the outer surface."""
    nested: float = 0.0
    """Volume [m³] of closed parts inside the outer surface that look outwards: lumens or bodies."""


def mend(points: np.ndarray, triangles: np.ndarray, name: str, holes: bool = False) -> RepairedSurface:
    """The largest part of a welded surface of points (n, 3) [m] and triangles (t, 3), without duplicate and collapsed
    triangles and open sheets that hang on it, flipped to agree with their neighbours and to look outward; and its
    lumens.

    holes: whether each border is closed by a fan of triangles over the mean of its nodes. name: for messages. Raises
    StudyError if nothing is left, or for a surface with one side only, unless that is a matter of few triangles.
    """
    remarks: list[str] = []
    whole = len(triangles)
    triangles = without_repeats(triangles)
    if len(triangles) < whole:
        remarks.append(f"{whole - len(triangles)} triangles that were doubled or had no three corners are left out")
    if not len(triangles):
        raise StudyError(f"{name}: no usable triangle is left; export the surface again")
    triangles, fins = without_fins(points, triangles)
    if len(fins):
        remarks.append(
            f"{len(fins)} triangles of open sheets that hang on the surface are left out, {near(points, fins)}"
        )
    parts = part_of(triangles)
    keep = largest(points, triangles, parts)
    others = [triangles[parts == k] for k in range(int(parts.max()) + 1) if k != keep]
    area = triangle_areas(points, triangles).sum()
    triangles = triangles[parts == keep]
    try:
        triangles, turned = oriented(triangles, name)
    except StudyError:
        points, triangles, bad = without_twists(points, triangles, name)
        turned = 0
        remarks.append(f"{len(bad)} triangles where it has one side only are replaced by lids, {near(points, bad)}")
    outer = signed_volume(points, triangles)
    volumes = [0.0 if len(border(part)) else np.sign(outer) * signed_volume(points, part) for part in others]
    rows = list(zip(others, volumes, strict=True))
    lumens = [row for row in rows if row[1] < 0 and encloses(points, triangles, row[0])]
    inner = [v for part, v in rows if v > FILLED * abs(outer) and encloses(points, triangles, part)]
    lost = [part for part, _ in rows if all(part is not one for one, _ in lumens)]
    if lost:
        share = triangle_areas(points, np.concatenate(lost)).sum() / area
        remarks.append(
            f"{len(lost)} of {len(others) + 1} separate parts are left out ({100 * share:.2g} % of the area)"
        )
    if turned:
        remarks.append(f"{turned} triangles are flipped to agree with their neighbours")
    if holes:
        points, triangles, closed = without_holes(points, triangles)
        if closed:
            remarks.append(f"{closed} holes are closed by flat fans")
    if signed_volume(points, triangles) < 0:
        triangles = triangles[:, ::-1].copy()
        remarks.append("the surface was inverted and has been flipped")
    outer, hollow = signed_volume(points, triangles), -sum(volume for _, volume in lumens)
    lumen = compact(points, np.concatenate([part for part, _ in lumens])) if hollow > FILLED * outer else None
    if hollow > 0 and lumen is None:
        remarks.append(f"lumens of together {1e6 * hollow:.2g} mL are filled ({100 * hollow / outer:.2g} %)")
    nested = 0.0 if lumens else sum(inner)
    return RepairedSurface(*compact(points, triangles), tuple(remarks), outer + sum(volumes), lumen, nested)


def encloses(points: np.ndarray, triangles: np.ndarray, part: np.ndarray) -> bool:
    """Whether a surface of triangles (t, 3) winds round the first node of a part (s, 3): the solid angles of its
    triangles (A. van Oosterom, J. Strackee, IEEE Trans. Biomed. Eng. 30, 1983) are more than half a sphere."""
    a, b, c = (points[triangles] - points[part[0, 0]]).transpose(1, 0, 2)
    lengths = [np.linalg.norm(corner, axis=1) for corner in (a, b, c)]
    cosines = [np.einsum("ij,ij->i", one, other) for one, other in ((b, c), (c, a), (a, b))]
    below = lengths[0] * lengths[1] * lengths[2] + sum(x * y for x, y in zip(cosines, lengths, strict=True))
    angles = np.arctan2(np.einsum("ij,ij->i", a, np.cross(b, c)), below)
    return bool(abs(angles.sum()) > np.pi)


def near(points: np.ndarray, triangles: np.ndarray) -> str:
    x, y, z = 1e3 * points[triangles].mean(axis=(0, 1))
    return f"near ({x:.1f}, {y:.1f}, {z:.1f}) mm"


def without_fins(points: np.ndarray, triangles: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """The triangles (t, 3) without open sheets that hang at edges of more than two triangles, and these sheets (s, 3).

    A sheet ends at such edges. Nothing is left out unless the largest sheet is closed by itself.
    """
    half = np.sort(triangles[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2), axis=1)
    _, edge, count = np.unique(half, axis=0, return_inverse=True, return_counts=True)
    if count.max() <= 2:
        return triangles, triangles[:0]
    order, count = np.argsort(edge, kind="stable"), count[edge]
    sheet = connected(order[count[order] == 2].reshape(-1, 2) // 3, len(triangles))
    closed = [bool((counted_edges(triangles[sheet == k])[1] == 2).all()) for k in range(int(sheet.max()) + 1)]
    if not closed[largest(points, triangles, sheet)]:
        return triangles, triangles[:0]
    hanging = ~np.array(closed)[sheet] & np.isin(sheet, sheet[(count > 2).reshape(-1, 3).any(axis=1)])
    return triangles[~hanging], triangles[hanging]


def without_twists(points: np.ndarray, triangles: np.ndarray, name: str) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """A one-sided surface with lids in place of the triangles whose orientation disagrees with a neighbour's: points,
    triangles (t, 3), and those left out (s, 3). Raises StudyError for an open surface, or if they are over TWISTED of
    all triangles."""
    pairs, agree = edge_pairs(triangles)
    bad = np.zeros(len(triangles), bool)
    bad[pairs[~agree]] = True
    if bad.mean() > TWISTED or (counted_edges(triangles)[1] == 1).any():
        raise StudyError(f"{name}: the surface has only one side, like a Moebius band; export it again")
    rest = triangles[~bad]
    parts = part_of(rest)
    points, closed, _ = without_holes(points, rest[parts == largest(points, rest, parts)])
    return points, closed, triangles[bad]


def without_repeats(triangles: np.ndarray) -> np.ndarray:
    """The triangles with three different corners, each set of corners once, in the given order."""
    rows = np.sort(triangles, axis=1)
    sound = np.flatnonzero((rows[:, 1:] != rows[:, :-1]).all(axis=1))
    _, first = np.unique(rows[sound], axis=0, return_index=True)
    return triangles[sound[np.sort(first)]]


def edge_pairs(triangles: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Pairs (e, 2) of triangles that share an edge, and whether they run along it in opposite directions, (e,) bool. At
    an edge with more than two triangles each is paired with the next."""
    half = triangles[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2)
    low, high = half.min(axis=1), half.max(axis=1)
    order = np.lexsort((high, low))
    same = (low[order][1:] == low[order][:-1]) & (high[order][1:] == high[order][:-1])
    one, other = order[:-1][same], order[1:][same]
    return np.stack([one // 3, other // 3], axis=1), half[one, 0] != half[other, 0]


def part_of(triangles: np.ndarray) -> np.ndarray:
    """Number of the part of each triangle, (t,); triangles of a part are connected by edges."""
    pairs, _ = edge_pairs(triangles)
    return connected(pairs, len(triangles))


def largest(points: np.ndarray, triangles: np.ndarray, parts: np.ndarray) -> int:
    """Number of the part with the largest bounding box, which is an outer surface and never its lumen."""
    sizes = [
        float(np.linalg.norm(np.ptp(points[triangles[parts == k]].reshape(-1, 3), axis=0))) for k in np.unique(parts)
    ]
    return int(np.argmax(sizes))


def largest_part(points: np.ndarray, triangles: np.ndarray) -> Surface:
    """The part with the largest bounding box: its points (m, 3) and triangles (s, 3)."""
    parts = part_of(triangles)
    return compact(points, triangles[parts == largest(points, triangles, parts)])


def oriented(triangles: np.ndarray, name: str) -> tuple[np.ndarray, int]:
    """Triangles (t, 3) of one part, consistently oriented like the majority, and how many were flipped.

    A graph contains every triangle twice, as it is and flipped, and joins neighbours that agree. The surface has two
    sides if this graph has two parts; if not (a Moebius band), StudyError is raised.
    """
    pairs, opposite = edge_pairs(triangles)
    count = len(triangles)
    a, b = pairs.T
    other = np.where(opposite, b, b + count)
    mirrored = np.where(opposite, b + count, b)
    label = connected(np.column_stack([np.concatenate([a, a + count]), np.concatenate([other, mirrored])]), 2 * count)
    if (label[:count] == label[count:]).any():
        raise StudyError(f"{name}: the surface has only one side, like a Moebius band; export it again")
    turn = label[:count] != label[:1]
    if 2 * turn.sum() > count:
        turn = ~turn
    return np.where(turn[:, None], triangles[:, ::-1], triangles), int(turn.sum())


def border(triangles: np.ndarray) -> np.ndarray:
    """Half edges (b, 2) of triangles (t, 3) along which no triangle runs in the other direction."""
    half = triangles[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2)
    size = int(triangles.max()) + 1
    forward, backward = half[:, 0] * size + half[:, 1], half[:, 1] * size + half[:, 0]
    return half[~np.isin(forward, backward)]


def without_holes(points: np.ndarray, triangles: np.ndarray) -> tuple[np.ndarray, np.ndarray, int]:
    """Closes every connected border by a fan over the mean of its nodes: points, triangles, number of holes."""
    open_edges = border(triangles)
    if not len(open_edges):
        return points, triangles, 0
    nodes, local = np.unique(open_edges, return_inverse=True)
    loop = connected(local.reshape(-1, 2), len(nodes))
    count = int(loop.max()) + 1
    middles = np.stack([points[nodes[loop == k]].mean(axis=0) for k in range(count)])
    fans = np.column_stack([open_edges[:, ::-1], len(points) + loop[local.reshape(-1, 2)[:, 0]]])
    return np.vstack([points, middles]), np.vstack([triangles, fans]), count
