"""Filling a closed surface with tetrahedra, and insisting on their quality."""

import numpy as np

from studies.errors import StudyError
from studies.geometry.gmsh_session import fill_once
from studies.geometry.quality import MIN_DIHEDRAL, MIN_RATIO, dihedral_angles, tetrahedron_radius_ratio

DELAUNAY, FRONTAL, HXT = 1, 4, 10


def fill_surface(points: np.ndarray, triangles: np.ndarray, strict: bool = True) -> tuple[np.ndarray, np.ndarray]:
    """All points (n, 3) [m], the surface's first, and good tetrahedra (k, 4) inside a closed surface.

    Several algorithms are tried in a fixed order until the worst element is good enough. Raises StudyError when all
    fail, or, when strict, the best is still worse than MIN_DIHEDRAL or MIN_RATIO.
    """
    # Netgen's optimiser doubles the worst angle but takes seconds where there are many elements.
    attempts = (
        [(DELAUNAY, True), (FRONTAL, True), (HXT, False)] if len(points) <= 3000 else [(HXT, False), (DELAUNAY, False)]
    )
    best: tuple[float, np.ndarray, np.ndarray] | None = None
    failures: list[str] = []
    for algorithm, netgen in attempts:
        try:
            all_points, tetrahedra = fill_once(points, triangles, seed=1, algorithm=algorithm, netgen=netgen)
        except StudyError as error:
            failures.append(str(error))
            continue
        score = fill_score(all_points, tetrahedra)
        if best is None or score > best[0]:
            best = (score, all_points, tetrahedra)
        if score >= 1.5:
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
    """Worst dihedral angle and radius ratio in units of their limits, the smaller of the two; 1 is just acceptable."""
    angle = dihedral_angles(points, tetrahedra).min() / MIN_DIHEDRAL
    ratio = tetrahedron_radius_ratio(points, tetrahedra).min() / MIN_RATIO
    return float(min(angle, ratio))
