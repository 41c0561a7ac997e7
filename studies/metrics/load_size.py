"""How large the loads of a scene are, in numbers without units, against the largest with which errors were measured."""

import numpy as np

from massspring import Capsule, Plane, Sphere, Trajectory
from studies.scene.scene import Scene

LARGEST = {
    "planes go into the organ by {} of its thickness": 0.45,
    "a sphere or capsule goes into the organ by {} of the thickness under it": 1.0 / 3.0,
    "a clamped region moves by {} of the organ's size": 0.15,
    "its weight rho g L is {} times its shear modulus": 0.5,
    "its lumen changes by {} of its volume": 0.3,
}
"""Of the scenes of the catalogue and of the random ones of studies.lab.campaign, whose bodies were held against
references; hanging organs that are heavier fold or turn inside out."""
MOMENTS, UNDER = 200, 20
"""Of a scene, at which its paths are looked at; points of a surface by which the thickness under a tool is known."""


def beyond(scene: Scene, points: np.ndarray) -> str:
    """ "planes go into the organ by 0.78 of its thickness (measured up to 0.45)", of each such load; empty where none
    is larger. points: (n, 3), of the surface of the organ at rest [m]."""
    size = float(np.linalg.norm(np.ptp(points, axis=0)))
    planes, tools, pulls = 0.0, 0.0, 0.0
    for obstacle in scene.obstacles:
        if isinstance(obstacle, Plane):
            planes += _into(obstacle, scene.duration, points)
        elif isinstance(obstacle, Sphere | Capsule):
            tools = max(tools, _into(obstacle, scene.duration, points))
    for held in scene.held:
        place = held.path(_moments(held.path, scene.duration))
        pulls = max(pulls, float(np.linalg.norm(place - place[0], axis=1).max()) / size)
    tissue = scene.tissue
    weight = tissue.density * float(np.linalg.norm(scene.gravity)) * size / tissue.shear_modulus
    filled = 0.0 if scene.lumen is None else max(abs(value - 1.0) for value in scene.lumen.filling.values)
    sizes = zip(LARGEST.items(), (planes, tools, pulls, weight, filled), strict=True)
    larger = [f"{words.format(f'{a:.3g}')} (measured up to {most:.2g})" for (words, most), a in sizes if a > most]
    return ", ".join(larger)


def _moments(path: Trajectory, duration: float) -> np.ndarray:
    """Times in a scene [s], among them those of the keys of a path."""
    keys = np.clip(path.times, 0.0, duration)
    return np.union1d(np.linspace(0.0, duration, MOMENTS), keys)


def _into(obstacle: Plane | Sphere | Capsule, duration: float, points: np.ndarray) -> float:
    """How far an obstacle goes on in the direction in which it first touches the organ, over the thickness there."""
    times = _moments(obstacle.path, duration)
    place = obstacle.path(times)
    first = next((k for k, t in enumerate(times) if obstacle.gap(points, float(t)).min() <= 0.0), len(times))
    steps = np.diff(place[max(first - 1, 0) :], axis=0)
    length = np.linalg.norm(steps, axis=1)
    if not length.any():
        return 0.0
    moving = int(np.flatnonzero(length)[0])
    way = steps[moving] / length[moving]
    return float(((place[first:] - place[first]) @ way).max()) / _thickness(obstacle, place[first], way, points)


def _thickness(obstacle: Plane | Sphere | Capsule, moved: np.ndarray, way: np.ndarray, points: np.ndarray) -> float:
    """Of the organ along `way`, for a sphere or capsule of the part in front of it [m]; moved: the obstacle [m]."""
    along = points @ way
    if isinstance(obstacle, Plane):
        return float(np.ptp(along))
    side = points - obstacle.anchor - moved
    side -= np.outer(side @ way, way)
    if isinstance(obstacle, Capsule):
        span = obstacle.span - (obstacle.span @ way) * way
        side -= np.outer(np.clip(side @ span / max(float(span @ span), 1e-30), 0.0, 1.0), span)
    away = np.linalg.norm(side, axis=1)
    few = min(UNDER, len(away) - 1)
    return float(np.ptp(along[away <= max(obstacle.radius, np.partition(away, few)[few])]))
