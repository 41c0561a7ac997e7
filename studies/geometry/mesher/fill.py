"""Fills a closed surface with tetrahedra of sufficient quality."""

import numpy as np

from studies.base.errors import StudyError
from studies.geometry.mesh.quality import MIN_DIHEDRAL, MIN_RATIO, dihedral_angles, tetrahedron_radius_ratio
from studies.geometry.mesher.gmsh_calls import fill_once

DELAUNAY, FRONTAL, HXT = 1, 4, 10
MANY = 3000
"""Surface nodes beyond which the fill is graded, that is, elements grow inwards; else most would lie deep inside."""
FEW_ATTEMPTS = ((DELAUNAY, True, False), (FRONTAL, True, False), (HXT, False, False))
MANY_ATTEMPTS = ((HXT, False, True), (DELAUNAY, False, True), (HXT, False, False))
"""(algorithm, whether the Netgen optimiser runs, whether graded). Netgen doubles the worst angle, but takes seconds for
many elements."""


def fill_surface(points: np.ndarray, triangles: np.ndarray, strict: bool = True) -> tuple[np.ndarray, np.ndarray]:
    """Fills a closed surface: all points (n, 3) [m], those of the surface first, and tetrahedra (k, 4).

    It tries several algorithms in a fixed order until the worst element is good enough, and takes the best fill. Raises
    StudyError if all fail, and, if `strict`, for an element worse than MIN_DIHEDRAL or MIN_RATIO.
    """
    attempts, enough = (FEW_ATTEMPTS, 1.5) if len(points) <= MANY else (MANY_ATTEMPTS, 1.25)
    best: tuple[float, np.ndarray, np.ndarray] | None = None
    failures: list[str] = []
    for algorithm, netgen, graded in attempts:
        try:
            all_points, tetrahedra = fill_once(points, triangles, algorithm, netgen, graded)
        except StudyError as error:
            failures.append(str(error))
            continue
        score = fill_score(all_points, tetrahedra)
        if best is None or score > best[0]:
            best = (score, all_points, tetrahedra)
        if score >= enough:
            break
    if best is None:
        raise StudyError(f"the surface of {len(points)} nodes could not be filled with tetrahedra: {failures[-1]}")
    if strict and best[0] < 1.0:
        raise StudyError(
            f"the best fill of the surface of {len(points)} nodes has an element with a dihedral angle under "
            f"{MIN_DIHEDRAL:g} degrees or a radius ratio under {MIN_RATIO:g}; "
            "use more nodes where it is thin, or a smoother surface"
        )
    return best[1], best[2]


def fill_score(points: np.ndarray, tetrahedra: np.ndarray) -> float:
    """The smaller of worst dihedral angle and worst radius ratio, each over its limit [1]; 1 is just acceptable."""
    angle = dihedral_angles(points, tetrahedra).min() / MIN_DIHEDRAL
    ratio = tetrahedron_radius_ratio(points, tetrahedra).min() / MIN_RATIO
    return float(min(angle, ratio))
