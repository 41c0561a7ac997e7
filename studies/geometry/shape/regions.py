"""Where an organ is attached: a part of space, which is the same for meshes of any size.

A region has a signed level, negative inside. The patch of a surface that lies in it is bounded by the curve level = 0,
onto which the mesher moves nodes (snap.py), so the patch does not depend on the mesh.
"""

from dataclasses import asdict, dataclass
from typing import Any, Protocol

import numpy as np

from studies.base.errors import StudyError

Vector = tuple[float, float, float]

ON_CURVE = 1e-10
"""A node within this fraction of the box size from an outline lies on it: far above rounding, far below edges."""


class Region(Protocol):
    def level(self, points: np.ndarray) -> np.ndarray:
        """Signed level [m], shape (n,), of points (n, 3) [m]: negative inside."""
        ...


@dataclass(frozen=True)
class HalfSpace:
    """Points x [m] with normal . (x - point) <= 0: `normal`, of any length, points out of the region."""

    point: Vector
    normal: Vector

    def level(self, points: np.ndarray) -> np.ndarray:
        """Signed distance [m], shape (n,). Raises StudyError for a normal of length 0."""
        normal = np.asarray(self.normal, float)
        length = np.linalg.norm(normal)
        if not length > 0:
            raise StudyError(f"the normal {self.normal} of a half space has no length; give a direction")
        return (np.asarray(points, float) - self.point) @ (normal / length)


@dataclass(frozen=True)
class BallRegion:
    """Points within `radius` [m] of `center` [m]."""

    center: Vector
    radius: float

    def level(self, points: np.ndarray) -> np.ndarray:
        if not self.radius > 0:
            raise StudyError(f"a ball region of radius {self.radius} m is empty; give a radius above 0")
        return np.linalg.norm(np.asarray(points, float) - self.center, axis=1) - self.radius


@dataclass(frozen=True)
class EllipsoidRegion:
    """Points inside an ellipsoid around `center` [m] with semi-axes [m] along x, y, z."""

    center: Vector
    semi_axes: Vector

    def level(self, points: np.ndarray) -> np.ndarray:
        """Scaled level [m], shape (n,): 0 on the ellipsoid, no distance elsewhere. Raises StudyError unless all
        semi-axes are above 0."""
        axes = np.asarray(self.semi_axes, float)
        if not (axes > 0).all():
            raise StudyError(f"an ellipsoid region with semi-axes {self.semi_axes} m is empty; give lengths above 0")
        scaled = (np.asarray(points, float) - self.center) / axes
        return (np.linalg.norm(scaled, axis=1) - 1.0) * axes.min()


BATCH = 4096
"""Points whose distances to all samples are in memory at the same time."""


@dataclass(frozen=True)
class PaintedRegion:
    """The painted part of a surface, interpolated between samples; `studies.geometry.painted` makes one from a file.

    samples: x, y, z [m] of points on the surface and the area [m²] that each represents, negative where not painted
    width: standard deviation [m] of the Gaussian that smooths the steps of the painted border
    """

    samples: tuple[tuple[float, float, float, float], ...]
    width: float

    def level(self, points: np.ndarray) -> np.ndarray:
        """Signed level [m], shape (n,), of points (n, 3) [m] near the surface: about the distance to the border, on
        which the Gaussians of the painted samples and of the others, weighted with their areas, have the same
        density."""
        points, rows = np.asarray(points, float), np.asarray(self.samples, float)
        odds = np.concatenate([self._odds(points[k : k + BATCH], rows) for k in range(0, max(len(points), 1), BATCH)])
        # At distance s from a straight border the odds are log(Phi(t) / Phi(-t)), t = s / width: 4 phi(0) t near it and
        # t² / 2 far from it.
        slope = 4.0 / np.sqrt(2.0 * np.pi)
        return self.width * odds / (slope * np.sqrt(1.0 + np.abs(odds) / (2.0 * slope**2)))

    def _odds(self, points: np.ndarray, rows: np.ndarray) -> np.ndarray:
        """Logarithm of the density of samples outside over that inside, shape (n,); rows (s, 4): samples."""
        densities = []
        for part in (rows[rows[:, 3] > 0], rows[rows[:, 3] < 0]):
            squared = sum((points[:, k, None] - part[None, :, k]) ** 2 for k in range(3))
            terms = np.log(np.abs(part[:, 3])) - squared / (2.0 * self.width**2)
            # Subtracting the largest term avoids underflow far away.
            most = terms.max(axis=1)
            densities.append(most + np.log(np.exp(terms - most[:, None]).sum(axis=1)))
        return densities[1] - densities[0]


KnownRegion = HalfSpace | BallRegion | EllipsoidRegion | PaintedRegion
"""Regions that can be stored as JSON."""

KINDS: dict[str, type] = {cls.__name__: cls for cls in (HalfSpace, BallRegion, EllipsoidRegion, PaintedRegion)}


def held_nodes(region: Region, points: np.ndarray) -> np.ndarray:
    """Numbers of the nodes (n, 3) [m] of a surface that lie in a region or on its outline.

    Nodes are on an outline to ON_CURVE of the box of the shape, which is somewhat larger than the mesh, and to the
    rounding of their coordinates, which a file may hold in single precision: so a body holds the same nodes wherever it
    lies.
    """
    box, farthest = np.linalg.norm(np.ptp(points, axis=0)), np.abs(points).max(initial=0.0)
    return np.flatnonzero(region.level(points) <= 10 * ON_CURVE * box + 2.0 * np.finfo(np.float32).eps * farthest)


def region_to_dict(region: Any) -> dict[str, Any]:
    """JSON-able form of a region; raises StudyError for anything that is not one of KINDS."""
    kind = type(region).__name__
    if KINDS.get(kind) is not type(region):
        raise StudyError(f"{region!r} is not a region; use one of {', '.join(KINDS)}")
    fields = {key: np.asarray(value, float).tolist() for key, value in asdict(region).items()}
    return {"kind": kind, **fields}


def region_from_dict(data: dict[str, Any]) -> Region:
    """The region with the JSON-able form `data`. Raises KeyError for an unknown kind."""
    fields = {key: tuple(value) if isinstance(value, list) else value for key, value in data.items() if key != "kind"}
    return KINDS[data["kind"]](**fields)
