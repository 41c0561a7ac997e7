"""Proposes where a body is held and palpated, by rules from its shape or from the user's choice."""

from dataclasses import dataclass

import numpy as np
from scipy.spatial import KDTree

from studies.base.errors import StudyError
from studies.geometry import BallRegion, HalfSpace, OrganMesh
from studies.geometry.mesh.organ_mesh import triangle_areas, vertex_normals
from studies.geometry.shape.levelset import PalpationPoint
from studies.scene.chosen_place import PATCH, Place, outwards, palpated_at, snapped, vector
from studies.scene.placing import Vector

HELD = 0.10
"""Share of the surface that is held."""
END = 0.15
"""Distance from an end, over the length, within which the surface is measured to find the blunter end."""
FAR = 0.4
"""Least distance of the palpation point from the held end, over the length."""
FREE = 0.02
"""How far the body may extend beyond the tangent plane at the palpation point, over the length."""
HALF = 0.5
"""Distance from the hold, over the largest one, that is always sufficient for a palpation point."""
FACING = 0.5
"""Least cosine of the angle between the normal of a patch and a side for the patch to face that side."""


@dataclass(frozen=True)
class Proposal:
    """Principal axes of a body, a hold at one end, and a point to palpate."""

    middle: Vector
    """Middle of the surface [m]."""
    axes: tuple[Vector, Vector, Vector]
    """Unit vectors, the longest extent first."""
    sides: Vector
    """Extents along the axes [m]."""
    hold: HalfSpace | BallRegion
    held_where: str
    """In words, for titles: "one end", "the top"."""
    held_share: float
    """Share of the surface area that is held."""
    palpation: PalpationPoint
    flatness: float
    """Length of the mean unit normal round the point: 1 is a plane."""


def proposal(mesh: OrganMesh, hold: Place | None = None, probe: Place | None = None) -> Proposal:
    """A tenth of the surface is held, at the blunter end of the longest principal axis or at `hold`. The flattest patch
    that is freely reachable and far from it is palpated, or `probe`: a patch that looks to that side, or the nearest
    point of the surface. Raises StudyError for a body without such a patch, and for a point that is off the surface,
    held, or out of the probe's reach."""
    points, triangles = mesh.points[: mesh.outer_count], mesh.outer_triangles
    areas, centres = triangle_areas(points, triangles), points[triangles].mean(axis=1)
    middle = (areas[:, None] * centres).sum(axis=0) / areas.sum()
    spread = ((areas[:, None] * (centres - middle)).T @ (centres - middle)) / areas.sum()
    axes = np.linalg.eigh(spread)[1].T[::-1]
    along_axes = (points - middle) @ axes.T
    sides = np.ptp(along_axes, axis=0)
    axes, sides = axes[np.argsort(-sides)], sides[np.argsort(-sides)]
    surface, length = (points, triangles), float(sides[0])
    if hold is None or isinstance(hold, str):
        outward = blunter_end(centres, areas, axes[0]) if hold is None else outwards(hold, mesh)
        region, share = held_end(centres, areas, outward)
    else:
        region, share = held_around(snapped(surface, hold, length, f"{mesh.name}: --hold"), centres, areas)
    normals = vertex_normals(points, triangles)
    if probe is None or isinstance(probe, str):
        way = None if probe is None else outwards(probe, mesh)
        point, normal, flatness = palpated(points, normals, region, length, mesh.name, probe, way)
    else:
        point, normal, flatness = palpated_at(surface, normals, region, length, f"{mesh.name}: --probe", probe)
    rows = tuple(vector(axis) for axis in axes)
    return Proposal(
        middle=vector(middle),
        axes=(rows[0], rows[1], rows[2]),
        sides=vector(sides),
        hold=region,
        held_where="one end" if hold is None else f"the {hold}" if isinstance(hold, str) else "a chosen point",
        held_share=share,
        palpation=PalpationPoint(point, normal),
        flatness=flatness,
    )


def blunter_end(centres: np.ndarray, areas: np.ndarray, axis: np.ndarray) -> np.ndarray:
    """The direction (3,) along `axis` of the end with more surface near it."""
    places = centres @ axis
    length = float(np.ptp(places))
    at_low, at_high = (
        areas[places < places.min() + END * length].sum(),
        areas[places > places.max() - END * length].sum(),
    )
    return axis if at_high >= at_low else -axis


def held_end(centres: np.ndarray, areas: np.ndarray, outward: np.ndarray) -> tuple[HalfSpace, float]:
    """The half space that holds HELD of the surface at the end in direction `outward`; the share that it holds."""
    order = np.argsort(-(centres @ outward))
    held = np.cumsum(areas[order]) / areas.sum()
    last = int(np.searchsorted(held, HELD))
    middle = centres.mean(axis=0)
    beside = middle + float((centres[order[last]] - middle) @ outward) * outward
    return HalfSpace(vector(beside), vector(-outward)), float(held[last])


def held_around(point: np.ndarray, centres: np.ndarray, areas: np.ndarray) -> tuple[BallRegion, float]:
    """The ball round a point that holds HELD of the surface; the share that it holds."""
    away = np.linalg.norm(centres - point, axis=1)
    order = np.argsort(away)
    held = np.cumsum(areas[order]) / areas.sum()
    last = int(np.searchsorted(held, HELD))
    return BallRegion(vector(point), round(float(away[order[last]]), 6)), float(held[last])


def palpated(
    points: np.ndarray,
    normals: np.ndarray,
    hold: HalfSpace | BallRegion,
    length: float,
    name: str,
    side: str | None = None,
    way: np.ndarray | None = None,
) -> tuple[Vector, Vector, float]:
    """The node in the middle of the flattest patch far from the hold and freely reachable, the patch's normal, and its
    flatness; where a side is given, of the patches that look along `way` (3,), its direction. Raises StudyError where
    there is none."""
    around = KDTree(points).query_ball_point(points, PATCH * length)
    mean = np.stack([normals[near].mean(axis=0) for near in around])
    flat = np.linalg.norm(mean, axis=1)
    outward = mean / np.maximum(flat, 1e-300)[:, None]
    beyond = ((points[None] - points[:, None]) * outward[:, None]).sum(axis=2).max(axis=1)
    level = hold.level(points)
    able = (level > min(FAR * length, HALF * float(level.max()))) & (beyond < FREE * length)
    score = flat
    if way is not None:
        able &= outward @ way > FACING
        score = mean @ way
    if not able.any():
        which = "lies far from its clamped end" if side is None else f"far from its clamped end faces {side}"
        raise StudyError(f"{name}: no freely reachable patch {which}; choose a point: organbench place --probe x,y,z")
    best = int(np.flatnonzero(able)[score[able].argmax()])
    return vector(points[best]), vector(outward[best]), float(flat[best])
