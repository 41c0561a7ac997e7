"""The section of a closed surface by a plane, before meshing: its trace, the pieces that it leaves, and its checks."""

from collections.abc import Iterable, Mapping
from itertools import combinations
from typing import NamedTuple

import numpy as np
from scipy.spatial import KDTree

from massspring.body.surface import winding_number
from studies.base.errors import StudyError
from studies.geometry.mesh.organ_mesh import Surface, connected, triangle_normals
from studies.geometry.shape.regions import BallRegion, HalfSpace, Region

LEAST_PIECE = 0.01
"""Smallest share of the volume that a separate piece may have."""
GRAZING = 15.0
"""Angle between plane and surface [degrees] below which no element at the edge between them is well shaped: flat sides
differ from the surface by some degrees, and dihedral angles below 8 are refused."""


class Piece(NamedTuple):
    """A connected piece of the body on one side of a plane: points (n, 3) [m] on its part of the surface and on the
    trace, and its share of the whole volume [1]."""

    surface: np.ndarray
    share: float


class Sheet(NamedTuple):
    """The section of a closed surface by a plane."""

    trace: np.ndarray
    """Ends of the segments of the outline of the section [m], (e, 2, 3)."""
    angles: np.ndarray
    """Angle between the plane and the surface at each segment [degrees], 0 to 90, (e,)."""
    crossed: np.ndarray
    """Whether each triangle of the surface has corners on both sides, (t,) bool."""
    pieces: list[Piece]


def sheet_of(plane: HalfSpace, points: np.ndarray, triangles: np.ndarray) -> Sheet:
    """The section of a closed surface of points (n, 3) [m] and triangles (t, 3) by a plane, and the pieces on both
    sides."""
    level = plane.level(points)
    front = level > 0
    count = front[triangles].sum(axis=1)
    crossed = (count == 1) | (count == 2)
    mixed = triangles[crossed]
    # The corner that is alone on its side comes first.
    alone = front[mixed] == (count[crossed] == 1)[:, None]
    lone, one, other = np.take_along_axis(mixed, (alone.argmax(axis=1)[:, None] + np.arange(3)) % 3, axis=1).T
    ends = np.sort(np.concatenate([np.stack([lone, one], axis=1), np.stack([lone, other], axis=1)]), axis=1)
    ends, inverse = np.unique(ends.reshape(-1, 2), axis=0, return_inverse=True)
    share = level[ends[:, :1]] / (level[ends[:, :1]] - level[ends[:, 1:]])
    places = np.concatenate([points, (1 - share) * points[ends[:, 0]] + share * points[ends[:, 1]]])
    p, q = len(points) + inverse.reshape(2, -1)
    parts = [np.stack(part, axis=1) for part in ((lone, p, q), (p, one, other), (p, other, q))]
    ahead = np.concatenate([front[triangles[~crossed, 0]], front[lone], ~front[lone], ~front[lone]])
    whole = np.concatenate([triangles[~crossed], *parts])
    pieces = [piece for side in (~ahead, ahead) for piece in _pieces(places, whole[side], plane)]
    total = sum(volume for _, volume in pieces)
    normal = np.asarray(plane.normal, float) / np.linalg.norm(plane.normal)
    across = triangle_normals(points, mixed)
    along = np.abs(across @ normal) / np.linalg.norm(across, axis=1)
    return Sheet(
        places[np.stack([p, q], axis=1)],
        np.degrees(np.arccos(np.clip(along, 0.0, 1.0))),
        crossed,
        [Piece(places[nodes], volume / total) for nodes, volume in pieces],
    )


def _pieces(points: np.ndarray, triangles: np.ndarray, plane: HalfSpace) -> list[tuple[np.ndarray, float]]:
    """Nodes and volume [m³] of each piece on one side of a plane, bounded by triangles (t, 3) and their section."""
    pairs = np.concatenate([triangles[:, [0, 1]], triangles[:, [1, 2]]])
    label = connected(pairs, len(points))[triangles[:, 0]]
    # With the origin in the plane the section contributes no volume.
    a, b, c = (points - np.asarray(plane.point))[triangles].transpose(1, 0, 2)
    volume = np.einsum("ij,ij->i", a, np.cross(b, c)) / 6.0
    pieces = [(np.unique(triangles[label == k]), float(volume[label == k].sum())) for k in np.unique(label)]
    # A part with negative volume is a dent: its volume is subtracted from the largest piece.
    dents = sum(volume for _, volume in pieces if volume <= 0)
    pieces = sorted((piece for piece in pieces if piece[1] > 0), key=lambda piece: -piece[1])
    return [(nodes, volume + (dents if k == 0 else 0.0)) for k, (nodes, volume) in enumerate(pieces)]


def check_sheet(
    name: str,
    cut: str,
    surface: Surface,
    plane: HalfSpace,
    within: Region | None,
    held: Iterable[Region],
) -> Sheet:
    """The section of the closed surface of the organ or scene `name` by the plane of the cut called `cut`.

    within: the blade; held: regions whose outlines the cut must not cross. Raises StudyError for a plane that misses or
    grazes the surface, crosses such an outline, or leaves too small a piece, and for a blade that does not fit.
    """
    points, triangles = surface
    sheet = sheet_of(plane, points, triangles)
    if not len(sheet.trace):
        raise StudyError(f"{name}: the plane of cut {cut!r} misses the body; move it")
    for region in held:
        outside = (region.level(points)[triangles] > 0).sum(axis=1)
        if (sheet.crossed & (outside % 3 > 0)).any():
            raise StudyError(f"{name}: cut {cut!r} crosses the outline of a held region; move one of them away")
    least = min(piece.share for piece in sheet.pieces)
    if least < LEAST_PIECE:
        raise StudyError(f"{name}: cut {cut!r} leaves a piece of {100 * least:.2g} % of the volume; move the plane")
    if sheet.angles.min() < GRAZING:
        raise StudyError(
            f"{name}: cut {cut!r} grazes the surface, at {sheet.angles.min():.2g} degrees in places and not at "
            f"{GRAZING:g} or more; turn or move the plane"
        )
    if isinstance(within, BallRegion):
        _check_disc(name, cut, surface, sheet, plane, within)
    elif within is not None:
        _check_front(name, cut, sheet, within)
    return sheet


def check_apart(name: str, sheets: Mapping[str, tuple[HalfSpace, Sheet]], edge: float = 0.0) -> None:
    """Raises StudyError for two cuts of the organ or scene `name` whose sections meet, or whose outlines are less than
    an `edge` [m] apart. sheets: name of each cut -> its plane and its section of the surface."""
    for (one, (plane, first)), (other, (_, second)) in combinations(sheets.items(), 2):
        level = plane.level(second.trace.reshape(-1, 3)).reshape(-1, 2)
        # Inside the body the planes meet along a line, and where it leaves the body an outline crosses the other plane.
        if (level.prod(axis=1) <= 0).any():
            raise StudyError(f"{name}: the planes of cuts {one!r} and {other!r} meet inside the body; move one of them")
        away = float(KDTree(first.trace.reshape(-1, 3)).query(second.trace.reshape(-1, 3))[0].min())
        if away < edge:
            raise StudyError(
                f"{name}: cuts {one!r} and {other!r} come within {1e3 * away:.2g} mm of each other, and the edges of "
                f"the mesh are {1e3 * edge:.2g} mm long; move one of them, or use more nodes"
            )


def _check_disc(
    name: str,
    cut: str,
    surface: Surface,
    sheet: Sheet,
    plane: HalfSpace,
    within: BallRegion,
) -> None:
    away = float(plane.level(np.array([within.center]))[0])
    if abs(away) >= within.radius:
        raise StudyError(f"{name}: the blade of cut {cut!r} holds nothing of the plane; move the ball onto it")
    if (within.level(sheet.trace.reshape(-1, 3)) <= 0).any():
        raise StudyError(f"{name}: the disc of cut {cut!r} reaches the surface; give a smaller one, or a half space")
    normal = np.asarray(plane.normal, float) / np.linalg.norm(plane.normal)
    if winding_number(np.asarray(within.center) - away * normal, *surface) < 0.5:
        raise StudyError(f"{name}: the disc of cut {cut!r} lies outside the body; move it")


def _check_front(name: str, cut: str, sheet: Sheet, within: Region) -> None:
    inside = within.level(sheet.trace.reshape(-1, 3)).reshape(-1, 2) <= 0
    if inside.all() or not inside.any():
        what = "is all of it; leave out within" if inside.any() else "holds nothing of the section; move it"
        raise StudyError(f"{name}: the blade of cut {cut!r} {what}")
    crossings = int((inside[:, 0] != inside[:, 1]).sum())
    if crossings != 2:
        raise StudyError(
            f"{name}: the front of cut {cut!r} meets the outline of the section {crossings} times and not twice; "
            "move it, or cut the whole section"
        )
