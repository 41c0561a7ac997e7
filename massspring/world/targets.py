"""Limits how fast a kept volume follows its target: a jump would tear the body apart, so it is ramped.

A correction of ΔV within one step leaves ½ (ΔV/dt)²/(G·W·G) of kinetic energy in the body: the shorter the step, the
worse. At a bounded rate this energy does not depend on the step.
"""

import math

import numpy as np

from massspring.body.body import Body
from massspring.world.trajectories import Ramp


def fastest_filling(body: Body) -> float:
    """r = c/D [1/s], c² = mu/rho = Σ k L²/(15 Σ m): relative rate at which a target is followed at most (eq. 5.4).

    The surface then moves at c/6 at most, a sixth of the speed of a shear wave. Infinite for a body without stiffness.
    """
    i, j = body.springs.ends.astype(np.int64).T
    square = ((body.rest[j] - body.rest[i]) ** 2).sum(axis=1)
    stiff = float(body.springs.stiffness @ square) / (15.0 * float(body.mass.sum()))
    return math.sqrt(stiff) / body.size if stiff > 0 else math.inf


def followed(target: Ramp, rate: float) -> Ramp:
    """The target as it is followed from rest (factor 1 at t = 0) on, never faster than `rate` [1/s].

    Equal to `target` wherever that starts at 1 and is slow enough; behind a jump it catches up at the full rate.
    """
    slopes = np.diff(target.values) / np.diff(target.times)
    if float(target(0.0)) == 1.0 and (np.abs(slopes) <= rate).all():
        return target
    times, values = [0.0], [1.0]
    for begin, end in zip((0.0, *_later(target)), (*_later(target), math.inf), strict=True):
        _follow(target, rate, begin, end, (times, values))
    return Ramp(tuple(times), tuple(values))


def _later(target: Ramp) -> tuple[float, ...]:
    return tuple(t for t in target.times if t > 0.0)


def _follow(target: Ramp, rate: float, begin: float, end: float, path: tuple[list[float], list[float]]) -> None:
    """Extends `path` from its last point while the target is linear, from `begin` to `end` [s]."""
    start, last = float(target(begin)), path[1][-1]
    slope = (float(target(end)) - start) / (end - begin) if math.isfinite(end) else 0.0
    gap = start - last
    if gap == 0.0 and abs(slope) <= rate:
        if math.isfinite(end):
            _append(path, end, float(target(end)))
        return
    speed = math.copysign(rate, gap if gap != 0.0 else slope)
    closing = speed - slope
    meeting = begin + gap / closing if gap * closing > 0.0 else math.inf
    if meeting < end:
        _append(path, meeting, float(target(meeting)))
        _follow(target, rate, meeting, end, path)
    else:
        _append(path, end, last + speed * (end - begin))


def _append(path: tuple[list[float], list[float]], t: float, value: float) -> None:
    times, values = path
    if t > times[-1]:
        times.append(t)
        values.append(value)
    else:  # nearer than the resolution of time: the same point
        values[-1] = value
