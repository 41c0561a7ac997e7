"""Spleen: a curved wedge under the left ribs, which stomach and kidney hollow. Axes: x outwards to the ribs, y to the
back along the tenth rib, z to the superior border."""

import numpy as np

from studies.geometry.organs.millimetres import MARGIN, MM, check_lengths, metres, si, touch
from studies.geometry.shape.blends import ellipsoid, groove, smooth_max, smooth_min
from studies.geometry.shape.levelset import Literature, Shape
from studies.geometry.shape.regions import EllipsoidRegion

VOLUME = Literature(200.0, "Prassopoulos et al., Eur. Radiol. 7 (1997) 246: 215 mL, 107 to 315, by CT")


def spleen_shape(length: float = 126.0, width: float = 82.0, thickness: float = 50.0, notch: float = 10.0) -> Shape:
    """An adult's spleen [mm]: 10-12 cm long, 7-9 wide, 4.6 thick (Caglar et al., Folia Morphol. 73, 2014).

    length, width: of the wedge before the hollows, which leave 119 by 76 mm by default; notch: depth of the notches in
    the superior border. Raises StudyError unless every length is finite and above 0.
    """
    check_lengths("spleen", length=length, width=width, thickness=thickness, notch=notch)
    u, v, t = 0.5 * length, 0.5 * width, thickness

    def level(x: np.ndarray) -> np.ndarray:
        outer = ellipsoid(x, (-0.4 * t, 0, 0), (0.9 * t, u, v))
        stomach = ellipsoid(x, (-1.25 * t, -0.5 * u, 0.35 * v), (t, 1.2 * u, 1.2 * v))
        kidney = ellipsoid(x, (-1.25 * t, 0.5 * u, -0.75 * v), (0.9 * t, u, v))
        body = smooth_max(outer, -smooth_min(stomach, kidney, 8), 10)
        # The superior border has notches towards its front end, remains of the lobes of the embryo.
        for y in (-0.55, -0.15):
            body = body + groove(x, (0.3 * t, y * u, 1.1 * v), (-t, y * u, 0.75 * v), 6, notch)
        return body

    low = metres(-1.2 * t - MARGIN, -u - MARGIN, -v - MARGIN)
    high = metres(0.6 * t + MARGIN, u + MARGIN, v + MARGIN)
    regions = {"hilum": EllipsoidRegion(metres(-0.35 * t, 0, -0.15 * v), metres(0.5 * t, 0.42 * u, 0.3 * v))}
    probe = touch(level, (4 * t, 0, 0), (-1, 0, 0))
    return Shape("spleen", si(level), low, high, 4 * MM, regions, None, VOLUME, probe, (-1.0, 0.0, 0.0))


SPLEEN_REGIONS = spleen_shape().regions
