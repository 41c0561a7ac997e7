"""Stomach: a J of two tubes, hollow. Axes as the liver's: x to the patient's left, y to the back, z to the head."""

import numpy as np

from studies.geometry.blends import canal, closed, smooth_min
from studies.geometry.levelset import Literature, Shape
from studies.geometry.organs.millimetres import MM, box_of, check_lengths, check_wall, metres, si, touch
from studies.geometry.regions import BallRegion

CAPACITY = Literature(1000.0, "Ferrua and Singh, J. Food Sci. 75 (2010) R151: about 1 L after a meal")


def stomach_shape(
    height: float = 215.0, fundus: float = 50.0, body: float = 46.0, antrum: float = 26.0, wall: float = 4.5
) -> Shape:
    """A distended adult stomach: fundus above the cardia, body, incisura, antrum rising to the pylorus [mm].

    height: from the fundus to the lowest point of the greater curvature; fundus, body, antrum: outer radii. A wall of
    4-5 mm (Rapaccini et al., J. Ultrasound Med. 7 (1988)), a tube 25-30 mm wide at both ends (pylorus and cardia).
    Raises StudyError for a length that is none and a wall that fills the pylorus.
    """
    check_lengths("stomach", height=height, fundus=fundus, body=body, antrum=antrum, wall=wall)
    check_wall("stomach", wall, 0.5 * antrum)
    h, f, b, a = height, fundus, body, antrum
    sac = closed(
        [(30, 18, 0.26 * h, 1.1 * f), (44, 8, 0.1 * h, b), (40, -6, -0.16 * h, b), (12, -12, -0.31 * h, 0.85 * b)]
    )
    exit_ = closed(
        [
            (30, -10, -0.28 * h, 1.1 * a),
            (-6, -14, -0.38 * h, 1.5 * a),
            (-48, -8, -0.33 * h, 1.15 * a),
            (-72, 10, -0.15 * h, 0.5 * a),
        ]
    )
    gullet = closed([(20, 18, 0.13 * h, 0.55 * a), (-10, 18, 0.15 * h, 0.55 * a), (-32, 16, 0.26 * h, 0.5 * a)])

    def level(x: np.ndarray) -> np.ndarray:
        # Where body and antrum meet on the lesser curvature, the blend leaves the incisura.
        return smooth_min(smooth_min(canal(x, sac), canal(x, exit_), 8), canal(x, gullet), 8)

    low, high = box_of(sac, exit_, gullet)
    regions = {
        "cardia": BallRegion(metres(*gullet[-1][:3]), 0.54 * a * MM),
        "pylorus": BallRegion(metres(*exit_[-1][:3]), 0.54 * a * MM),
    }
    probe = touch(level, (42, -200, 0), (0, 1, 0))
    return Shape("stomach", si(level), low, high, 5 * MM, regions, wall * MM, CAPACITY, probe, (0.0, 1.0, 0.0))


STOMACH_REGIONS = stomach_shape().regions
