"""The frequency of the vibration of a body that starts with a velocity."""

import numpy as np
from scipy.optimize import minimize_scalar

from studies.base.errors import StudyError
from studies.scene.scene import Scene

TRIALS = 400
"""Number of trial frequencies before the best is refined; their spacing is less than the width of the minimum."""

FEWEST = 12
"""Fewest values of the signal for a fit: three times its number of unknowns."""


def ringing_frequency(scene: Scene, t: np.ndarray, rest: np.ndarray, moved: np.ndarray, weights: np.ndarray) -> float:
    """Frequency [Hz] of the displacements `moved` (K, n, 3) [m] of the points `rest` (n, 3) [m] at times t (K,) [s].

    The signal is the weighted projection on the initial velocities. Raises StudyError without a start with speed.
    """
    speed = None if scene.start is None else scene.start.velocities(rest)
    if speed is None:
        raise StudyError(f"scene '{scene.name}' does not start with a speed, so nothing rings; drop its frequency")
    swing = np.einsum("n,kni,ni->k", weights, moved, speed) / np.einsum("n,ni,ni->", weights, speed, speed)
    return fitted_frequency(t, swing, scene.damping)


def fitted_frequency(t: np.ndarray, swing: np.ndarray, damping: float) -> float:
    """f [Hz] of a + e^{-ct/2} (b cos 2πft + d sin 2πft) (eq. 6.13) fitted to (K,) values at t [s]; c = damping [1/s].

    Least squares in a, b and d for every f (variable projection: Golub and Pereyra 1973), from half a period in the
    whole time up to four values a period. Raises StudyError for fewer than FEWEST values.
    """
    if len(t) < FEWEST:
        raise StudyError(f"a frequency is to be read off {len(t)} checkpoints; give the scene {FEWEST} or more")
    fade = np.exp(-0.5 * damping * t)

    def left(f: float) -> float:
        basis = np.stack([np.ones_like(t), fade * np.cos(2 * np.pi * f * t), fade * np.sin(2 * np.pi * f * t)], axis=1)
        coefficients = np.linalg.lstsq(basis, swing, rcond=None)[0]
        return float(np.sum((basis @ coefficients - swing) ** 2))

    span = float(t[-1] - t[0])
    trials = np.linspace(0.5 / span, 0.25 * (len(t) - 1) / span, TRIALS)
    best = int(np.argmin([left(f) for f in trials]))
    bounds = trials[max(best - 1, 0)], trials[min(best + 1, TRIALS - 1)]
    minimum = minimize_scalar(left, bounds=bounds, method="bounded", options={"xatol": 1e-9 * trials[best]})
    return float(minimum.x)  # pyright: ignore[reportAttributeAccessIssue]
