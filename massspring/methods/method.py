"""What a method is: settings (a frozen dataclass), claims (class variables), one compiled loop over the steps."""

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace
from typing import ClassVar, Literal, Protocol

import numpy as np
from scipy.sparse import csr_array

from massspring.body.body import Body
from massspring.kernels.arrays.layout import Drive
from massspring.layout.allocate import start
from massspring.layout.probe_arrays import fresh
from massspring.layout.state import State, new_tally
from massspring.layout.threads import crew
from massspring.world.obstacles import Attachment

Remedy = Literal["capped", "whole", "force", "unbounded"]
"""What a step does about a volume that is far off."""


class Method(Protocol):
    """One way to advance time. A new one derives from this: a file, and a line in METHODS."""

    name: ClassVar[str]
    """Word on the command line."""
    order: ClassVar[int]
    """Claim: global error of the trajectory ~ dt^order."""
    volume_tol: ClassVar[float | None]
    """Claim: |V/V0 − 1| after a quiet step at half the stability limit; None where a step promises no volume."""
    keeps_spin: ClassVar[bool] = True
    """Claim: a body in free flight keeps its angular momentum to round-off."""
    holds_apart: ClassVar[bool] = False
    """Whether it starts with the pressure that holds springs without length apart at rest."""

    remedy: ClassVar[Remedy | None] = None
    """Claim: what a step does about a volume that is far off. "capped": each volume moves a node by no more than
    `longest_correction` to make up for it (eq. 35), the rest is left to later steps; "whole": all of it is made up for
    at once; "force": a force whose size only the length of a stable step bounds; "unbounded": one that nothing bounds
    as a volume goes to 0, so that a crushed body bursts and the run has diverged. None where no volume is kept, at most
    something that stands for it. With a remedy, steps in which a volume has nothing to push on are counted."""
    follows_targets: ClassVar[bool] = True
    """Whether the target of a kept volume is followed where it changes."""
    misses_probes: ClassVar[str | None] = "its steps have no stage for them"
    """Why thin probes are not met; None where they are, in continuous time."""
    threaded: ClassVar[bool] = False
    """Whether a frame can be shared by several threads."""
    limited: ClassVar[bool] = True
    """Whether steps beyond the stability limit diverge; where not, accuracy alone limits them."""

    def applies(self, body: Body) -> str | None:
        """Why the method cannot advance `body`; None when it can."""
        return None

    def added_stiffness(self, body: Body) -> csr_array | None:
        """B [√(N/m)], (3n, r): small oscillations about rest feel B Bᵀ beside the springs; None for nothing."""
        return None

    def start(self, body: Body, attachments: tuple[Attachment, ...] = (), v: np.ndarray | None = None) -> State:
        """The body at rest, or with velocities `v` (n, 3) [m/s]. Raises MassSpringError."""
        return start(body, attachments, v)

    def advance(self, state: State, drive: Drive) -> State:
        """One frame: as many steps as `drive.position` has rows."""
        ...


def one_whole(body: Body) -> str | None:
    """Why a method that keeps the one volume inside the body's surface does not apply; None when it does."""
    kept = body.kept
    if kept.count > 1:
        return f"it keeps one volume, the body keeps {kept.count}; keep the whole, or take implicit_volume"
    if not (np.abs(kept.share.data) == 1.0).all():
        return "it keeps what one closed surface encloses, the body keeps a share of it; take implicit_volume"
    return None


def begin_frame(state: State, drive: Drive) -> State:
    """A copy to advance in place, so that the caller's state stays what it was."""
    nodes = state.nodes._replace(x=state.nodes.x.copy(), v=state.nodes.v.copy())
    obstacles = len(drive.radius) + drive.tips.end.shape[1]
    tally = new_tally(obstacles, drive.held_displacement.shape[1], state.tally.ticks)
    probing = None if state.probing is None else fresh(state.probing, tally)
    return replace(state, nodes=nodes, tally=tally, probing=probing)


@contextmanager
def crewed_frame(state: State, drive: Drive) -> Iterator[State]:
    """A copy to advance in place; inside, all threads of the state are there."""
    after = begin_frame(state, drive)
    direction = after.nodes.gradient if after.rows is None else after.rows.push
    with crew(after.frame(drive), direction):
        yield after
