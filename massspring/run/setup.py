"""The set-up of a run: a body in its surroundings, checked."""

import math
import warnings
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any

import numpy as np

from massspring.body.body import Body
from massspring.kernels.arrays.layout import BoundaryConditions, Tips
from massspring.layout.face_pairs import face_pairs
from massspring.layout.probe_arrays import new_probing
from massspring.layout.state import State
from massspring.methods.method import Method
from massspring.run.checks import (
    check_among,
    check_body,
    check_face_pairs,
    check_facets,
    check_nodal,
    check_probe,
    check_settings,
    check_solid,
    check_surroundings,
    check_targets,
)
from massspring.run.events import Easing, Event, check_event, check_events
from massspring.run.precision import Precision, check_precision, in_precision
from massspring.run.renumber import Numbered, numbered
from massspring.world.clock import Clock
from massspring.world.obstacles import Attachment, Capsule, Obstacle, Plane, Probe, Sphere, Surroundings
from massspring.world.targets import fastest_filling, followed
from massspring.world.trajectories import Paths, Ramp

EARLY = 1e-9
"""Of a time: a frame begins at it although round-off puts it earlier."""


@dataclass(frozen=True, eq=False)
class Setup:
    """A body in its surroundings."""

    body: Body
    method: Method
    clock: Clock
    obstacles: tuple[Obstacle, ...] = ()
    attachments: tuple[Attachment, ...] = ()
    gravity: tuple[float, float, float] = (0.0, 0.0, 0.0)
    """[m/s²]."""
    damping: float = 0.0
    """Mass-proportional damping [1/s]."""
    damping_at_rest: tuple[float, float] | None = None
    """(t [s], c [1/s]): in frames that begin at t or later, damping is c; None: it stays the same."""
    velocity: np.ndarray | None = None
    """Initial velocities [m/s], (n, 3); None: at rest."""
    targets: Mapping[str, Ramp] = field(default_factory=dict)
    """Name of a kept volume -> its target over time as a factor of its rest volume; unnamed ones stay at 1.
    A target that changes faster than the body can follow is ramped, with a warning."""
    positions: np.ndarray | None = None
    """Initial positions [m], (n, 3); None: those at rest."""
    precision: Precision = "float64"
    """Of the state; "float32" is faster and meets volumes to 1e-5 wherever the body lies, for methods that claim it."""
    events: tuple[Event, ...] = ()
    """Changes of the body between frames, such as cuts."""
    pairs: np.ndarray | None = None
    """Nodes behind a cut and their copies in front of it, (p, 2), whose faces touch without friction where it closes;
    None: none do."""

    def __post_init__(self) -> None:
        check_settings(self.method)
        check_body(self.body, self.method)
        moved = self.velocity is not None or self.positions is not None
        around = Surroundings(self.obstacles, len(self.attachments), self.gravity, bool(self.targets), moved)
        check_among(around, self.method)
        check_precision(self.precision, self.method)
        check_facets(self.precision, self.body, self.solids)
        if self.pairs is not None:
            check_face_pairs(self.pairs, self.method, self.attachments, self.precision, bool(self.probes))
        limited = self.method.capabilities.conditionally_stable
        for damping in (self.damping, *(self.damping_at_rest or ())[1:]):
            check_surroundings(self.gravity, damping, self.clock.dt if limited else 0.0)
        check_nodal("initial velocities", self.velocity, self.body)
        check_nodal("initial positions", self.positions, self.body)
        x = self.body.rest if self.positions is None else self.positions
        for number, obstacle in enumerate(self.obstacles):
            if isinstance(obstacle, Probe):
                check_probe(number, obstacle, self.method, self.body, x)
            else:
                check_solid(number, obstacle, self.body, x)
        check_targets(self.targets, self.body, self.method)
        rate = fastest_filling(self.body)
        for name in self.ramped:
            warnings.warn(
                f"the target of volume '{name}' moves faster than {rate:.3g} of its rest volume per second, which would"
                " tear the body apart; the target is limited to that rate",
                stacklevel=3,
            )
        if self.events:
            check_events(self.events, self.clock.frames, self.method, self.precision, bool(self.probes))
            self.later  # noqa: B018 — each later set-up is checked too

    @cached_property
    def later(self) -> tuple["Setup", ...]:
        """The set-up after each event, without events. Raises MassSpringError for one that cannot follow."""
        setups, body, x, targets = [], self.body, self.positions, dict(self.targets)
        for event in self.events:
            check_event(event, body)
            for volume in event.ended:
                targets.pop(body.kept.names[volume], None)
            x, body = None if x is None else event.carried(x), event.body
            setups.append(
                replace(
                    self,
                    body=body,
                    attachments=event.attachments,
                    targets=dict(targets),
                    velocity=None,
                    positions=x,
                    events=(),
                    pairs=event.pairs,
                )
            )
        return tuple(setups)

    @property
    def probes(self) -> tuple[Probe, ...]:
        """The thin probes among the obstacles; a separate stage of the step treats them."""
        return tuple(o for o in self.obstacles if isinstance(o, Probe))

    @property
    def solids(self) -> tuple[Plane | Sphere | Capsule, ...]:
        """The obstacles that nodes touch."""
        return tuple(o for o in self.obstacles if not isinstance(o, Probe))

    @cached_property
    def followed(self) -> dict[str, Ramp]:
        """The targets with a bounded rate (massspring.world.targets)."""
        rate = fastest_filling(self.body) if self.targets else 0.0
        return {name: followed(ramp, rate) for name, ramp in self.targets.items()}

    @property
    def ramped(self) -> list[str]:
        """Names of the volumes whose target had to be slowed down."""
        return [name for name, ramp in self.followed.items() if ramp is not self.targets[name]]

    @cached_property
    def inside(self) -> Numbered:
        """The body with the node numbers of the run."""
        return numbered(self.body)

    @cached_property
    def origin(self) -> np.ndarray:
        """Origin of positions during the run [m], (3,): in single precision the middle of the body at the start, since
        the largest coordinate limits the accuracy; else 0."""
        if self.precision == "float64":
            return np.zeros(3)
        x = self.body.rest if self.positions is None else self.positions
        return 0.5 * (x.min(axis=0) + x.max(axis=0))

    def start(self) -> State:
        """The state at t = 0."""
        state = self.inside.start(self.method, self.attachments, self.velocity)
        if self.probes:
            probing = new_probing(self.inside.body, state.model.triangles, self.probes, state.diagnostics)
            state = replace(state, probing=probing)
        if self.pairs is not None:
            number = self.inside.permutation
            pairs = self.pairs if number is None else number[np.asarray(self.pairs)]
            state = replace(state, pairs=face_pairs(self.inside.body, pairs))
        if self.positions is not None:
            state = state.moved_to(self.positions)
        if self.precision == "float32":
            state = in_precision(state.relative_to(self.origin), self.precision)
        return state

    @cached_property
    def _unmoved(self) -> dict[str, Any]:
        """The boundary conditions that are the same in all frames."""
        solids = self.solids
        return {
            "gravity": np.asarray(self.gravity, dtype=np.float64),
            "is_plane": np.array([isinstance(o, Plane) for o in solids], dtype=np.bool_),
            "plane_normal": _rows([o.unit_normal if isinstance(o, Plane) else np.zeros(3) for o in solids]),
            "radius": np.array([0.0 if isinstance(o, Plane) else o.radius for o in solids]),
            "span": _rows([o.span if isinstance(o, Capsule) else np.zeros(3) for o in solids]),
            "friction": np.array([np.inf if o.friction == "no_slip" else float(o.friction) for o in solids]),
            "rough": any(o.friction != 0 for o in solids),
            "inside": np.array([touches_inside(o, self.body, self.method) for o in solids], dtype=np.bool_),
        }

    def boundary(self, frame: int, easing: Easing | None = None, steps: int | None = None) -> BoundaryConditions:
        """The boundary conditions during frame number `frame` (0, 1, …), with positions at the end of each step
        relative to `origin`; `steps`: of this frame, if not as many as of the clock."""
        steps = self.clock.steps if steps is None else steps
        dt = self.clock.frame / steps
        t = frame * self.clock.frame + dt * np.arange(1, steps + 1)
        before, now = self.paths(t - dt), self.paths(t)
        speed, (anchor, tip) = (now - before) / dt, self._anchors
        solid, probe, held = self._kinds
        return BoundaryConditions(
            dt=dt,
            damping=self.damping_in(frame),
            **self._unmoved,
            position=(anchor + now[:, solid]) - self.origin,
            velocity=speed[:, solid].copy(),
            held_displacement=now[:, held].copy(),
            held_velocity=speed[:, held].copy(),
            volume_target=self.volume_targets(t, easing),
            tips=Tips(*((tip + there[:, probe]) - self.origin for there in (before, now))),
        )

    def damping_in(self, frame: int) -> float:
        """Damping during frame number `frame` [1/s]."""
        since, at_rest = self.damping_at_rest or (math.inf, 0.0)
        return float(at_rest if frame * self.clock.frame >= since * (1.0 - EARLY) else self.damping)

    @cached_property
    def paths(self) -> Paths:
        """Those of solids, thin probes and attachments, in the order of their impulses."""
        return Paths([mover.path for mover in (*self.solids, *self.probes, *self.attachments)])

    @cached_property
    def _kinds(self) -> tuple[slice, slice, slice]:
        """Places of solids, thin probes and attachments among the paths."""
        solids, probes = len(self.solids), len(self.probes)
        return slice(solids), slice(solids, solids + probes), slice(solids + probes, None)

    @cached_property
    def _anchors(self) -> tuple[np.ndarray, np.ndarray]:
        """What the paths of solids and of thin probes move [m], (o, 3) each."""
        return _rows([o.anchor for o in self.solids]), _rows([p.anchor for p in self.probes])

    def volume_targets(self, t: np.ndarray, easing: Easing | None = None) -> np.ndarray:
        """Target of each kept volume at times `t` (q,) [s], (q, m) [m³]; after an event `easing` adds the remaining
        deviation."""
        targets = np.tile(self.body.rest_volumes, (len(t), 1))
        for column, ramp in self._ramps:
            targets[:, column] *= ramp(t)
        return targets if easing is None else targets + easing.left(t)

    @cached_property
    def _ramps(self) -> list[tuple[int, Ramp]]:
        """Number of each volume with a target that is followed, and that."""
        return [(self.body.kept.names.index(name), ramp) for name, ramp in self.followed.items()]


def touches_inside(obstacle: Obstacle, body: Body, method: Method) -> bool:
    """Whether an obstacle touches a body at points inside its facets, not at its nodes.

    All of a facet lies on a plane when its nodes do, and contact at nodes is solved together with the volumes. A method
    that moves all nodes at once meets every obstacle at points.
    """
    flat = isinstance(obstacle, Plane) and method.capabilities.keeps != "points"
    return bool(len(body.contact_facets)) and not flat


def _rows(vectors: list[np.ndarray]) -> np.ndarray:
    return np.array(vectors, dtype=np.float64).reshape(-1, 3)
