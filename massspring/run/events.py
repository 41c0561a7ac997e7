"""Changes of the body during a run, such as a cut: their order in time, and the quantities that they must conserve."""

from dataclasses import dataclass, replace

import numpy as np
from scipy.sparse import coo_array, csr_array

from massspring.body.bisection import Growth
from massspring.body.body import Body
from massspring.body.springs import Springs
from massspring.errors import MassSpringError
from massspring.methods.capabilities import No
from massspring.methods.method import Method
from massspring.world.obstacles import Attachment

SAME = 1e-9
"""Relative difference allowed between masses or springs before and after: sums over the same cells, up to round-off."""


@dataclass(frozen=True, eq=False)
class Event:
    """A new body replaces the present one between two frames and takes over its positions and velocities."""

    body: Body
    parent: np.ndarray
    """For each node of `body` its node before the event, (n',)."""
    volume_parent: np.ndarray
    """For each kept volume of `body` the volume before the event that it was a part of, (m',)."""
    frame: int
    """Number of frames before the event."""
    attachments: tuple[Attachment, ...] = ()
    """The attachments of the new body, as many as before and in the same order."""
    ended: tuple[int, ...] = ()
    """Volumes that are no longer kept after the event, such as that of an opened lumen."""
    pairs: np.ndarray | None = None
    """Nodes behind a cut and their copies in front of it, (p, 2), if its faces touch from then on (`Setup.pairs`)."""
    growth: Growth | None = None
    """New nodes and springs beyond copies; None if there are none."""

    def carried(self, values: np.ndarray) -> np.ndarray:
        """Positions or velocities of the nodes of `body`, (n', 3), from those of the nodes before, (n, 3)."""
        return values[self.parent] if self.growth is None else self.growth.carry @ values


@dataclass(frozen=True, eq=False)
class Easing:
    """Moves volumes that an event found off their targets back to them, all in the same time, so that their sum is
    kept."""

    at: float
    """Time of the event [s]."""
    off: np.ndarray
    """Deviation of each kept volume from its target at the event [m³], (m,)."""
    time: float
    """Time until the volumes reach their targets [s]."""

    def left(self, t: np.ndarray) -> np.ndarray:
        """Remaining deviation of each volume from its target at times `t` (q,) [s], (q, m) [m³]."""
        share = np.clip(1.0 - (t - self.at) / self.time, 0.0, 1.0) if self.time > 0 else np.zeros(len(t))
        return share[:, None] * self.off


@dataclass(frozen=True, eq=False)
class LettingIn:
    """Moves the rest lengths of new springs, which start without force, to those of the rest shape in the time that a
    shear wave takes through the body."""

    springs: np.ndarray
    """Their numbers, (q,)."""
    begin: np.ndarray
    """Their lengths at the event [m], (q,)."""
    at: float
    """Time of the event [s]."""
    time: float
    """Time until they reach the rest lengths of the rest shape [s]."""

    def done(self, t: float) -> bool:
        """Whether they have reached them at time t [s]."""
        return t - self.at >= self.time

    def lengths(self, rest_length: np.ndarray, t: float) -> np.ndarray:
        """The rest lengths of all springs at time t [s], (s,) [m]; the final ones are `rest_length`."""
        lengths, share = rest_length.copy(), 1.0 if self.done(t) else (t - self.at) / self.time
        lengths[self.springs] = self.begin + share * (rest_length[self.springs] - self.begin)
        return lengths


def kept_momentum(v: np.ndarray, x: np.ndarray, mass: np.ndarray, growth: Growth) -> np.ndarray:
    """Velocities `v` (n', 3) [m/s] at positions `x` (n', 3) [m] plus a rigid motion of each piece, so that with `mass`
    (n',) [kg] the piece has the momentum and angular momentum that it had with its masses before."""
    kept = v.copy()
    for k in np.unique(growth.piece):
        of = np.flatnonzero(growth.piece == k)
        m, before, u = mass[of, None], growth.mass[of, None], v[of]
        r = x[of] - (m * x[of]).sum(axis=0) / m.sum()
        u = u + (before * v[of] - m * u).sum(axis=0) / m.sum()
        turn = (before * np.cross(r, v[of]) - m * np.cross(r, u)).sum(axis=0)
        inertia = (m * r**2).sum() * np.eye(3) - (m * r).T @ r
        kept[of] = u + np.cross(np.linalg.solve(inertia, turn), r)
    return kept


def check_events(events: tuple[Event, ...], frames: int, method: Method, precision: str, probes: bool) -> None:
    """Raises MassSpringError for events that this run cannot have."""
    supported = method.capabilities.events
    if isinstance(supported, No):
        raise MassSpringError(f"method '{method.name}' supports no body that changes in a run: {supported.because}")
    if precision != "float64" or probes:
        raise MassSpringError(
            "a body that changes in a run is advanced in float64 and without thin probes; leave these out"
        )
    at = [event.frame for event in events]
    if at[0] < 1 or at[-1] >= frames or (np.diff(at) <= 0).any():
        raise MassSpringError(
            f"the body changes after {', '.join(map(str, at))} of {frames} frames; give rising numbers from 1 to "
            f"{frames - 1}"
        )


def check_event(event: Event, before: Body) -> None:
    """Raises MassSpringError for a body whose masses, springs or volumes do not match those before the event."""
    parent, volumes = np.asarray(event.parent), np.asarray(event.volume_parent)
    kept = np.setdiff1d(np.arange(before.kept.count), event.ended)
    if before.kept.count - len(kept) != len(event.ended):
        raise MassSpringError(
            f"the volumes {event.ended} that end at an event are not among the {before.kept.count} before it, or one "
            "is given twice"
        )
    for what, rows, count, numbers in (
        ("nodes", parent, event.body.node_count, np.arange(before.node_count)),
        ("kept volumes", volumes, event.body.kept.count, kept),
    ):
        if rows.shape != (count,) or not np.array_equal(np.unique(rows), numbers):
            raise MassSpringError(
                f"the {count} {what} after an event do not name all {len(numbers)} before it; give each its parent"
            )
    grown = event.growth
    old = np.ones(len(parent), dtype=bool) if grown is None else grown.mass > 0.0
    if not np.array_equal(event.body.rest[old], before.rest[parent[old]]):
        raise MassSpringError("a node lies elsewhere at rest after an event; a change of the body moves no node")
    kept = event.body.mass if grown is None else grown.mass
    mass = np.bincount(parent, weights=kept, minlength=before.node_count)
    if np.abs(mass - before.mass).max() > SAME * before.mass.max():
        raise MassSpringError("the masses of a node's copies do not add up to its mass; make both of the same cells")
    if grown is not None:
        return _check_growth(event, grown, before)
    was, now = _network(before.springs, before.node_count), _network(event.body.springs, before.node_count, parent)
    if abs(was - now).max() > SAME * abs(was).max():
        raise MassSpringError(
            f"springs of law '{before.law}' do not add up to those before an event, for they are no sums over cells; "
            "take law van_gelder or cotangent, or a quadratic body"
        )


def _check_growth(event: Event, growth: Growth, before: Body) -> None:
    """Raises MassSpringError for misplaced new nodes, for a piece that gains or loses mass, and for existing springs
    that become stiffer."""
    body = event.body
    if np.abs(event.carried(before.rest) - body.rest).max() > SAME * before.size:
        raise MassSpringError("a new node is not carried to its place at rest; give it weights that meet it")
    was, now = (np.bincount(growth.piece, mass) for mass in (growth.mass, body.mass))
    if np.abs(was - now).max() > SAME * was.max():
        raise MassSpringError("a piece gains or loses mass at an event; new nodes take theirs from their piece")
    kept = np.ones(body.springs.count, dtype=bool)
    kept[growth.springs] = False
    springs = body.springs
    springs = replace(springs, ends=springs.ends[kept], stiffness=springs.stiffness[kept])
    was, now = _network(before.springs, before.node_count), _network(springs, before.node_count, event.parent)
    if csr_array(now - was).max() > SAME * before.springs.stiffness.max():
        raise MassSpringError("springs that are not new are stiffer after an event; share what they had among copies")


def _network(springs: Springs, n: int, parent: np.ndarray | None = None) -> csr_array:
    """Sum of the stiffnesses between each two nodes, (n, n)."""
    ends = springs.ends.astype(np.int64) if parent is None else parent[springs.ends.astype(np.int64)]
    ends = np.sort(ends, axis=1)
    return csr_array(coo_array((springs.stiffness, (ends[:, 0], ends[:, 1])), shape=(n, n)))
