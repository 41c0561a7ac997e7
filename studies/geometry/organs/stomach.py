"""Stomach: a J of two tubes, hollow. Axes as the liver's: x to the patient's left, y to the back, z to the head."""

import numpy as np

from studies.geometry.blends import canal, closed, local_min
from studies.geometry.levelset import Literature, Shape
from studies.geometry.organs.millimetres import MM, box_of, check_lengths, check_wall, metres, si, touch
from studies.geometry.regions import BallRegion

CAPACITY = Literature(1000.0, "Ferrua and Singh, J. Food Sci. 75 (2010) R151: about 1 L after a meal")


def stomach_shape(
    height: float = 215.0, fundus: float = 48.0, body: float = 45.0, antrum: float = 26.0, wall: float = 4.5
) -> Shape:
    """A distended adult stomach: fundus above the cardia, body, incisura, antrum rising to the pylorus [mm].

    height: from the fundus to the lowest point of the greater curvature; fundus, body, antrum: outer radii. A wall of
    4-5 mm (Rapaccini et al., J. Ultrasound Med. 7 (1988)), a tube 35 mm wide at both ends (cardia and pylorus).
    Raises StudyError for a length that is none and a wall that fills the pylorus.
    """
    check_lengths("stomach", height=height, fundus=fundus, body=body, antrum=antrum, wall=wall)
    check_wall("stomach", wall, 0.68 * antrum)
    h, f, b, a = height, fundus, body, antrum
    sac = closed(
        [(32, 18, 0.25 * h, 1.05 * f), (44, 8, 0.1 * h, b), (40, -6, -0.16 * h, b), (14, -12, -0.3 * h, 0.82 * b)]
    )
    exit_ = closed(
        [
            (30, -10, -0.28 * h, 1.05 * a),
            (-6, -14, -0.37 * h, 1.4 * a),
            (-48, -8, -0.32 * h, 1.15 * a),
            (-70, 10, -0.15 * h, 0.68 * a),
        ]
    )
    gullet = closed([(10, 18, 0.13 * h, 0.68 * a), (-10, 18, 0.16 * h, 0.68 * a), (-30, 16, 0.26 * h, 0.68 * a)])

    def level(x: np.ndarray) -> np.ndarray:
        # Where body and antrum meet on the lesser curvature, the blend leaves the incisura.
        return local_min(local_min(canal(x, sac), canal(x, exit_), 16), canal(x, gullet), 20)

    low, high = box_of(sac, exit_, gullet)
    regions = {
        "cardia": BallRegion(metres(*gullet[-1][:3]), 0.68 * a * MM),
        "pylorus": BallRegion(metres(*exit_[-1][:3]), 0.68 * a * MM),
    }
    probe = touch(level, (42, -200, 0), (0, 1, 0))
    return Shape("stomach", si(level), low, high, 5 * MM, regions, wall * MM, CAPACITY, probe, (0.0, 1.0, 0.0))


STOMACH_REGIONS = stomach_shape().regions
