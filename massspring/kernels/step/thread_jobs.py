"""Work of the other threads of a team during a frame (kernels.jit.thread_team)."""

from massspring.kernels.arrays.layout import Push
from massspring.kernels.contact.gaps import predicted_gaps_into
from massspring.kernels.fused.padded import pad_positions
from massspring.kernels.fused.sweep import pass_slices
from massspring.kernels.jit.decorators import njit_lean
from massspring.kernels.jit.thread_team import (
    DONE,
    JOB,
    JOB_END,
    JOB_SEARCH,
    JOB_SPRINGS,
    JOB_SPRINGS_AND_VOLUME,
    ROUND,
    STEP,
    fork,
    raise_by_one,
    wait_until_other_than,
)
from massspring.kernels.step.advance import advance_nodes


@njit_lean
def worker(frame, team, direction, rank):
    """Does part number `rank` of every job until the frame ends; `direction` (n, 3) is that of the pushes."""
    model, nodes, contacts, work, boundary = frame.model, frame.nodes, frame.contacts, frame.work, frame.boundary
    slices = team.slices[rank], team.slices[rank + 1]
    part = team.nodes[rank], team.nodes[rank + 1]
    round_number = 0
    while True:
        round_number = wait_until_other_than(team.signal, ROUND, round_number)
        job, step = team.signal[JOB], team.signal[STEP]
        push = Push(direction, team.factor[0])
        if job == JOB_END:
            return
        if job == JOB_SPRINGS:
            pass_slices(nodes, work, boundary, model.slices, slices, False, work.tile[rank])
        elif job == JOB_SPRINGS_AND_VOLUME:
            pass_slices(nodes, work, boundary, model.slices, slices, True, work.tile[rank])
        elif job == JOB_SEARCH:
            predicted_gaps_into(model, nodes, contacts, boundary, step, push, part)
        else:
            advance_nodes(nodes, contacts, work, model.inverse_mass, push, boundary.dt, part)
            pad_positions(nodes, work, part[0], part[1])
        raise_by_one(team.signal, DONE)


@njit_lean
def shutdown(team):
    """Ends the frame for the other threads."""
    fork(team, JOB_END, 0, 0.0)
