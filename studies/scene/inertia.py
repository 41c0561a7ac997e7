"""Whether a scene is so slow that the distribution of mass in its body does not matter."""

import numpy as np

from massspring import Probe, Trajectory
from studies.scene.scene import Scene

SLOW = 0.01
"""Speed of loads over that of a shear wave below which they are slow: inertia, which varies as its square, then adds
about 1e-4 to the forces."""


def why_inertia_matters(scene: Scene) -> str | None:
    """Why masses other than those of the tissue would change the results of the scene; None if loads are so slow that
    the body passes through equilibria. Gravity on a held body is no reason, since it always acts on the masses of the
    tissue."""
    if scene.start is not None:
        return "it starts in motion or out of shape, and rings"
    if scene.reference is not None and scene.reference.dt is not None:
        return "its reference is a motion in time"
    if any(scene.gravity) and not scene.held:
        return "nothing holds the body, so it falls"
    if any(isinstance(obstacle, Probe) for obstacle in scene.obstacles):
        return "a thin probe moves one triangle at a time, which answers by its mass"
    wave = float(np.sqrt(scene.tissue.shear_modulus / scene.tissue.density))
    for path in [moving.path for moving in (*scene.obstacles, *scene.held)]:
        if turns(path):
            return "an obstacle or clamped region changes its direction"
        if top_speed(path) > SLOW * wave:
            return (
                f"an obstacle or clamped region moves at {1e3 * top_speed(path):.3g} mm/s, "
                f"more than 1 % of the speed of shear waves in the tissue, {wave:.2g} m/s"
            )
    return None


def why_not_heavier(scene: Scene) -> str | None:
    """Why a body may not be heavier than its tissue in a slow scene, as far as the scene alone tells."""
    fills = scene.lumen is not None and scene.lumen.changes
    moves = fills or any(top_speed(mover.path) > 0.0 for mover in (*scene.obstacles, *scene.held))
    if not scene.held:
        return "nothing holds it"
    if scene.cuts:
        return "a cut lets it swing"
    if any(scene.gravity) and moves:
        return "its weight lets it swing while loads move"
    return None


def top_speed(path: Trajectory) -> float:
    """Largest speed along a path [m/s]."""
    return float(max(np.linalg.norm(velocities(path), axis=1), default=0.0))


def turns(path: Trajectory) -> bool:
    """Whether a path changes its direction; it may rest in between."""
    moves = velocities(path)
    length = np.linalg.norm(moves, axis=1)
    ways = moves[length > 0] / length[length > 0, None]
    return bool((np.abs(np.diff(ways, axis=0)) > 1e-9).any())


def velocities(path: Trajectory) -> np.ndarray:
    """Between key positions [m/s], (k − 1, 3)."""
    return np.diff(path.displacements, axis=0) / np.diff(path.times)[:, None]
