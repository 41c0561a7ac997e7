"""What a release from straight tells: the sag it ends at, the frequency and the damping of its swing."""

from typing import NamedTuple

import numpy as np
from scipy.optimize import least_squares

from studies.base.errors import StudyError

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
