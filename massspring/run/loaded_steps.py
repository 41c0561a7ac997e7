"""How many steps a frame takes while a body is under load: pressures raise its largest frequency (docs/theory.md,
section 5)."""

import math

import numpy as np
from scipy.sparse import coo_array, csr_array

from massspring.analysis.stability import StepLimit
from massspring.body.springs import Springs, lengths
from massspring.kernels.arrays.layout import BoundaryConditions
from massspring.kernels.forces.springs import largest_strain
from massspring.kernels.points.arrays import PointRows
from massspring.kernels.points.elements import forces_into
from massspring.layout.state import State
from massspring.run.setup import Setup
from massspring.run.stages import Stage

FIRST, FURTHER = 200, 3
"""Power iterations at rest, where they find the largest frequency to 1 %, and after each frame from the last vector:
loads change little in a frame."""
NOISE = 0.1
"""Of the last vector, added before each frame: a mode that a load makes the fastest is then found in a few frames."""
LATE, AGAIN = 1.25, 3
"""A frame after which this many times its steps are needed is run again with twice as many, so many times at most."""
FEWER = 0.95
"""Least steps of a frame over those of the frame before: the estimate is late after a sudden load."""
CHANGED, SETTLED = 0.05, 0.01
"""Change of a pressure over that at rest, or of a spring over its length at rest, from which steps are counted again,
and of ω² in a count, over it, up to which that was the last one: ω² changes by as much as pressures and lengths."""
HOPELESS = 400.0
"""Rise of ω² from which a state counts as burst: no load needs steps so short."""
SHARE = 0.8
"""Of the loaded limit that a step may take; more where the step that was asked for is more of the limit at rest."""


class LoadedSteps:
    """The steps of each frame of a set-up: those of its clock, or as many more as the loaded body needs.

    ω_max² of the loaded body is that at rest times the ratio of two estimates by power iteration on differences of the
    kernels' own forces, volumes free: keeping them lowers no limit (Cauchy interlacing).
    """

    def __init__(self, setup: Setup, start: State) -> None:
        self.clock, self.steps = setup.clock, setup.clock.steps
        can, rows, body = setup.method.capabilities, start.rows, setup.inside.body
        self.limit = setup.clock.limit if can.correction == "limited" and can.conditionally_stable else None
        if self.limit is None or not isinstance(rows, PointRows):
            self.limit = None
            return
        self.springs = None if rows.elastic else _stiffness(body.springs, body.node_count)
        self.nudge = math.sqrt(np.finfo(start.nodes.x.dtype).eps) * body.size
        self.vector = np.random.default_rng(0).standard_normal((body.node_count, 3))
        self.noise = NOISE / np.abs(self.vector).max() * self.vector
        self.ends, self.length = body.springs.ends, lengths(body.rest, body.springs.ends)
        self.change = CHANGED * body.rest_pressure
        at_rest = start.moved_to(setup.body.rest)
        self.at_rest = self.square = self._iterated(at_rest, np.zeros_like(start.lam), FIRST)
        self.steps = self.needed(start)

    def advanced(self, stage: Stage, state: State, frame: int, boundary: BoundaryConditions) -> tuple[State, int]:
        """The state after frame number `frame` with that boundary, and the steps that it took: twice as many, up to
        AGAIN times, where they were too long for the load at its end. Faces of a cut keep what they did, so a frame
        with them runs once."""
        steps, again = self.steps, AGAIN if state.pairs is None else 0
        if self.limit is None:
            return stage.setup.method.advance(state, boundary), steps
        while True:
            vector, after = self.vector, stage.setup.method.advance(state, boundary)
            needed = self.needed(after) if self._differs(after) else self.counted
            if needed <= LATE * steps or again == 0:
                self.steps = max(min(needed, 2 * steps), math.ceil(FEWER * steps))
                return after, steps
            self.vector, steps, again = vector, 2 * steps, again - 1
            boundary = stage.boundary(frame, steps)

    def needed(self, state: State) -> int:
        """Steps of a frame that begins at `state`."""
        if self.limit is None:
            return self.clock.steps
        self.vector = self.vector + self.noise
        before, self.seen = self.square, state
        self.square = self._iterated(state, state.lam, FURTHER) if np.isfinite(state.nodes.v).all() else math.inf
        self.settled = abs(self.square - before) <= SETTLED * before
        self.counted = self._steps_of(self.square, self.limit)
        return self.counted

    def _differs(self, state: State) -> bool:
        """Whether steps must be counted again: the load is another than at the last count, or that was not the last."""
        seen, now = self.seen.rows, state.rows
        assert isinstance(seen, PointRows) and isinstance(now, PointRows)
        pairs = (state.lam, self.seen.lam), (now.eased, seen.eased)
        alike = self.settled and all(np.abs(new - old).max() <= self.change for new, old in pairs)
        return not (alike and largest_strain(state.nodes.x, self.seen.nodes.x, self.ends, self.length) <= CHANGED)

    def _steps_of(self, square: float, limit: StepLimit) -> int:
        """Steps of a frame with that ω² [1/s²] and that limit at rest."""
        if not square < HOPELESS * self.at_rest:
            return math.ceil(math.sqrt(HOPELESS)) * self.clock.steps
        rise = math.sqrt(max(square / self.at_rest, 1.0))
        loaded = StepLimit(rise * limit.frequency, limit.damping).damped
        share = max(SHARE, self.clock.longest / limit.damped)
        longest = min(self.clock.longest, share * loaded)
        return max(self.clock.steps, math.ceil(self.clock.frame / longest - 1e-9))

    def _iterated(self, state: State, lam: np.ndarray, count: int) -> float:
        """ω² [1/s²] of the vector after `count` power iterations on M⁻¹ K at `state` with pressures `lam` [Pa] above
        those at rest."""
        rows, x, weight = state.rows, state.nodes.x, state.model.inverse_mass[:, None]
        assert isinstance(rows, PointRows)
        rows = rows._replace(most_squeezed=np.full_like(rows.most_squeezed, -np.inf))  # nudges are no steps
        rows.lam[:] = lam + state.model.rest_lam
        begin, square = self._force(rows, x), 0.0
        for _ in range(count):
            q = self.vector
            scale = self.nudge / np.abs(q).max()
            force = (begin - self._force(rows, x + scale * q)) / scale
            after = weight * (force if self.springs is None else force + self.springs @ q)
            square = float(np.vdot(q, after) / np.vdot(q, q))
            self.vector = after / np.abs(after).max()
        return square

    @staticmethod
    def _force(rows: PointRows, x: np.ndarray) -> np.ndarray:
        """The force of all points at positions `x` (n, 3) [m], with their springs if they are elastic, (n, 3) [N]."""
        padded = np.zeros((len(x), 4), dtype=rows.exact.tile.dtype)  # the kernels work in one precision
        padded[:, :3] = x
        forces_into(rows, padded[:, :3].copy(), padded, rows.lam)
        return rows.exact.force[:, :3].copy()


def _stiffness(springs: Springs, nodes: int) -> csr_array:
    """Springs without length act on each axis alone: a matrix of nodes, with a ninth of the numbers of one of axes
    [N/m]."""
    (i, j), k = springs.ends.T.astype(np.int64), springs.stiffness
    entries = np.concatenate([k, k, -k, -k]), (np.r_[i, j, i, j], np.r_[i, j, j, i])
    return csr_array(coo_array(entries, shape=(nodes, nodes)))
