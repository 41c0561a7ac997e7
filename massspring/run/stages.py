"""A run as a sequence of stages between events, all prepared before the first frame."""

from dataclasses import dataclass, replace

import numpy as np

from massspring.body.bisection import Growth
from massspring.body.body import Body
from massspring.body.springs import lengths
from massspring.kernels.arrays.layout import BoundaryConditions
from massspring.kernels.points.arrays import PointRows
from massspring.layout.sell_chunks import aligned, slices_of
from massspring.layout.state import State
from massspring.run.events import Easing, LettingIn, kept_momentum
from massspring.run.history import Numbers
from massspring.run.setup import Setup
from massspring.world.targets import fastest_filling


@dataclass(frozen=True, eq=False)
class Stage:
    """A part of a run during which the body stays the same."""

    setup: Setup
    start: State
    """State at the beginning of the stage; before the stage is entered, the body at rest."""
    frame: int = 0
    """Its first frame."""
    before: Numbers | None = None
    """Maps its nodes and volumes to those of the stage before."""
    last: Numbers | None = None
    """Maps nodes and volumes of the last stage to those of this one; None for the last stage."""
    easing: Easing | None = None
    filling: float = 0.0
    """Largest relative rate at which a volume can follow its target [1/s]; for a stage that follows an event."""
    growth: Growth | None = None
    """New nodes and springs of its body that are not copies."""
    lanes: np.ndarray | None = None
    """For a body with new springs: the number of the spring in each lane of its slices, −1 for none."""
    letting_in: LettingIn | None = None

    def boundary(self, frame: int, steps: int | None = None) -> BoundaryConditions:
        """The boundary conditions during frame number `frame` of the run, in so many steps (`Setup.boundary`)."""
        return self.setup.boundary(frame, self.easing, steps)

    def targets_after(self, frame: int) -> np.ndarray:
        """Targets of its volumes at the end of that frame [m³], (m,)."""
        return self.setup.volume_targets(np.array([(frame + 1) * self.setup.clock.frame]), self.easing)[0]

    def entered(self, state: State) -> "Stage":
        """The stage started from the last `state` of the one before: every copy has the position and velocity of its
        node."""
        assert self.before is not None  # the first stage is entered at rest
        body = self.setup.body
        x, v = self.before.carried(state.x), self.before.carried(state.v)
        if self.growth is not None:
            v = kept_momentum(v, x, body.mass, self.growth)
        nodes = self.start.nodes._replace(x=self.start.nodes.x.copy(), v=self.start.nodes.v.copy())
        place = slice(None) if self.start.permutation is None else self.start.permutation
        nodes.x[place], nodes.v[place] = x, v
        start = replace(self.start, nodes=nodes, lam=state.lam[self.before.volumes])
        if isinstance(start.rows, PointRows) and isinstance(state.rows, PointRows):
            start.rows.eased[:] = state.rows.eased[self.before.volumes]
        if start.pairs is not None and state.pairs is not None:
            start = replace(start, pairs=start.pairs._replace(lost=state.pairs.lost.copy()))
        off = body.kept.measure(x) - self.targets_after(self.frame - 1)
        time = float(np.abs(off / body.rest_volumes).max()) / self.filling
        at = self.frame * self.setup.clock.frame
        stage = replace(self, start=start, easing=Easing(at, off, time))
        if self.growth is None:
            return stage
        begin = lengths(x, body.springs.ends[self.growth.springs])
        stage = replace(stage, letting_in=LettingIn(self.growth.springs, begin, at, 1.0 / self.filling))
        return replace(stage, start=stage.let_in(start, self.frame))

    def let_in(self, state: State, frame: int) -> State:
        """The state with the rest lengths that new springs have at the beginning of that frame of the run."""
        clock = self.setup.clock
        if self.letting_in is None or self.letting_in.done((frame - 1) * clock.frame):
            return state
        rest_length = self.letting_in.lengths(self.setup.body.springs.rest_length, frame * clock.frame)
        slices = state.model.slices
        in_lanes = aligned(slices.rest_length.shape, slices.rest_length.dtype)
        in_lanes[...] = np.append(rest_length, 0.0)[self.lanes]
        slices = slices._replace(rest_length=in_lanes)
        return replace(state, model=state.model._replace(rest_length=rest_length, slices=slices))


def stages_of(setup: Setup) -> list[Stage]:
    """The stages of a run with all states prepared, so that entering one only copies positions and velocities."""
    stages = [Stage(replace(setup, events=()) if setup.events else setup, setup.start())]
    for event, later in zip(setup.events, setup.later, strict=True):
        grown = event.growth
        before = Numbers(np.asarray(event.parent), np.asarray(event.volume_parent), grown and grown.carry)
        start, filling = later.start(), fastest_filling(later.body)
        lanes = None if grown is None else _lanes(later.inside.body, start)
        stages.append(Stage(later, start, event.frame, before, filling=filling, growth=grown, lanes=lanes))
    for k in range(len(stages) - 2, -1, -1):
        before, after = stages[k + 1].before, stages[k + 1].last
        assert before is not None  # it is not the first
        stages[k] = replace(stages[k], last=before if after is None else after.after(before))
    return stages


def _lanes(body: Body, state: State) -> np.ndarray:
    """Number of the spring in each lane of the slices of a body with the numbers of a run, −1 for none."""
    numbered = replace(body.springs, rest_length=np.arange(1.0, body.springs.count + 1))
    slices = slices_of(numbered, state.model.triangles, state.model.inverse_mass, body.rest)
    return slices.rest_length.astype(np.int64) - 1
