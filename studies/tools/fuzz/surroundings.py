"""The world of a trial: its step, its start, what it is held by and what comes at it."""

import math
from collections.abc import Mapping

import numpy as np

from massspring import (
    METHODS,
    Attachment,
    Body,
    Capsule,
    Clock,
    Method,
    Obstacle,
    Plane,
    Probe,
    Ramp,
    Setup,
    Sphere,
    StepLimit,
    Trajectory,
    step_limit,
)
from studies.base.errors import StudyError
from studies.runs.limits import check_size
from studies.scene.start import InitialConditions
from studies.tools.fuzz.bodies import body_of
from studies.tools.fuzz.trial import FRAMES, Trial

HELD = 0.25
"""Share of the height that is held."""
STARTS: Mapping[str, InitialConditions] = {
    "rest": InitialConditions(),
    "flattened": InitialConditions(((1, 0, 0), (0, 1, 0), (0, 0, 0.01))),
    "mirrored": InitialConditions(((-1, 0, 0), (0, 1, 0), (0, 0, 1))),
    "scrambled": InitialConditions(scatter=0.5),
    "shrunk": InitialConditions(((0.2, 0, 0), (0, 0.2, 0), (0, 0, 0.2))),
    "collapsed": InitialConditions(((0, 0, 0), (0, 0, 0), (0, 0, 0))),
}


def method_of(trial: Trial) -> Method:
    """The method with its default settings."""
    return {method.name: method for method in METHODS}[trial.method]()


def setup_of(trial: Trial) -> Setup:
    """Raises MassSpringError or StudyError for a trial that is refused."""
    method, body = method_of(trial), body_of(trial)
    reason = method.why_not(body)
    if reason is not None:
        raise StudyError(f"method '{method.name}' does not apply: {reason}")
    held = _held(body) if trial.held or trial.load == "jump" else np.empty(0, dtype=np.int64)
    undamped = step_limit(body, held_nodes=held if len(held) else None)
    limit = StepLimit(undamped.frequency, trial.damping * undamped.frequency)
    dt = trial.dt_fraction * limit.damped
    clock = Clock(trial.steps * dt / FRAMES, FRAMES, trial.steps // FRAMES)
    obstacles = _obstacles(trial, body, clock)
    check_size(clock.duration, clock.frames, clock.dt, limit, body, len(obstacles) + bool(len(held)))
    start = STARTS[trial.start]
    return Setup(
        body,
        method,
        clock,
        obstacles,
        (Attachment(held, _jump(trial, body)),) if len(held) else (),
        (0.0, 0.0, -trial.gravity),
        limit.damping,
        targets=_targets(trial, body, clock),
        positions=start.positions(body.rest) if start.shaped else None,
        precision="float32" if trial.precision == "float32" else "float64",
    )


def _held(body: Body) -> np.ndarray:
    height = body.rest[:, 2]
    return np.flatnonzero(height <= height.min() + HELD * np.ptp(height))


def _jump(trial: Trial, body: Body) -> Trajectory:
    """Held nodes that stay, or are elsewhere from the second step on."""
    if trial.load != "jump":
        return Trajectory()
    far = trial.depth * float(np.ptp(body.rest, axis=0).max())
    return Trajectory((0.0, 1e-9), ((0.0, 0.0, 0.0), (far, 0.0, 0.0)))


def _targets(trial: Trial, body: Body, clock: Clock) -> dict[str, Ramp]:
    if trial.target == 1.0:
        return {}
    return {body.kept.names[0]: Ramp((0.0, 0.5 * clock.dt), (1.0, trial.target))}


def _obstacles(trial: Trial, body: Body, clock: Clock) -> tuple[Obstacle, ...]:
    """From above, and for a pinch from below too; they begin just outside, and go no deeper than the depth."""
    low, high = body.rest.min(axis=0), body.rest.max(axis=0)
    middle, extent = 0.5 * (low + high), high - low
    depth = trial.depth * float(extent[2])
    seconds = max(depth / trial.speed, clock.dt)
    path = Trajectory((0.0, seconds), ((0.0, 0.0, 0.0), (0.0, 0.0, -depth)))
    friction = trial.friction if isinstance(trial.friction, float) else "no_slip"
    radius = 0.3 * float(min(extent))
    above = (middle[0], middle[1], high[2] + 1.001 * radius)
    lid = Plane((middle[0], middle[1], high[2]), (0.0, 0.0, -1.0), path, friction)
    if trial.load == "plane":
        return (lid,)
    if trial.load == "pinch":
        floor = Plane((middle[0], middle[1], low[2]), (0.0, 0.0, 1.0), friction=friction)
        return lid, floor
    if trial.load == "sphere":
        return (Sphere(above, radius, path, friction),)
    if trial.load == "capsule":
        reach = math.hypot(extent[0], extent[1])
        ends = (above[0] - reach, *above[1:]), (above[0] + reach, *above[1:])
        return (Capsule(*ends, radius, path, friction),)
    top = body.rest[body.surface_nodes[np.argmax(body.rest[body.surface_nodes, 2])]]
    tip = (top[0], top[1], top[2] + 0.01 * float(extent[2]))
    return (Probe(tip, 0.0, path),) if trial.load == "probe" else ()
