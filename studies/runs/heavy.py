"""How heavy a body may be in a slow scene: as heavy as its loads and its slowest swing allow, for longer steps.

Inertia times k makes the body √k times slower: the step grows by √k, weight and equilibria stay. What it changes is the
swing that a load starts where its speed changes: it shows on the way, and must have died out at the end.
"""

import math
from dataclasses import dataclass, replace

import numpy as np

from massspring import Attachment, Body, Ramp, Trajectory
from massspring.analysis.stability import slowest_frequency
from studies.runs.indicators import still_from
from studies.scene.inertia import SLOW, top_speed, velocities, why_not_heavier
from studies.scene.scene import Scene

MOST = 49.0
"""Largest factor on inertia: frames then have few steps, and more wins little (spleen_sag runs at 4.3, 5.7 and 6.5
times real time with 25, 49 and 100)."""
KINK = 0.05
"""Largest swing that a kink in a load's path may start, over the load's way: v √k/ω_1 where the speed changes by v.
Measured on the way (liver_press): 0.4 % of the force and of the largest displacement; at 0.055 0.5 and 0.6 %."""
CALM = 1.5
"""Damping at rest over the frequency of the slowest swing; 2 is critical, more where contact or load slow it down."""
ENDS, ENDS_ALONE = 5.0, 7.0
"""Least ln of the decay of the slowest swing before the end is judged: of one that a kink starts, and of one as large
as the displacement itself, which weight starts that acts at once."""

NEVER = 1e-12
"""Rate [1/s] and speed [m/s] of what does not move."""


@dataclass(frozen=True)
class Heaviness:
    """Inertia and damping of a run."""

    factor: float = 1.0
    """k: inertia over that of masses by stiffness [1], at least 1."""
    limit: str = ""
    """What keeps it from being larger."""
    damping: float = 0.0
    """While loads move [1/s]: that of the scene over k, so that the drag stays."""
    at_rest: tuple[float, float] | None = None
    """(from when [s], damping [1/s]); None: damping stays the same."""

    @property
    def most_damping(self) -> float:
        """[1/s]."""
        return max(self.damping, *(self.at_rest or ())[1:], 0.0)

    @property
    def record(self) -> dict[str, float | str]:
        """Attributes of a run (RUN_ATTRIBUTES)."""
        at_rest = self.damping if self.at_rest is None else self.at_rest[1]
        return {"heaviness_limit": self.limit, "damping_moving": self.damping, "damping_at_rest": at_rest}

    def of(self, body: Body) -> Body:
        return body if self.factor == 1.0 else replace(body, inertia=self.factor * body.moved_mass)


def heaviness(scene: Scene, body: Body, attachments: tuple[Attachment, ...], lumen: float = 0.0) -> Heaviness:
    """The largest that the scene allows a body with masses by stiffness, in which only equilibria matter
    (studies.scene.inertia), with a lumen of that volume [m³]. Raises MassSpringError."""
    reason = why_not_heavier(scene)
    if reason is not None:
        return Heaviness(1.0, reason, scene.damping)
    omega = slowest_frequency(body, np.concatenate([held.nodes for held in attachments]))
    moving = [mover.path for mover in (*scene.obstacles, *scene.held)]
    moving += [wall_path(scene.lumen.filling, lumen)] if scene.lumen is not None else []
    speed = max(map(top_speed, moving))
    wave = math.sqrt(scene.tissue.shear_modulus / scene.tissue.density)
    gaps = [float(obstacle.gap(body.rest, 0.0).min()) for obstacle in scene.obstacles]
    gaps += [0.0] * (len(moving) - len(gaps))
    jolt = max(kink(path, max(gap, 0.0)) for path, gap in zip(moving, gaps, strict=True))
    alone, since = any(scene.gravity), still_from(scene)
    judged = (scene.checkpoints[0] if alone else scene.checkpoints[-1]) if scene.checkpoints else scene.duration
    decays = 0.5 * CALM * omega * (judged - since) / (ENDS_ALONE if alone else ENDS)
    limits = {
        f"steps {math.sqrt(MOST):g} times as long are the longest": math.sqrt(MOST),
        f"loads must stay below {100 * SLOW:g} % of the speed of its shear waves": SLOW * wave / max(speed, NEVER),
        f"where a load changes its speed it swings by {100 * KINK:g} %": KINK * omega / max(jolt, NEVER),
        f"its slowest swing, {omega / (2.0 * math.pi):.2g} Hz, must end before {judged:g} s": decays,
    }
    limit, root = min(limits.items(), key=lambda item: item[1])
    if root <= 1.0:
        return Heaviness(1.0, limit, scene.damping)
    return Heaviness(root**2, limit, scene.damping / root**2, (since, CALM * omega / root))


def wall_path(filling: Ramp, volume: float) -> Trajectory:
    """Mean way of the wall of a lumen of that volume at rest [m³] while it is filled: that of a ball's radius."""
    radius = np.cbrt(0.75 * volume / math.pi * np.asarray(filling.values))
    return Trajectory(filling.times, tuple((r - radius[0], 0.0, 0.0) for r in radius))


def kink(path: Trajectory, gap: float = 0.0) -> float:
    """Largest change of velocity of a path, over its longest way beyond a `gap` [m] [1/s]; 0 for one that does not get
    there."""
    way = float(np.linalg.norm(path.displacements - path(0.0), axis=1).max()) - gap
    change = np.diff(velocities(path), axis=0, prepend=np.zeros((1, 3)), append=np.zeros((1, 3)))
    return float(np.linalg.norm(change, axis=1).max()) / way if way > 0.0 else 0.0
