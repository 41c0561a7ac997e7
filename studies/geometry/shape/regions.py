"""Where an organ is attached, defined by geometry: the same place on a mesh of any size.

A region is a part of space with a signed level, negative inside. The patch of a surface that lies in it is bounded
by the curve level = 0, onto which the mesher moves nodes (snap.py), so the patch does not depend on the mesh.
"""

from dataclasses import asdict, dataclass
from typing import Any, Protocol

import numpy as np

from studies.base.errors import StudyError

Vector = tuple[float, float, float]

ON_CURVE = 1e-10
"""A node counts as on the outline within this fraction of the size of the box: far above rounding, far below edges."""


class Region(Protocol):
    """Part of space; `level` is a length [m], negative inside."""

    def level(self, points: np.ndarray) -> np.ndarray:
        """Signed level [m], shape (n,), of points [m], shape (n, 3)."""
        ...


@dataclass(frozen=True)
class HalfSpace:
    """Points with normal . (x - point) <= 0: `normal` points out of the region, as on a body."""

    point: Vector
    normal: Vector

    def level(self, points: np.ndarray) -> np.ndarray:
        """Signed distance [m], shape (n,)."""
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
        """Signed distance [m], shape (n,)."""
        if not self.radius > 0:
            raise StudyError(f"a ball region of radius {self.radius} m is empty; give a radius above 0")
        return np.linalg.norm(np.asarray(points, float) - self.center, axis=1) - self.radius


@dataclass(frozen=True)
class EllipsoidRegion:
    """Points inside an ellipsoid with semi-axes [m] along x, y, z."""

    center: Vector
    semi_axes: Vector

    def level(self, points: np.ndarray) -> np.ndarray:
        """Scaled level [m], shape (n,): zero on the ellipsoid, not a distance away from it."""
        axes = np.asarray(self.semi_axes, float)
        if not (axes > 0).all():
            raise StudyError(f"an ellipsoid region with semi-axes {self.semi_axes} m is empty; give lengths above 0")
        scaled = (np.asarray(points, float) - self.center) / axes
        return (np.linalg.norm(scaled, axis=1) - 1.0) * axes.min()


BATCH = 4096
"""Points whose distances to all samples are held at once."""


@dataclass(frozen=True)
class PaintedRegion:
    """What is painted on a surface, between samples of it; `studies.geometry.painted` makes one.

    samples: x, y, z of a place on the surface [m] and the area that it stands for [m²], negative where not painted
    width: standard deviation [m] of the Gaussian that rounds the steps of the painted border
    """

    samples: tuple[tuple[float, float, float, float], ...]
    width: float

    def level(self, points: np.ndarray) -> np.ndarray:
        """About the distance [m] along the surface to the painted border, shape (n,), of points near the surface.

        The border is where the samples inside and those outside, each a Gaussian of its area, have the same density.
        """
        points, rows = np.asarray(points, float), np.asarray(self.samples, float)
        odds = np.concatenate([self._odds(points[k : k + BATCH], rows) for k in range(0, max(len(points), 1), BATCH)])
        # Beside a straight border log(Phi(t) / Phi(-t)), t = s / width: 4 phi(0) t near it, t² / 2 far from it.
        slope = 4.0 / np.sqrt(2.0 * np.pi)
        return self.width * odds / (slope * np.sqrt(1.0 + np.abs(odds) / (2.0 * slope**2)))

    def _odds(self, points: np.ndarray, rows: np.ndarray) -> np.ndarray:
        """Logarithm of the density outside over that inside, shape (n,)."""
        densities = []
        for part in (rows[rows[:, 3] > 0], rows[rows[:, 3] < 0]):
            squared = sum((points[:, k, None] - part[None, :, k]) ** 2 for k in range(3))
            terms = np.log(np.abs(part[:, 3])) - squared / (2.0 * self.width**2)
            # The largest is taken out: far away all of them are too small for a number.
            most = terms.max(axis=1)
            densities.append(most + np.log(np.exp(terms - most[:, None]).sum(axis=1)))
        return densities[1] - densities[0]


KnownRegion = HalfSpace | BallRegion | EllipsoidRegion | PaintedRegion
"""Those that can be stored as JSON."""

KINDS: dict[str, type] = {cls.__name__: cls for cls in (HalfSpace, BallRegion, EllipsoidRegion, PaintedRegion)}


def region_to_dict(region: Any) -> dict[str, Any]:
    """JSON-able form of a region; raises StudyError for anything that is not one of KINDS."""
    kind = type(region).__name__
    if KINDS.get(kind) is not type(region):
        raise StudyError(f"{region!r} is not a region; use one of {', '.join(KINDS)}")
    fields = {key: np.asarray(value, float).tolist() for key, value in asdict(region).items()}
    return {"kind": kind, **fields}


def region_from_dict(data: dict[str, Any]) -> Region:
    """The region of which `data` is the JSON-able form."""
    fields = {key: tuple(value) if isinstance(value, list) else value for key, value in data.items() if key != "kind"}
    return KINDS[data["kind"]](**fields)
