"""Links of ChainMail: bounds on the distance of nodes along each axis, and how moved nodes displace the others.

A link asks low ≤ x_j − x_i ≤ high along each axis. Solutions of such bounds are closed under minima and maxima. So one
pass lowers and another raises the nodes, each by as little as the fixed nodes require, and the result does not depend
on the order (docs/theory.md, eq. 14.8).
"""

from typing import NamedTuple

import numpy as np

from massspring.kernels.contact.gaps import gap_and_normal
from massspring.kernels.jit.by_address import by_address
from massspring.kernels.jit.decorators import njit_inlined, njit_lean
from massspring.kernels.jit.vec3 import minus, put, row, times

TOUCHING = 1e-12
"""Depth inside an obstacle up to which a node lies on it [m]."""


@by_address
class Links(NamedTuple):
    """2 s links, from both ends of each of s springs; n nodes."""

    start: np.ndarray
    """First link of each node, (n + 1,) int64."""
    other: np.ndarray
    """The node at the other end, (2s,) int64."""
    rest: np.ndarray
    """x_j − x_i at rest [m], (2s, 3)."""
    low: np.ndarray
    """[m], (2s, 3)."""
    high: np.ndarray
    """[m], (2s, 3)."""


@by_address
class Mail(NamedTuple):
    """Links and scratch."""

    links: Links
    fixed: np.ndarray
    """1 for nodes that neither links nor relaxation move in this step, (n,) uint8."""
    queue: np.ndarray
    """(n,) int64."""
    queued: np.ndarray
    """(n,) uint8."""


@njit_inlined
def spread(x, mail, axis, raising):
    """Moves nodes up (`raising`) or down along `axis`, by as little as their links to fixed and moved nodes require."""
    links, fixed, queue, queued = mail.links, mail.fixed, mail.queue, mail.queued
    size, head, count = queue.shape[0], 0, 0
    for i in range(size):
        queued[i] = fixed[i]
        if fixed[i] > 0:
            queue[count] = i
            count += 1
    while count > 0:
        i = queue[head]
        head, count = (head + 1) % size, count - 1
        queued[i] = 0
        for e in range(links.start[i], links.start[i + 1]):
            j = links.other[e]
            bound = x[i, axis] + (links.low[e, axis] if raising else links.high[e, axis])
            if (x[j, axis] >= bound) if raising else (x[j, axis] <= bound):
                continue
            if fixed[j] > 0:
                continue
            x[j, axis] = bound
            if queued[j] == 0:
                queued[j] = 1
                queue[(head + count) % size] = j
                count += 1


@njit_lean
def propagate(x, mail):
    """`spread` along all axes, down, then up (eq. 14.8). Returns whether a link still exceeds its bounds because fixed
    nodes are too far apart."""
    for axis in range(3):
        spread(x, mail, axis, False)
        spread(x, mail, axis, True)
    links = mail.links
    for i in range(x.shape[0]):
        for e in range(links.start[i], links.start[i + 1]):
            for axis in range(3):
                apart = x[links.other[e], axis] - x[i, axis]
                if apart > links.high[e, axis] + TOUCHING or apart < links.low[e, axis] - TOUCHING:
                    return True
    return False


@njit_lean
def push_out(x, model, mail, boundary, step):
    """Moves surface nodes that are inside an obstacle onto it, and fixes them; returns how many."""
    count = 0
    for c in range(model.surface_nodes.shape[0]):
        i = model.surface_nodes[c]
        if model.touchable[i] == 0:
            continue
        if lifted(x, boundary, step, i):
            mail.fixed[i] = 1
            count += 1
    return count


@njit_inlined
def lifted(x, boundary, step, i):
    """Moves node i out of all obstacles that contain it, one after the other. Returns whether there was one."""
    inside, place = False, boundary.position[step]
    for o in range(boundary.radius.shape[0]):
        gap, n = gap_and_normal(boundary, o, minus(row(x, i), row(place, o)))
        if gap < -TOUCHING:
            put(x, i, minus(row(x, i), times(gap, n)))
            inside = True
    return inside


@njit_inlined
def bounded(x, links, i, axis, place):
    """`place` or the nearest position along `axis` that all links of node i allow."""
    low, high = -np.inf, np.inf
    for e in range(links.start[i], links.start[i + 1]):
        j = links.other[e]
        low = max(low, x[j, axis] - links.high[e, axis])
        high = min(high, x[j, axis] - links.low[e, axis])
    return max(low, min(place, high))


@njit_lean
def relax(x, model, mail, boundary, when):
    """Moves each free node in turn to the mean of the positions at which its links are at rest, within the bounds of
    all its links and outside obstacles (eq. 14.9). A node for which that is impossible does not move.

    `when`: (step, whether to start with the last node).
    """
    links, (step, backwards) = mail.links, when
    for k in range(x.shape[0]):
        i = k if not backwards else x.shape[0] - 1 - k
        first, last = links.start[i], links.start[i + 1]
        if model.inverse_mass[i] == 0.0 or first == last:
            continue
        old = row(x, i)
        for axis in range(3):
            mean = 0.0
            for e in range(first, last):
                mean += x[links.other[e], axis] - links.rest[e, axis]
            x[i, axis] = mean / (last - first)
        if model.touchable[i] > 0:
            lifted(x, boundary, step, i)
        for axis in range(3):
            x[i, axis] = bounded(x, links, i, axis, x[i, axis])
        if model.touchable[i] > 0 and is_inside(x, boundary, step, i):
            put(x, i, old)


@njit_inlined
def is_inside(x, boundary, step, i):
    """Whether node i is inside an obstacle by more than TOUCHING."""
    place = boundary.position[step]
    for o in range(boundary.radius.shape[0]):
        if gap_and_normal(boundary, o, minus(row(x, i), row(place, o)))[0] < -TOUCHING:
            return True
    return False
