"""The silicone beam as others measured it, and how sag, frequency and damping are read off a release from straight.

Dubied, Michelis, Spielberg, Katzschmann, RA-L 2022: repository srl-ethz/diffPD_sim2real, folder
python/realbeam_experiments, commit 825e7b7, MIT licence, Soft Robotics Lab, ETH Zürich. A beam of Dragon Skin 10,
30 × 30 × 100 mm, one end face glued, hangs straight until it is let go; cameras follow three markers at its tip and
three at its holder, 100 times a second. Each load was measured twice.
"""

from pathlib import Path
from typing import NamedTuple

import numpy as np
from scipy.optimize import least_squares

from studies import StudyError

GRAVITY = 9.80709
"""[m/s²]."""
DOWN = 0
"""Axis of the files along which gravity acts: less is lower."""
MARKERS = 3
"""At the tip; the other three are on the holder."""
BEFORE = 9
"""First frames, in which the beam is held straight."""
LAST = 0.6
"""Seconds at the end whose mean is the sag."""
CYCLES = 6.0
"""Of the swing, from which the frequency is read."""
FIRST_CYCLES = 2.0
"""From which the damping is read: later ones are small, and their damping is another."""
FEWEST = 12
"""Samples of a fit: more than twice its unknowns."""


class Swing(NamedTuple):
    """Read off one release."""

    sag: float
    """Mean of the last LAST seconds [m]."""
    frequency: float
    """Of the damped swing [Hz]."""
    damping: float
    """Ratio to critical damping [1]."""


def swing_of(t: np.ndarray, sag: np.ndarray) -> Swing:
    """Of a sag (K,) [m] at even times t (K,) [s], 0 until the release.

    The fits begin where the sag first passes its mean: no hand holds the beam there any more. Raises StudyError for a
    sag that never passes it, or with fewer than FEWEST samples in the first cycles.
    """
    rest = float(sag[t > t[-1] - LAST].mean())
    first = int(np.argmax(sag > rest))
    if not sag[first] > rest:
        raise StudyError("the beam never passes the sag that it ends at; give a longer record, from before the release")
    after, moved = t[first:] - t[first], sag[first:] - rest
    back = np.flatnonzero((moved[1:] < 0.0) & (moved[:-1] >= 0.0))
    guess = 0.5 / float(after[back[0] + 1]) if len(back) else 0.5 / float(after[-1])
    frequency, damping = damped_cosine(after, moved, guess, 0.05, CYCLES)
    return Swing(rest, frequency, damped_cosine(after, moved, frequency, damping, FIRST_CYCLES)[1])


def damped_cosine(
    t: np.ndarray, moved: np.ndarray, frequency: float, damping: float, cycles: float
) -> tuple[float, float]:
    """(f [Hz], ζ [1]) of a + e^{−ζωt}(b cos 2πft + d sin 2πft), ω = 2πf/√(1 − ζ²), in the first `cycles`.

    Least squares; a, b and d are found for each f and ζ (variable projection). Raises StudyError for few samples.
    """
    chosen = t <= cycles / frequency
    if chosen.sum() < FEWEST:
        raise StudyError(f"a swing has {int(chosen.sum())} samples in {cycles:g} cycles; give {FEWEST} or more")
    at, value = t[chosen], moved[chosen]

    def left(guess: np.ndarray) -> np.ndarray:
        circular = 2.0 * np.pi * guess[0]
        fade = np.exp(-guess[1] * circular * at / np.sqrt(1.0 - guess[1] ** 2))
        basis = np.stack([np.ones_like(at), fade * np.cos(circular * at), fade * np.sin(circular * at)], axis=1)
        return basis @ np.linalg.lstsq(basis, value, rcond=None)[0] - value

    bounds = ([0.5 * frequency, -0.2], [2.0 * frequency, 0.9])
    fit = least_squares(left, [frequency, damping], bounds=bounds, x_scale=[frequency, 0.1], xtol=1e-12).x
    return float(fit[0]), float(fit[1])


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
    """The swing of each marker at the tip, in a C3D file, which the extra `silicone` reads."""
    from ezc3d import c3d  # pyright: ignore[reportMissingImports]

    content = c3d(str(path))
    points = content["data"]["points"]
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
