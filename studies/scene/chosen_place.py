"""User-chosen places on a body for hold and probe: sides, or points of its surface."""

import re
from pathlib import Path

import numpy as np

from studies.base.errors import StudyError
from studies.base.lookup import lookup
from studies.geometry import BallRegion, HalfSpace, OrganMesh
from studies.geometry.files.masks import is_mask
from studies.geometry.scanned.fidelity import samples
from studies.geometry.surface.distance import distance_to_surface
from studies.scene.placing import Vector, along

PATCH = 0.12
"""Radius of the patch whose flatness is measured, over the length of the body."""
NEAR = 0.1
"""Largest distance of a given point from the surface, over the length of the body."""
RADIUS, DEPTH, GAP = 0.10, 0.05, 0.0005
"""Radius of the probe and depth of its press, over the longest side of the body; its distance at the start [m]."""
SIDES: dict[str, Vector] = {
    "left": (1.0, 0.0, 0.0),
    "right": (-1.0, 0.0, 0.0),
    "front": (0.0, -1.0, 0.0),
    "back": (0.0, 1.0, 0.0),
    "bottom": (0.0, 0.0, -1.0),
    "top": (0.0, 0.0, 1.0),
}
"""Of a patient, in the axes of DICOM and of our organs: x to the patient's left, y to the back, z to the head."""
Place = str | Vector
"""One of SIDES, or a point [m]."""


def outwards(side: str, mesh: OrganMesh) -> np.ndarray:
    """The direction (3,) of one of SIDES in the coordinates of a mesh: that of a label mask has x to the right and y to
    the front (studies.geometry.files.masks)."""
    turned = (-1.0, -1.0, 1.0) if is_mask(Path(str(mesh.recipe.get("file", "")))) else (1.0, 1.0, 1.0)
    return np.multiply(SIDES[side], turned)


def place_of(text: str) -> Place:
    """A side, or the point [m] of "x,y,z" in millimetres. Raises StudyError for anything else."""
    if not re.search(r"[,;\d]", text):
        return lookup(text.strip().lower(), list(SIDES), "side")
    try:
        x, y, z = (1e-3 * float(number) for number in text.split(","))
    except ValueError as error:
        raise StudyError(
            f"'{text}' is not a place; give x,y,z in mm such as 10,-20.5,3, or {', '.join(SIDES)}"
        ) from error
    if not np.isfinite([x, y, z]).all():
        raise StudyError(f"'{text}' is not a place; give finite numbers")
    return (x, y, z)


def snapped(surface: tuple[np.ndarray, np.ndarray], point: Vector, length: float, name: str) -> np.ndarray:
    """The nearest place (3,) of a surface: a node, the middle of an edge or of a triangle. name: of the option, for the
    message.

    Raises StudyError for a point that is not near the surface."""
    places, _ = samples(*surface)
    away = np.linalg.norm(places - point, axis=1)
    if away.min() > NEAR * length:
        low, high = (", ".join(f"{1e3 * x:.4g}" for x in end) for end in (places.min(axis=0), places.max(axis=0)))
        raise StudyError(
            f"{name} is {1e3 * away.min():.4g} mm from the surface, which lies between ({low}) and ({high}) mm; "
            "give a point near it, in mm"
        )
    return places[int(away.argmin())]


def palpated_at(
    surface: tuple[np.ndarray, np.ndarray],
    normals: np.ndarray,
    hold: HalfSpace | BallRegion,
    length: float,
    name: str,
    point: Vector,
) -> tuple[Vector, Vector, float]:
    """The place of the surface that is nearest to a point, the direction out of the body there, and the patch's
    flatness. Raises StudyError if the body is held there, or is in the way of the probe."""
    place, radius = snapped(surface, point, length, name), RADIUS * length
    if float(hold.level(place[None])[0]) < radius:
        raise StudyError(
            f"{name} is in the clamped region, or closer to it than the probe's radius ({1e3 * radius:.3g} mm)"
        )
    away = np.linalg.norm(surface[0] - place, axis=1)
    mean = normals[away < max(PATCH * length, float(away.min()))].mean(axis=0)
    for direction in (mean, normals[int(away.argmin())]):
        if np.linalg.norm(direction) > 0 and comes_in(surface, place, direction, length):
            outward = vector(direction / np.linalg.norm(direction))
            return vector(place), outward, float(np.linalg.norm(mean))
    raise StudyError(f"{name}: a probe of {1e3 * radius:.3g} mm radius does not get there, the body is in its way")


def comes_in(surface: tuple[np.ndarray, np.ndarray], place: np.ndarray, direction: np.ndarray, length: float) -> bool:
    """Whether the probe can move straight along `direction` from outside the body to its start."""
    radius, outward = RADIUS * length, vector(direction / np.linalg.norm(direction))
    ways = np.arange(radius + GAP, 2.0 * length, 0.5 * radius)
    centres = np.array([along(vector(place), outward, float(way)) for way in ways])
    return bool((distance_to_surface(centres, *surface) >= radius).all())


def vector(values: np.ndarray) -> Vector:
    """Three plain numbers, rounded to micrometres, or for unit vectors to a millionth."""
    x, y, z = (round(float(value), 6) for value in values)
    return (x, y, z)
