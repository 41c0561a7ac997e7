"""The silicone beam as others measured it, and how the numbers are read off their files.

Dubied, Michelis, Spielberg, Katzschmann, RA-L 2022: repository srl-ethz/diffPD_sim2real, folder
python/realbeam_experiments, commit 825e7b7, MIT licence, Soft Robotics Lab, ETH Zürich. A beam of Dragon Skin 10,
30 × 30 × 100 mm, one end face glued, hangs straight until it is let go; cameras follow three markers at its tip and
three at its holder, 100 times a second. Each load was measured twice.
"""

from pathlib import Path
from typing import NamedTuple

import numpy as np

from studies.base.errors import StudyError
from studies.tools.silicone.swing import Swing, swing_of

GRAVITY = 9.80709
"""[m/s²]."""
DOWN = 0
"""Axis of the files along which gravity acts: less is lower."""
MARKERS = 3
"""At the tip; the other three are on the holder."""
BEFORE = 9
"""First frames, in which the beam is held straight."""


class Load(NamedTuple):
    """A tip load and what was measured under it, by run (2,) and marker (3,)."""

    newton: float
    """Weight at the tip [N]."""
    files: tuple[str, str]
    sag: tuple[tuple[float, float, float], tuple[float, float, float]]
    """[mm]."""
    frequency: tuple[float, float]
    """[Hz]."""
    damping: tuple[float, float]
    """Ratio to critical damping [1]."""
    uncertainty: float
    """Of the sag [mm]: spread of the runs, and how far the holder moved."""

    @property
    def mass(self) -> float:
        """At the tip [kg]."""
        return self.newton / GRAVITY

    @property
    def name(self) -> str:
        """For tables and charts."""
        return f"{1e3 * self.mass:.0f} g"


def runs_of(path: Path) -> tuple[Swing, ...]:
    """The swing of each marker at the tip, in a C3D file. Raises StudyError without the extra `silicone`, or for a
    file with other markers."""
    try:
        from ezc3d import c3d  # pyright: ignore[reportMissingImports]
    except ImportError as error:
        raise StudyError("C3D files need the package ezc3d: pip install organbench[silicone]") from error
    try:
        content = c3d(str(path))
    except OSError as error:
        raise StudyError(f"{path} cannot be read as a C3D file: {error}") from error
    points = content["data"]["points"]
    if points.shape[1] != 2 * MARKERS:
        raise StudyError(f"{path} has {points.shape[1]} markers; three at the tip and three at the holder are needed")
    t = np.arange(points.shape[2]) / float(content["parameters"]["POINT"]["RATE"]["value"][0])
    down = -points[DOWN, :MARKERS]
    return tuple(swing_of(t, sag) for sag in down - down[:, :BEFORE].mean(axis=1, keepdims=True))


LOADS = (
    Load(
        0.0,
        ("beam_gravity_V2_a.c3d", "beam_gravity_V2_b.c3d"),
        ((6.64, 6.51, 6.20), (6.72, 6.57, 6.28)),
        (7.729, 7.735),
        (0.0507, 0.0515),
        0.1,
    ),
    Load(
        0.51012,
        ("beam_load52_V2_a.c3d", "beam_load52_V2_b.c3d"),
        ((17.47, 17.29, 15.95), (17.58, 17.04, 16.31)),
        (4.339, 4.304),
        (0.0517, 0.0504),
        0.4,
    ),
    Load(
        1.00062,
        ("beam_load101_V2_a.c3d", "beam_load101_V2_b.c3d"),
        ((27.61, 26.01, 24.00), (26.63, 25.11, 23.63)),
        (3.354, 3.360),
        (0.0550, 0.0631),
        1.0,
    ),
)
"""Numbers read with `runs_of`; of frequency and damping the mean of the three markers."""
