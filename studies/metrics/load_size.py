"""How large the loads of a scene are, in numbers without units, against the largest with which errors were measured."""

import numpy as np

from massspring import Capsule, Plane, Sphere
from studies.scene.scene import Scene

LARGEST = {
    "planes go into the organ by {} of its thickness": 0.45,
    "a sphere or capsule goes into the organ by {} of its thickness": 1.0 / 3.0,
    "a clamped region moves by {} of the organ's size": 0.15,
    "its weight is {} of its stiffness (rho g L / mu)": 0.5,
    "its lumen changes by {} of its volume": 0.3,
}
"""Of the scenes of the catalogue and of the random ones of studies.lab.campaign, whose bodies were held against
references; hanging organs that are heavier fold or turn inside out."""
MOMENTS = 200
"""On the way of an obstacle."""


def beyond(scene: Scene, points: np.ndarray) -> str:
    """ "planes go into the organ by 0.78 of its thickness (measured up to 0.45)", of each such load; empty where none
    is larger. points: (n, 3), of the surface of the organ at rest [m]."""
    size = float(np.linalg.norm(np.ptp(points, axis=0)))
    planes, tools, pulls = 0.0, 0.0, 0.0
    for obstacle in scene.obstacles:
        if not isinstance(obstacle, Plane | Sphere | Capsule):
            continue
        depth, thickness = _into(obstacle, points)
        if isinstance(obstacle, Plane):
            planes += depth / thickness
        else:
            tools = max(tools, depth / thickness)
    for held in scene.held:
        moved = np.subtract(held.path.displacements, held.path.displacements[0])
        pulls = max(pulls, float(np.linalg.norm(moved, axis=1).max()) / size)
    tissue, lumen = scene.tissue, scene.lumen
    weight = tissue.density * float(np.linalg.norm(scene.gravity)) * size / tissue.shear_modulus
    filling = (1.0,) if lumen is None else lumen.filling.values
    filled = max(abs(value / filling[0] - 1.0) for value in filling)
    sizes = zip(LARGEST.items(), (planes, tools, pulls, weight, filled), strict=True)
    larger = [f"{words.format(f'{a:.3g}')} (measured up to {most:.2g})" for (words, most), a in sizes if a > most]
    return ", ".join(larger)


def _into(obstacle: Plane | Sphere | Capsule, points: np.ndarray) -> tuple[float, float]:
    """How far an obstacle goes on in the direction in which it first touches the organ, and the thickness of the organ
    in this direction [m]."""
    times = np.linspace(obstacle.path.times[0], obstacle.path.times[-1], MOMENTS)
    place = obstacle.path(times)
    first = next((k for k, t in enumerate(times) if obstacle.gap(points, float(t)).min() <= 0.0), MOMENTS)
    steps = np.diff(place[max(first - 1, 0) :], axis=0)
    length = np.linalg.norm(steps, axis=1)
    if not length.any():
        return 0.0, 1.0
    moving = int(np.flatnonzero(length)[0])
    way = steps[moving] / length[moving]
    return float(((place[first:] - place[first]) @ way).max()), float(np.ptp(points @ way))
