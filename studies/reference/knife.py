"""Converts a knife in the deformed body to a cut of the body at rest, so that every solver makes the same cut."""

from dataclasses import dataclass

import numpy as np

from reference_fem.elements.shapes import element_nodes
from studies.base.errors import StudyError
from studies.geometry import HalfSpace
from studies.reference.solution import Solution
from studies.scene.cut import Cut

SIDES = np.array([(0, 1), (1, 2), (0, 2), (0, 3), (1, 3), (2, 3)])
"""Corners at the ends of a ten-node tetrahedron's sides, in the order of their middles, 4 to 9."""
BAND = 0.1
"""Half the width of the strip along the front from which its direction is fitted, over the size of the body."""
MOST = 0.01
"""Largest distance, over the size of the body, between the pulled-back knife and the plane that replaces it."""
FEWEST = 6
"""Fewest points on the knife, and on its front, for a fit."""


@dataclass(frozen=True)
class PulledBack:
    """The cut of a knife, and its deviations from a plane with a straight front."""

    cut: Cut
    """The cut in the body at rest."""
    plane_deviation: float
    """Largest distance of the pulled-back knife from the plane [m]."""
    front_deviation: float
    """Largest distance of the pulled-back front from the straight one in that plane [m]; 0 without a front."""


def pulled_back(
    solution: Solution,
    checkpoint: int,
    name: str,
    plane: HalfSpace,
    within: HalfSpace | None = None,
    most: float = MOST,
) -> PulledBack:
    """The cut that a knife makes in the deformed body at a checkpoint of its reference, as a plane at rest.

    `plane` is the knife and `within` its blade (level <= 0), both as they lie in the deformed body [m]. The points at
    which sides of elements cross the knife are computed in both configurations; at rest a plane and a straight front
    are fitted to them by least squares. The cut is made at the time of the checkpoint; `dataclasses.replace` gives it
    contact, an advance or a free piece.

    Raises StudyError for a symmetric scene, for which only an octant is solved, for an unknown checkpoint, for a knife
    or blade that misses the body, and for a knife or front that is farther than `most` times the size of the body from
    the plane or line that replaces it.
    """
    scene = solution.scene
    words = f"scene '{scene.name}': knife '{name}'"
    if scene.symmetric:
        raise StudyError(f"{words} is in a scene that is solved on an octant; take one that is not symmetric")
    if not 0 <= checkpoint < len(scene.checkpoints):
        raise StudyError(f"{words} is at checkpoint {checkpoint}, and there are {len(scene.checkpoints)}, from 0 on")
    rest, displacement = solution.field("nodes"), solution.field("displacement")[checkpoint]
    level = plane.level(rest + displacement)
    places, moved = _crossings(element_nodes(solution.mesh), level, rest, rest + displacement)
    beyond = np.full(len(moved), -np.inf) if within is None else within.level(moved)
    covered = places[beyond <= 0]
    if len(covered) < FEWEST:
        raise StudyError(
            f"{words} misses the body as it is at {scene.checkpoints[checkpoint]:g} s; move plane or blade"
        )
    centre, normal, off = _plane_through(covered)
    if ((rest - centre) @ normal) @ np.sign(level) < 0:
        normal = -normal
    _check_straight(words, "plane", off, most, solution.size)
    front, front_off = None, 0.0
    if within is not None and (beyond > 0).any():
        front, front_off = _front(words, places, beyond, centre, normal, solution.size)
        _check_straight(words, "front", front_off, most, solution.size)
    cut = Cut(name, HalfSpace(_vector(centre), _vector(normal)), front, at=float(scene.checkpoints[checkpoint]))
    return PulledBack(cut, off, front_off)


def _crossings(
    cells: np.ndarray, level: np.ndarray, rest: np.ndarray, moved: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Where halves of the sides of ten-node `cells` (c, 10) cross level (n,) = 0, in both configurations, (p, 3)."""
    halves = np.stack([cells[:, SIDES], np.repeat(cells[:, 4:, None], 2, axis=2)], axis=-1)
    one, other = np.unique(halves.reshape(-1, 2), axis=0).T
    crossed = (level[one] > 0) != (level[other] > 0)
    one, other = one[crossed], other[crossed]
    share = (level[one] / (level[one] - level[other]))[:, None]
    return (1 - share) * rest[one] + share * rest[other], (1 - share) * moved[one] + share * moved[other]


def _plane_through(places: np.ndarray) -> tuple[np.ndarray, np.ndarray, float]:
    """Centre (3,) and unit normal (3,) of the plane nearest to places (p, 3), and the largest distance from it."""
    centre = places.mean(axis=0)
    normal = np.linalg.svd(places - centre, full_matrices=False)[2][2]
    return centre, normal, float(np.abs((places - centre) @ normal).max())


def _front(
    words: str, places: np.ndarray, beyond: np.ndarray, centre: np.ndarray, normal: np.ndarray, size: float
) -> tuple[HalfSpace, float]:
    """The blade at rest, whose front is a straight line in the plane, and the largest distance of the pulled-back front
    from it. `beyond` (p,) is how far places (p, 3) on the knife lie beyond the front in the deformed body [m]."""
    near = np.abs(beyond) <= BAND * size
    if near.sum() < FEWEST:
        raise StudyError(f"{words} has a front that does not cross the body; move the blade, or leave it out")
    inside = np.linalg.svd(normal[None])[2][1:]  # two directions in the plane
    flat = (places[near] - centre) @ inside.T
    columns = np.column_stack([np.ones(len(flat)), flat])
    offset, *slope = np.linalg.lstsq(columns, beyond[near])[0]
    steep = float(np.linalg.norm(slope))
    if not steep > 0:
        raise StudyError(f"{words} has a front along its own plane; turn the blade")
    towards = np.asarray(slope) @ inside / steep
    line = centre - offset / steep * towards
    off = float(np.abs(beyond[near] - columns @ [offset, *slope]).max()) / steep
    return HalfSpace(_vector(line), _vector(towards)), off


def _check_straight(words: str, part: str, off: float, most: float, size: float) -> None:
    if off > most * size:
        raise StudyError(
            f"{words}: at rest its {part} is curved by {1e3 * off:.3g} mm, {100 * off / size:.2g} % of the size of the "
            f"body (at most {100 * most:.2g} %); cut where the body is less deformed, or with a smaller blade"
        )


def _vector(values: np.ndarray) -> tuple[float, float, float]:
    x, y, z = (float(value) for value in values)
    return x, y, z
