"""The stage of thin probes in a step: search for crossings, contacts that stop the tip, and a last resort.

The result holds for steps of any size: the motion of the step is searched for crossings, each becomes a contact, and
the search repeats until nothing crosses (docs/theory.md, section 11).
"""

import math

from massspring.kernels.jit.decorators import njit_lean
from massspring.kernels.probe.arrays import IN_CONTACT, SEARCH_ROUNDS
from massspring.kernels.probe.broad_phase import ROOM, SAFE, fastest_node, find_near
from massspring.kernels.probe.contacts import solve_rows
from massspring.kernels.probe.fallback import carry
from massspring.kernels.probe.motion import gather, longest_way, move, settle
from massspring.kernels.probe.pressure import prepare, pressed_on
from massspring.kernels.probe.search import search

PASSES = 24
"""Most searches per step; each adds contacts or changes the direction of one."""


@njit_lean
def meet_probes(stage, volumes, push):
    """Contact with thin probes, once pressures and the other contacts of the step are known (eq. 11.1–11.7).

    Returns the factor of the push after contact. One volume: the factor is its pressure [Pa]. Several: lam and push of
    `volumes` are changed in place. If contacts do not change the push, `stage.mobility` is 0.
    """
    nodes, tips, probes, step, dt = stage.nodes, stage.tips, stage.probes, stage.step, stage.dt
    factor = push.factor
    plain = dt * fastest_node(stage.model, nodes, stage.contacts, push, dt) + longest_way(tips, step)
    if not plain < math.inf:
        return factor
    reach, horizon, crosses = plain, ROOM * plain, False
    find_near(nodes, tips, step, probes, horizon)
    gather(stage, push)
    probes.rows.count[0] = 0
    for sweep in range(PASSES):
        count, crosses = search(stage)
        if count == 0 or sweep + 1 == PASSES:
            break
        if sweep == 0:
            prepare(stage, volumes)
        reach = plain + dt * solve_rows(stage, volumes)
        probes.counts[SEARCH_ROUNDS] += 1
        if reach > horizon:
            horizon = ROOM * reach
            find_near(nodes, tips, step, probes, horizon)
            gather(stage, push)
        move(stage, volumes)
    probes.counts[IN_CONTACT] += probes.rows.count[0] > 0
    if crosses:
        factor, reach = carry(stage, volumes, push, plain, horizon)
    elif probes.rows.count[0] > 0:
        settle(stage)
        factor = pressed_on(stage, volumes, push)
    probes.travel[0] += SAFE * reach
    return factor
