"""Stages of a step that a scene may not need: when they are skipped, and the same run with them, to measure the
saving."""

from collections.abc import Callable
from dataclasses import dataclass, replace

from massspring import ImplicitVolume, MassSpringError, Probe, Setup, Sphere, State
from massspring.body.volumes import Volumes
from massspring.kernels.probe.arrays import COMPARED, IN_CONTACT, LEFT_BEHIND, TESTED
from massspring.layout.jacobian_pattern import volume_rows

FAR = Sphere((1e3, 0.0, 0.0), 1e-3)
"""An obstacle that is never touched."""
FAR_PROBE = Probe((1e3, 0.0, 0.0))
FAINT = (0.0, 0.0, 1e-280)
"""Gravity too small to change any sum [m/s²]."""


@dataclass(frozen=True)
class Skip:
    """A stage that a scene may not need."""

    name: str
    left_out: Callable[[Setup], bool]
    """Whether a set-up skips the stage."""
    included: Callable[[Setup, State], tuple[Setup, State]]
    """The same run with the stage."""
    remark: Callable[[Setup, State], str] = lambda setup, state: ""
    """Text on how much was skipped, from the state after the run."""

    def can_be(self, setup: Setup) -> bool:
        """Whether body and method allow the stage at all: what a set-up refuses is not left out."""
        try:
            self.included(setup, setup.start())
        except MassSpringError:
            return False
        return True


def _with_far(setup: Setup, state: State) -> tuple[Setup, State]:
    return replace(setup, obstacles=(*setup.obstacles, FAR)), state


def _with_probe(setup: Setup, state: State) -> tuple[Setup, State]:
    probed = replace(setup, obstacles=(*setup.obstacles, FAR_PROBE))
    return probed, probed.start()


def _with_gravity(setup: Setup, state: State) -> tuple[Setup, State]:
    return replace(setup, gravity=FAINT), state


def _with_friction(setup: Setup, state: State) -> tuple[Setup, State]:
    rubbing = tuple(replace(o, friction=1e-300) if o in setup.solids else o for o in setup.obstacles)
    return replace(setup, obstacles=rubbing), state


def _with_rows(setup: Setup, state: State) -> tuple[Setup, State]:
    kept = setup.inside.body.kept
    assert isinstance(kept, Volumes)  # called only for bodies that keep one volume
    return setup, replace(state, rows=volume_rows(kept, setup.body.node_count))


def _awake(setup: Setup, state: State) -> tuple[Setup, State]:
    assert state.probing is not None
    return setup, replace(state, probing=state.probing._replace(skipping=False))


def _pairs(setup: Setup, state: State) -> str:
    """Text with the shares of boxes compared, pairs tested and triangles left behind among all pairs of tips and
    triangles."""
    assert state.probing is not None
    steps = setup.clock.frames * setup.clock.steps
    pairs, counts = state.probing.near.size, state.probing.counts
    return (
        f"of {pairs:,} pairs a step {counts[COMPARED] / steps:.3g} boxes compared, {counts[TESTED] / steps:.3g} pairs "
        f"tested; in contact {counts[IN_CONTACT]} of {steps} steps, left behind {counts[LEFT_BEHIND]}"
    )


def _is_division(setup: Setup) -> bool:
    return isinstance(setup.method, ImplicitVolume) and setup.start().rows is None


SKIPS: tuple[Skip, ...] = (
    Skip("contact of nodes: no plane, sphere or capsule", lambda s: not s.solids, _with_far),
    Skip("thin probe: none", lambda s: not s.probes, _with_probe),
    Skip("gravity: none in this scene", lambda s: not any(s.gravity), _with_gravity),
    Skip("friction: no obstacle has any", lambda s: bool(s.solids) and not s.boundary(0).rough, _with_friction),
    Skip("linear solve: one volume is a division", _is_division, _with_rows),
    Skip("pairs of tips and triangles out of reach", lambda s: bool(s.probes), _awake, _pairs),
)
