"""Where a body may be held and palpated, proposed by rule from its shape: a first scene for an organ of one's own."""

from dataclasses import dataclass

import numpy as np
from scipy.spatial import KDTree

from studies.base.errors import StudyError
from studies.geometry import HalfSpace, OrganMesh
from studies.geometry.mesh.organ_mesh import triangle_areas, vertex_normals
from studies.geometry.shape.levelset import PalpationPoint
from studies.scene.placing import Vector

HELD = 0.10
"""Share of the surface that is held."""
END = 0.15
"""Of the length: how far from an end its surface is measured, to tell which end is blunter."""
FAR = 0.4
"""Of the length: how far from the held end the palpation point is at least."""
PATCH = 0.12
"""Of the length: radius of the patch whose flatness counts."""
FREE = 0.02
"""Of the length: how far the body may reach beyond the plane that touches it in the palpation point."""


@dataclass(frozen=True)
class Proposal:
    """Principal axes of a body, a hold at one end, and a point to palpate."""

    middle: Vector
    """Of the surface [m]."""
    axes: tuple[Vector, Vector, Vector]
    """Unit vectors, the longest extent first."""
    sides: Vector
    """Extents along the axes [m]."""
    hold: HalfSpace
    held_share: float
    """Of the surface's area."""
    palpation: PalpationPoint
    flatness: float
    """Length of the mean unit normal round the point: 1 is a plane."""


def proposal(mesh: OrganMesh) -> Proposal:
    """The blunter end of the longest principal axis is held, a tenth of the surface; the flattest patch that is freely
    reachable and far from it is palpated. Raises StudyError for a body without such a patch."""
    points, triangles = mesh.points[: mesh.outer_count], mesh.outer_triangles
    areas, centres = triangle_areas(points, triangles), points[triangles].mean(axis=1)
    middle = (areas[:, None] * centres).sum(axis=0) / areas.sum()
    spread = ((areas[:, None] * (centres - middle)).T @ (centres - middle)) / areas.sum()
    axes = np.linalg.eigh(spread)[1].T[::-1]
    along = (points - middle) @ axes.T
    sides = np.ptp(along, axis=0)
    axes, sides = axes[np.argsort(-sides)], sides[np.argsort(-sides)]
    hold, share = held_end(centres, areas, axes[0])
    point, normal, flatness = palpated(points, vertex_normals(points, triangles), hold, float(sides[0]), mesh.name)
    rows = tuple(vector(axis) for axis in axes)
    return Proposal(
        vector(middle), (rows[0], rows[1], rows[2]), vector(sides), hold, share, PalpationPoint(point, normal), flatness
    )


def held_end(centres: np.ndarray, areas: np.ndarray, axis: np.ndarray) -> tuple[HalfSpace, float]:
    """The half space that holds HELD of the surface at the end with more surface near it; the share that it holds."""
    places = centres @ axis
    length = float(np.ptp(places))
    at_low, at_high = (
        areas[places < places.min() + END * length].sum(),
        areas[places > places.max() - END * length].sum(),
    )
    outward = axis if at_high >= at_low else -axis
    order = np.argsort(-(centres @ outward))
    held = np.cumsum(areas[order]) / areas.sum()
    last = int(np.searchsorted(held, HELD))
    middle = centres.mean(axis=0)
    beside = middle + float((centres[order[last]] - middle) @ outward) * outward
    return HalfSpace(vector(beside), vector(-outward)), float(held[last])


def palpated(
    points: np.ndarray, normals: np.ndarray, hold: HalfSpace, length: float, name: str
) -> tuple[Vector, Vector, float]:
    """The node in the middle of the flattest patch far from the hold and freely reachable, the patch's normal, and its
    flatness. Raises StudyError where there is none."""
    around = KDTree(points).query_ball_point(points, PATCH * length)
    mean = np.stack([normals[near].mean(axis=0) for near in around])
    flat = np.linalg.norm(mean, axis=1)
    outward = mean / np.maximum(flat, 1e-300)[:, None]
    beyond = ((points[None] - points[:, None]) * outward[:, None]).sum(axis=2).max(axis=1)
    able = (hold.level(points) > FAR * length) & (beyond < FREE * length)
    if not able.any():
        raise StudyError(f"{name}: no freely reachable patch lies far from its held end; place the instrument by hand")
    best = int(np.flatnonzero(able)[flat[able].argmax()])
    return vector(points[best]), vector(outward[best]), float(flat[best])


def vector(values: np.ndarray) -> Vector:
    """Three plain numbers, rounded to micrometres, or for unit vectors to a millionth."""
    x, y, z = (round(float(value), 6) for value in values)
    return (x, y, z)
