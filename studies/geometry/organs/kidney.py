"""Left kidney: an upright bean with its hilum towards the spine. Axes: see liver.py."""

import numpy as np

from studies.geometry.organs.millimetres import MARGIN, MM, check_lengths, metres, si, touch
from studies.geometry.shape.blends import canal, closed, ellipsoid, smooth_max
from studies.geometry.shape.levelset import Literature, Shape
from studies.geometry.shape.regions import EllipsoidRegion

VOLUME = Literature(
    150.0, "137 ± 30 mL by ultrasound (Lee, J. Korean Soc. Med. Ultrasound 15 (1996) 63), 150 g in textbooks"
)


def kidney_shape(length: float = 110.0, width: float = 60.0, thickness: float = 47.0, sinus: float = 20.0) -> Shape:
    """An adult's kidney [mm]: 10.6 ± 0.6 cm long (Lee 1996, as for the volume), 6 wide, 4-5 thick.

    sinus: depth of the hollow behind the lips of the hilum. Raises StudyError unless every length is finite and above
    0.
    """
    check_lengths("kidney", length=length, width=width, thickness=thickness, sinus=sinus)
    w, half = 0.5 * width, 0.5 * length
    upper, lower = (-0.16 * w, 0, half - 0.84 * w, w), (-0.16 * w, 0, 0.84 * w - half, w)
    bean = closed([upper, (0.16 * w, 0, 0.3 * half, w), (0.16 * w, 0, -0.3 * half, w), lower])
    hilum, slit = (-0.88 * w, -0.06 * w, 0), (sinus, 0.18 * thickness, 0.18 * length)

    def level(x: np.ndarray) -> np.ndarray:
        # Flattened from front to back, and hollowed between two lips where vessels and ureter enter.
        outer = canal(x * (1.0, width / thickness, 1.0), bean)
        return smooth_max(outer, -ellipsoid(x, hilum, slit), 11)

    high = metres(1.3 * w + MARGIN, 0.55 * thickness + MARGIN, half + MARGIN)
    regions = {"hilum": EllipsoidRegion(metres(*hilum), metres(w, 0.32 * thickness, 0.24 * length))}
    probe = touch(level, (0.3 * w, -3 * w, 0), (0, 1, 0))
    low, press = (-high[0], -high[1], -high[2]), (0.0, 1.0, 0.0)
    return Shape("kidney", si(level), low, high, 4 * MM, regions, None, VOLUME, probe, press)


KIDNEY_REGIONS = kidney_shape().regions
