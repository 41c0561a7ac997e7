"""The record of a run, frame by frame."""

from dataclasses import dataclass

import numpy as np
from scipy.sparse import csr_array

from massspring.body.body import Body, Measured
from massspring.kernels.points.arrays import PointRows
from massspring.kernels.probe.arrays import COUNTS
from massspring.layout.facet_rows import facet_rule
from massspring.layout.probe_arrays import tip_depth
from massspring.layout.state import State
from massspring.run.energy import EnergyAccount, elastic_energy, kinetic_energy
from massspring.world.clock import Clock
from massspring.world.depth import deepest
from massspring.world.obstacles import Obstacle, Plane, Probe

ENERGIES = ("kinetic", "elastic", "tissue_kinetic", "work")


@dataclass(frozen=True, eq=False)
class History:
    """F frames; entries after an early end are NaN."""

    t: np.ndarray
    """End of each frame [s], (F,)."""
    volume: np.ndarray
    """Of each kept volume [m³], (F, m)."""
    volume_target: np.ndarray
    """Target of each kept volume at the end of each frame [m³], (F, m)."""
    pressure: np.ndarray
    """lam of the last step of the frame [Pa], (F, m)."""
    kinetic: np.ndarray
    """[J], (F,)."""
    elastic: np.ndarray
    """Above the rest state [J], (F,)."""
    tissue_kinetic: np.ndarray
    """With the masses of the tissue, where the body moves by others [J], (F,)."""
    work: np.ndarray
    """Done on the body by obstacles, attachments, gravity, fills and events, and its energy at the start [J], (F,):
    damping and friction only lower kinetic + elastic − work. NaN for a method that stores energy in other ways too."""
    contact_force: np.ndarray
    """Force of each obstacle on the body at the end of the frame [N], (F, o, 3)."""
    penetration: np.ndarray
    """Penetration of the deepest point of the surface into each obstacle at the end of the frame, into a plane of the
    deepest node or contact point [m], (F, o)."""
    inside: np.ndarray
    """Whether the centre of a sphere or a point of a capsule's axis was inside the body at the end of the frame, or
    passed through it in the frame, (F, o); never for planes and thin probes."""
    held_force: np.ndarray
    """Force of each attachment on the body at the end of the frame [N], (F, g, 3)."""
    min_j: np.ndarray
    """Smallest J of an element [1], of quadratic ones at any step of the frame, of others at its end, (F,); NaN for a
    surface body."""
    snapshot_frames: np.ndarray
    """Frame numbers, 1 … F, (s,)."""
    snapshots: np.ndarray
    """Positions after those frames [m], (s, n, 3)."""
    final: np.ndarray
    """Positions after the last good frame [m], (n, 3)."""
    steps: np.ndarray
    """Of each frame, (F,) int64; 0 after an early end."""
    frame_ns: np.ndarray
    """Wall time of each frame's steps [ns], (F,); 0 after an early end."""
    cpu_ns: np.ndarray
    """Processor time of this thread over the same spans [ns], (F,): shorter where the thread had to wait."""
    outcome: str
    """"finished", "diverged", "blocked" (a thin probe met tissue that had nowhere to go) or "timed-out"."""
    good_frames: int
    """Frames before the early end, F when there was none."""
    message: str
    """Why it stopped; empty when it did not."""
    singular_steps: int
    """Steps in which a volume had no gradient to push on."""
    limited_corrections: int
    """Steps that corrected only part of a volume error."""
    iterations: np.ndarray
    """Iterations for the multipliers in each frame: sum over its steps, and the most in one step, (F, 2) int64."""
    probe_counts: np.ndarray
    """Counts of the stage of thin probes in each frame, one column for each of kernels.probe.arrays.COUNTS, (F, 7)
    int64."""
    passages: tuple["Passage", ...] = ()
    """One for each event that took place."""


@dataclass(frozen=True)
class Passage:
    """Change of energy and momentum by an event, and its computing time."""

    energy: float
    """Change of kinetic and elastic energy over their sum before [1]."""
    momentum: float
    """Size of the change of momentum over the sum of its sizes in all nodes before [1]."""
    ns: int
    """Wall time of the event [ns], without the preparation before the run."""


@dataclass(frozen=True, eq=False)
class Numbers:
    """Maps nodes and volumes of the last body of a run, by which results are recorded, to those of the current body."""

    nodes: np.ndarray
    """For each node of the last body its node in the current body, (n,)."""
    volumes: np.ndarray
    """For each kept volume of the last body the current volume of which it is a part, (m,)."""
    carry: csr_array | None = None
    """Weights that give node positions from the k current nodes, (n, k), if some nodes do not exist yet; None: use
    `nodes`."""

    @property
    def matrix(self) -> csr_array:
        """`carry`, or the matrix equivalent to `nodes`, (n, k)."""
        rows = np.arange(len(self.nodes))
        return csr_array((np.ones(len(rows)), (rows, self.nodes))) if self.carry is None else self.carry

    def carried(self, values: np.ndarray) -> np.ndarray:
        """Positions or velocities (n, 3) from those of the current nodes, (k, 3)."""
        return values[self.nodes] if self.carry is None else self.carry @ values

    def after(self, before: "Numbers") -> "Numbers":
        """This map composed with `before`, which maps the nodes of its target body to those of an earlier body."""
        carry = None if before.carry is None and self.carry is None else self.matrix @ before.matrix
        return Numbers(before.nodes[self.nodes], before.volumes[self.volumes], carry)

    def parts(self, volumes: np.ndarray, whole: np.ndarray) -> np.ndarray:
        """The values `whole` of the current volumes, divided among their parts in proportion to `volumes` (m,),
        (m,)."""
        together = np.bincount(self.volumes, weights=volumes, minlength=len(whole))
        return volumes * (whole[self.volumes] / together[self.volumes])


def passage(before: State, was: Body, after: State, now: Body, ns: int) -> Passage:
    """The changes by an event that replaced body `was` in state `before` by body `now` in state `after`; `ns`: its wall
    time."""
    energy, changed = (
        kinetic_energy(state) + elastic_energy(state) - body.rest_energy + body.measured(state.x).local_energy
        for state, body in ((before, was), (after, now))
    )
    momentum, pushed = (state.model.mass[:, None] * state.nodes.v for state in (before, after))
    size = float(np.linalg.norm(momentum, axis=1).sum())
    push = float(np.linalg.norm(pushed.sum(axis=0) - momentum.sum(axis=0)))
    return Passage(_over(abs(changed - energy), energy), _over(push, size), ns)


def _over(part: float, whole: float) -> float:
    return part / whole if whole > 0.0 else 0.0


class Recorder:
    """Fills the arrays of a History."""

    def __init__(
        self,
        body: Body,
        clock: Clock,
        obstacles: tuple[Obstacle, ...],
        attachments: int,
        keep: frozenset[int],
    ) -> None:
        frames = clock.frames
        self.body = body
        self.clock = clock
        self.t = clock.frame * np.arange(1, frames + 1)
        self.scalars = {name: np.full(frames, np.nan) for name in (*ENERGIES, "min_j")}
        self.volumes = body.kept
        self.volume, self.pressure, self.volume_target = (
            np.full((frames, self.volumes.count), np.nan) for _ in range(3)
        )
        self.iterations = np.zeros((frames, 2), dtype=np.int64)
        self.probe_counts = np.zeros((frames, len(COUNTS)), dtype=np.int64)
        self.obstacles = obstacles
        # The impulses of thin probes come last.
        self.rank = sorted(range(len(obstacles)), key=lambda o: isinstance(obstacles[o], Probe))
        self.surface_nodes, self.facets = body.surface_nodes, body.facets
        self.inside = np.zeros((frames, len(obstacles)), dtype=bool)
        self.contact_force = np.full((frames, len(obstacles), 3), np.nan)
        self.penetration = np.full((frames, len(obstacles)), np.nan)
        self.held_force = np.full((frames, attachments, 3), np.nan)
        self.steps, self.frame_ns, self.cpu_ns = (np.zeros(frames, dtype=np.int64) for _ in range(3))
        self.keep = keep
        self.kept: dict[int, np.ndarray] = {}
        self.final = body.rest
        self.singular = 0
        self.limited = 0
        self.passages: list[Passage] = []

    def record(
        self,
        frame: int,
        state: State,
        measured: Measured,
        steps: int,
        ns: tuple[int, int],
        numbers: Numbers | None = None,
    ) -> None:
        """Records the state after frame number `frame` (0, 1, …) of so many `steps`, which took so many `ns` of wall
        and of processor time; `numbers` maps to it from the last body, None after the last event."""
        measured = measured if numbers is None else self.body.measured(numbers.carried(measured.x))
        x = measured.x
        self.volume[frame] = measured.volume
        self.pressure[frame] = state.lam if numbers is None else state.lam[numbers.volumes]
        squeezed = state.rows.most_squeezed.max() if isinstance(state.rows, PointRows) else -np.inf
        self.scalars["min_j"][frame] = min(measured.least_j, 1.0 - squeezed)
        done = state.diagnostics
        self.contact_force[frame, self.rank] = self._at_end(done.contact_impulse, done.earlier_contact, steps)
        self.held_force[frame] = self._at_end(done.held_impulse, done.earlier_held, steps)
        for o, obstacle in enumerate(self.obstacles):
            self.penetration[frame, o] = max(0.0, self._depth(frame, o, obstacle, x))
        self.steps[frame], (self.frame_ns[frame], self.cpu_ns[frame]) = steps, ns
        self.singular += int(state.diagnostics.singular[0])
        self.limited += int(state.diagnostics.limited[0])
        self.iterations[frame] = state.diagnostics.iterations
        if state.probing is not None:
            self.probe_counts[frame] = state.probing.counts - self.probe_counts[:frame].sum(axis=0)
        self.final = x
        if frame + 1 in self.keep:
            self.kept[frame + 1] = x

    def _at_end(self, impulse: np.ndarray, earlier: np.ndarray, steps: int) -> np.ndarray:
        """The force [N] at the end of a frame of so many steps from its impulse [N s], all and before the last step,
        (k, 3): along that of the last step, as large as the line through the means of the last step and of those
        before it, each in the middle of its time."""
        dt = self.clock.frame / steps
        last = (impulse - earlier) / dt
        if steps == 1:
            return last
        size, before = (np.linalg.norm(f, axis=1) for f in (last, earlier / (dt * (steps - 1))))
        larger = np.divide(size - before, steps * size, out=np.zeros_like(size), where=size > 0.0)
        return np.maximum(1.0 + larger, 0.0)[:, None] * last

    def record_energy(self, frame: int, account: EnergyAccount) -> None:
        """Records the energies after a frame."""
        for name in ENERGIES:
            self.scalars[name][frame] = getattr(account, name)

    def _depth(self, frame: int, o: int, obstacle: Obstacle, x: np.ndarray) -> float:
        """Depth in obstacle number o at the end of a frame, with the body at `x` (n, 3) [m]; notes one that is
        inside."""
        t, triangles = float(self.t[frame]), self.body.triangles
        if isinstance(obstacle, Probe):
            return tip_depth(obstacle, x, triangles, t)
        if isinstance(obstacle, Plane):
            gap, facets = obstacle.gap(x, t), self.body.contact_facets
            least = gap[self.surface_nodes].min()
            if len(facets):  # the gap is linear in x
                least = min(least, np.einsum("qa,fa->fq", facet_rule()[0], gap[facets]).min())
            return -float(least)
        depth, inside = deepest(obstacle, x, self.facets, triangles, t, (self.final, t - self.clock.frame))
        self.inside[frame, o] = inside
        return depth

    def record_targets(self, frame: int, targets: np.ndarray, numbers: Numbers | None) -> None:
        """Records the targets of the current volumes after a frame [m³]; parts of a volume that is not yet divided get
        shares of its target."""
        self.volume_target[frame] = targets if numbers is None else numbers.parts(self.volume[frame], targets)

    def finished(self) -> History:
        """All frames ran."""
        return self._history("finished", self.clock.frames, "")

    def stopped(self, frame: int, outcome: str, reason: str) -> History:
        """The run ends before frame number `frame` (0, 1, …)."""
        return self._history(outcome, frame, f"{outcome} in frame {frame + 1} at {self.t[frame]:.4g} s: {reason}")

    def _history(self, outcome: str, good_frames: int, message: str) -> History:
        frames = sorted(self.kept)
        shape = (len(frames), self.body.node_count, 3)
        return History(
            t=self.t,
            volume=self.volume,
            volume_target=self.volume_target,
            pressure=self.pressure,
            kinetic=self.scalars["kinetic"],
            elastic=self.scalars["elastic"],
            tissue_kinetic=self.scalars["tissue_kinetic"],
            work=self.scalars["work"],
            contact_force=self.contact_force,
            penetration=self.penetration,
            inside=self.inside,
            held_force=self.held_force,
            min_j=self.scalars["min_j"],
            snapshot_frames=np.array(frames, dtype=np.int64),
            snapshots=np.array([self.kept[f] for f in frames]).reshape(shape),
            final=self.final,
            steps=self.steps,
            frame_ns=self.frame_ns,
            cpu_ns=self.cpu_ns,
            outcome=outcome,
            good_frames=good_frames,
            message=message,
            singular_steps=self.singular,
            limited_corrections=self.limited,
            iterations=self.iterations,
            probe_counts=self.probe_counts,
            passages=tuple(self.passages),
        )
