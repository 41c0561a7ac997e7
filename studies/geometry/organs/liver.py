"""Liver: a wedge under the diaphragm, thick on the right, tapering to the left, hollowed from below.

Axes: x to the patient's left, y to the back, z to the head; the origin lies in the right lobe. Lengths in millimetres
after the usual sonographic sizes (width 20-23 cm, right lobe 14-16 cm high and 10-13 cm deep, about 1,500 mL).
"""

from dataclasses import replace

import numpy as np

from studies.geometry.blends import ellipsoid, groove, smooth_max, smooth_min
from studies.geometry.levelset import Literature, Probe, Shape, normals, project
from studies.geometry.regions import EllipsoidRegion, Vector

MM = 1e-3
BARE_AREA = EllipsoidRegion(center=(-0.035, 0.053, 0.043), semi_axes=(0.045, 0.040, 0.026))
"""Where the liver grows to the diaphragm, behind and above the right lobe: about 41 cm² of its surface."""
LIVER_REGIONS: dict[str, EllipsoidRegion] = {"bare_area": BARE_AREA}


def liver_level(points: np.ndarray) -> np.ndarray:
    """Level [m], shape (n,), of points [m], shape (n, 3): the space under the diaphragm less what presses up."""
    x = points / MM
    right = ellipsoid(x, (-38, 4, -7), (73, 64, 84))
    left = ellipsoid(x, (38, -17, 28), (80, 43, 32))
    dome = smooth_min(right, left, 24)
    # Kidney, colon and duodenum below the right lobe and the stomach below the left press their hollows.
    bowel = ellipsoid(x, (53, 84, -151), (175, 175, 175))
    stomach = ellipsoid(x, (97, 17, -70), (92, 92, 92))
    body = smooth_max(dome, -smooth_min(bowel, stomach, 20), 9)
    falciform = groove(x, (17, -55, 63), (17, -63, -17), 9, 5)
    notch = groove(x, (17, -75, -42), (17, -18, -14), 12, 30)
    gallbladder = groove(x, (-22, -70, -70), (-6, 0, -18), 13, 9)
    cava = groove(x, (2, 62, 70), (2, 62, -20), 14, 9)
    return (body + falciform + notch + gallbladder + cava) * MM


def _plain_liver() -> Shape:
    return Shape("liver", liver_level, (-0.13, -0.08, -0.1), (0.14, 0.09, 0.1), cell=0.005, regions=LIVER_REGIONS)


def liver_shape() -> Shape:
    """The liver of an adult."""
    literature = Literature(1500.0, "Henderson et al., Radiology 141 (1981) 525: 1,493 mL by CT")
    probe = Probe(LIVER_PROBE_POINT, LIVER_PROBE_NORMAL)
    return replace(_plain_liver(), literature=literature, probe=probe, press=LIVER_PRESS_DIRECTION)


def project_liver(points: np.ndarray) -> np.ndarray:
    """Points, shape (n, 3) [m], brought onto the liver's true surface along the gradient of its level."""
    return project(_plain_liver(), points)


def _vector(row: np.ndarray) -> Vector:
    return float(row[0]), float(row[1]), float(row[2])


LIVER_PROBE_POINT: Vector = _vector(project_liver(np.array([[-45.0, -57.0, -33.0]]) * MM)[0])
"""Point of the surface, low on the front of the right lobe, where an instrument palpates [m]; smooth 3 cm around."""
LIVER_PROBE_NORMAL: Vector = _vector(normals(_plain_liver(), np.array([LIVER_PROBE_POINT]))[0])
"""Outward normal there; a probe moves against it."""
LIVER_PRESS_DIRECTION: Vector = (0.0, 0.9, 0.19**0.5)
"""Unit vector, to the back and up: a plane with this normal, moving along it from the front, meets the smooth front of
the right lobe first, away from the thin margin, and presses the liver against its bare area."""
