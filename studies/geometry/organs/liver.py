"""Liver: a wedge under the diaphragm, thick on the right, thin on the left, with hollows on its underside.

Axes: x to the patient's left, y to the back, z to the head; the origin lies in the right lobe.
"""

from dataclasses import replace

import numpy as np

from studies.geometry.organs.millimetres import MM, check_lengths, metres, probe_near, si
from studies.geometry.shape.blends import ellipsoid, groove, smooth_max, smooth_min
from studies.geometry.shape.levelset import Literature, Shape
from studies.geometry.shape.regions import EllipsoidRegion, Vector

VOLUME = Literature(1500.0, "Henderson et al., Radiology 141 (1981) 525: 1,493 ± 230 mL by CT")
LIVER_PRESS_DIRECTION: Vector = (0.0, 0.9, 0.19**0.5)
"""Unit vector to the back and up. A plane that moves along it from the front first touches the smooth front of the
right lobe, away from the thin margin, and presses the liver against its bare area."""


def liver_shape(
    width: float = 231.0,
    depth: float = 131.0,
    height: float = 152.0,
    left_lobe: float = 64.0,
    notch: float = 30.0,
    margin: float = 9.0,
) -> Shape:
    """An adult's liver [mm]: 20-23 cm wide, the right lobe 14-16 cm high and 10-13 deep (usual sonographic sizes).

    left_lobe: height of the left lobe; notch: depth of the notch of the round ligament; margin: width over which the
    inferior margin is rounded off; its default is the smallest that meshes of 550 nodes resolve. Raises StudyError
    unless every length is finite and above 0.
    """
    check_lengths("liver", width=width, depth=depth, height=height, left_lobe=left_lobe, notch=notch, margin=margin)
    scale = np.array([width / 231.0, depth / 131.0, height / 152.0])

    def level(points: np.ndarray) -> np.ndarray:
        x = points / scale
        left = ellipsoid(x, (38, -17, 28), (80, 43, 0.5 * left_lobe))
        dome = smooth_min(ellipsoid(x, (-38, 4, -7), (73, 64, 84)), left, 24)
        # Kidney, colon and duodenum hollow the right lobe from below, the stomach the left one.
        stomach = ellipsoid(x, (97, 17, -70), (92, 92, 92))
        body = smooth_max(dome, -smooth_min(ellipsoid(x, (53, 84, -151), (175, 175, 175)), stomach, 20), margin)
        falciform = groove(x, (17, -55, 63), (17, -63, -17), 9, 5)
        ligament = groove(x, (17, -75, -42), (17, -18, -14), 12, notch)
        gallbladder = groove(x, (-22, -70, -70), (-6, 0, -18), 13, 9)
        cava = groove(x, (2, 62, 70), (2, 62, -20), 14, 9)
        return (body + falciform + ligament + gallbladder + cava) * scale.min()

    low, high = metres(*(-130, -80, -100) * scale), metres(*(140, 90, 100) * scale)
    regions = {"bare_area": EllipsoidRegion(metres(*(-35, 53, 43) * scale), metres(*(45, 40, 26) * scale))}
    shape = Shape("liver", si(level), low, high, 5 * MM, regions, None, VOLUME, None, LIVER_PRESS_DIRECTION)
    # Low on the front of the right lobe, where the surface is smooth for 3 cm around.
    return replace(shape, probe=probe_near(shape, metres(*(-45, -57, -33) * scale)))


LIVER = liver_shape()
LIVER_REGIONS = LIVER.regions
assert LIVER.probe is not None  # liver_shape sets it
LIVER_PROBE_POINT, LIVER_PROBE_NORMAL = LIVER.probe.point, LIVER.probe.normal
