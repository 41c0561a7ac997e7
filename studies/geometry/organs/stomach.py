"""Stomach: a J of two tubes, hollow. Axes: x to the patient's left, y to the back, z to the head."""

import numpy as np

from studies.geometry.organs.millimetres import MM, box_of, check_lengths, check_wall, metres, si, touch
from studies.geometry.shape.blends import canal, closed, local_min
from studies.geometry.shape.levelset import Literature, Shape
from studies.geometry.shape.regions import BallRegion

CAPACITY = Literature(1000.0, "Ferrua and Singh, J. Food Sci. 75 (2010) R151: about 1 L after a meal")


def stomach_shape(
    height: float = 203.0,
    width: float = 166.0,
    fundus: float = 48.0,
    body: float = 45.0,
    antrum: float = 26.0,
    wall: float = 4.5,
) -> Shape:
    """A distended adult stomach: fundus above the cardia, body, incisura, antrum rising to the pylorus [mm].

    height, width: of the whole stomach, seen from the front; fundus, body, antrum: outer radii. A real wall is
    4.9 ± 1.6 mm thick (Suk et al., J. Clin. Ultrasound 36 (2008) 462). Cardia and pylorus end in tubes of the outer
    radius 0.68 antrum. Raises StudyError unless every length is finite and above 0, and for a wall over 0.75 of that
    radius.
    """
    check_lengths("stomach", height=height, width=width, fundus=fundus, body=body, antrum=antrum, wall=wall)
    check_wall("stomach", wall, 0.68 * antrum)
    h, w, f, b, a = height, width, fundus, body, antrum
    upper = [(0.19 * w, 0.4 * b, 0.265 * h, 1.05 * f), (0.26 * w, 0.18 * b, 0.105 * h, b)]
    lower = [(0.24 * w, -0.13 * b, -0.17 * h, b), (0.085 * w, -0.27 * b, -0.32 * h, 0.82 * b)]
    sinus = [(0.18 * w, -0.22 * b, -0.295 * h, 1.05 * a), (-0.035 * w, -0.3 * b, -0.39 * h, 1.4 * a)]
    outlet = [(-0.29 * w, -0.18 * b, -0.34 * h, 1.15 * a), (-0.42 * w, 0.22 * b, -0.16 * h, 0.68 * a)]
    cardia = [(0.06 * w, 0.4 * b, 0.14 * h), (-0.06 * w, 0.4 * b, 0.17 * h), (-0.18 * w, 0.36 * b, 0.275 * h)]
    sac, exit_, gullet = closed([*upper, *lower]), closed([*sinus, *outlet]), closed([(*c, 0.68 * a) for c in cardia])

    def level(x: np.ndarray) -> np.ndarray:
        # The incisura remains where body and antrum meet on the lesser curvature.
        return local_min(local_min(canal(x, sac), canal(x, exit_), 16), canal(x, gullet), 20)

    low, high = box_of(sac, exit_, gullet)
    regions = {
        "cardia": BallRegion(metres(*gullet[-1][:3]), 0.68 * a * MM),
        "pylorus": BallRegion(metres(*exit_[-1][:3]), 0.68 * a * MM),
    }
    probe = touch(level, (0.25 * w, -5 * b, 0), (0, 1, 0))
    return Shape("stomach", si(level), low, high, 5 * MM, regions, wall * MM, CAPACITY, probe, (0.0, 1.0, 0.0))


STOMACH_REGIONS = stomach_shape().regions
