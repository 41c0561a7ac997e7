"""A run as a row of set-ups, each prepared before the first frame, from one event to the next."""

from dataclasses import dataclass, replace

import numpy as np

from massspring.kernels.arrays.layout import BoundaryConditions
from massspring.layout.state import State
from massspring.run.events import Easing
from massspring.run.history import Numbers
from massspring.run.setup import Setup
from massspring.world.targets import fastest_filling


@dataclass(frozen=True, eq=False)
class Stage:
    """A part of a run during which the body stays the same."""

    setup: Setup
    start: State
    """At its beginning; until the stage is entered with the body at rest."""
    frame: int = 0
    """Its first."""
    before: Numbers | None = None
    """What its nodes and volumes were in the stage before it."""
    last: Numbers | None = None
    """What the nodes and volumes of the last stage are in it; None for themselves."""
    easing: Easing | None = None
    filling: float = 0.0
    """Share of its volume by which a body can be led in a second; of a stage that follows an event."""

    def boundary(self, frame: int) -> BoundaryConditions:
        """The outside world during frame number `frame` of the run."""
        return self.setup.boundary(frame, self.easing)

    def targets_after(self, frame: int) -> np.ndarray:
        """What its volumes should be at the end of that frame [m³], (m,)."""
        return self.setup.volume_targets(np.array([(frame + 1) * self.setup.clock.frame]), self.easing)[0]

    def entered(self, state: State) -> "Stage":
        """The stage as it begins where the one before it ended: every copy of a node in its place, with its speed."""
        assert self.before is not None  # the first stage is entered at rest
        x, v = state.x[self.before.nodes], state.v[self.before.nodes]
        nodes = self.start.nodes._replace(x=self.start.nodes.x.copy(), v=self.start.nodes.v.copy())
        place = slice(None) if self.start.permutation is None else self.start.permutation
        nodes.x[place], nodes.v[place] = x, v
        start = replace(self.start, nodes=nodes, lam=state.lam[self.before.volumes])
        if start.pairs is not None and state.pairs is not None:
            start = replace(start, pairs=start.pairs._replace(lost=state.pairs.lost.copy()))
        body = self.setup.body
        off = body.kept.measure(x) - self.targets_after(self.frame - 1)
        time = float(np.abs(off / body.rest_volumes).max()) / self.filling
        return replace(self, start=start, easing=Easing(self.frame * self.setup.clock.frame, off, time))


def stages_of(setup: Setup) -> list[Stage]:
    """The stages of a run, the states of all made: entering one is a copy of positions and velocities."""
    stages = [Stage(replace(setup, events=()) if setup.events else setup, setup.start())]
    for event, later in zip(setup.events, setup.later, strict=True):
        before = Numbers(np.asarray(event.parent), np.asarray(event.volume_parent))
        stages.append(Stage(later, later.start(), event.frame, before, filling=fastest_filling(later.body)))
    for k in range(len(stages) - 2, -1, -1):
        before, after = stages[k + 1].before, stages[k + 1].last
        assert before is not None  # it is not the first
        last = before if after is None else Numbers(before.nodes[after.nodes], before.volumes[after.volumes])
        stages[k] = replace(stages[k], last=last)
    return stages
