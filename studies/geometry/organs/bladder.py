"""Urinary bladder, hollow: an egg that points forward, with a flattened dome and the neck below. Axes: see liver.py."""

import numpy as np

from studies.geometry.organs.millimetres import MARGIN, MM, check_lengths, check_wall, metres, si, touch
from studies.geometry.shape.blends import canal, closed, ellipsoid, local_min, smooth_max
from studies.geometry.shape.levelset import Literature, Shape
from studies.geometry.shape.regions import BallRegion

CAPACITY = Literature(
    400.0, "Lukacz et al., Int. J. Clin. Pract. 65 (2011) 1026: capacity of healthy adults 300-400 mL"
)


def bladder_shape(
    width: float = 106.0, depth: float = 97.0, height: float = 95.0, neck: float = 13.0, wall: float = 4.0
) -> Shape:
    """A well filled adult bladder [mm].

    width, depth, height: of the egg without apex and neck; neck: its outer radius. The wall is up to 3 mm thick when
    the bladder is full and 5 mm when it is empty (Jequier, Am. J. Roentgenol. 149 (1987) 563). Raises StudyError
    unless every length is finite and above 0, and for a wall over 0.75 of the neck.
    """
    check_lengths("bladder", width=width, depth=depth, height=height, neck=neck, wall=wall)
    check_wall("bladder", wall, neck)
    a, b, c = 0.5 * width, 0.5 * depth, 0.5 * height
    funnel = closed([(0, 2, -0.5 * c, 2.0 * neck), (0, 4, -0.95 * c, neck), (0, 4, -1.35 * c, neck)])

    def level(x: np.ndarray) -> np.ndarray:
        apex = ellipsoid(x, (0, -0.5 * b, 0.3 * c), (0.5 * a, 0.75 * b, 0.5 * c))
        egg = local_min(ellipsoid(x, (0, 4, 0), (a, b, c)), apex, 18)
        flat = smooth_max(egg, ellipsoid(x, (0, 0, -2.1 * c), (3 * c, 3 * c, 3 * c)), 12)
        return local_min(flat, canal(x, funnel), 16)

    low = metres(-a - MARGIN, -1.4 * b - MARGIN, -1.5 * c - neck - MARGIN)
    high = metres(a + MARGIN, 1.2 * b + MARGIN, c + MARGIN)
    regions = {"neck": BallRegion(metres(*funnel[-1][:3]), 1.2 * neck * MM)}
    probe = touch(level, (0, 0.2 * b, 4 * c), (0, 0, -1))
    return Shape("bladder", si(level), low, high, 4 * MM, regions, wall * MM, CAPACITY, probe, (0.0, 0.0, -1.0))


BLADDER_REGIONS = bladder_shape().regions
