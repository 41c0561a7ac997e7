"""Chain mail: limits of every link, no order, a chain in closed form, obstacles, and what it refuses."""

import numpy as np
import pytest

from massspring import Attachment, ChainMail, Clock, Setup, Trajectory, simulate
from massspring.methods.literature.chain_links import Links, Mail, propagate, relax
from tests.massspring.methods.test_methods import squeeze

ROUND_OFF = 1e-14


def out_of_bounds(links, x) -> float:
    """How far the worst link is beyond its limits [m]."""
    begin = np.repeat(np.arange(len(x)), np.diff(links.start))
    apart = x[links.other] - x[begin]
    return float(np.maximum(apart - links.high, links.low - apart).max())


def mail_of(links, n) -> Mail:
    return Mail(links, np.zeros(n, dtype=np.uint8), np.zeros(n, dtype=np.int64), np.zeros(n, dtype=np.uint8))


def displaced(body, method, seed=0, renumbered=None):
    """Where all nodes are after two of them were moved by up to half of the body; and the links."""
    n = body.node_count
    number = np.arange(n) if renumbered is None else renumbered
    links = method.links_of(body)
    if renumbered is not None:
        links = renamed(links, number)
    x = np.empty_like(body.rest)
    x[number] = body.rest
    mail = mail_of(links, n)
    moved = number[[0, 1]]
    x[moved] += np.array([[0.4, -0.3, 0.2], [0.38, -0.3, 0.21]]) * np.ptp(body.rest, axis=0).max()
    mail.fixed[moved] = 1
    assert not propagate(x, mail)
    return x[number], links, x


def renamed(links, number):
    begin = number[np.repeat(np.arange(len(number)), np.diff(links.start))]
    end = number[links.other]
    order = np.lexsort((-end, begin))
    start = np.searchsorted(begin[order], np.arange(len(number) + 1)).astype(np.int64)
    return Links(start, end[order], *(part[order] for part in links[2:]))


def test_every_link_is_within_its_limits_after_a_far_move(block_body):
    x, links, _ = displaced(block_body, ChainMail())
    assert np.abs(x - block_body.rest).max() > 0.1 * block_body.size  # the links move the other nodes too
    assert out_of_bounds(links, x) < ROUND_OFF
    assert out_of_bounds(links, block_body.rest) < 0.0


@pytest.mark.parametrize("seed", range(3))
def test_no_order_of_nodes_or_links_changes_the_answer(block_body, seed):
    number = np.random.default_rng(seed).permutation(block_body.node_count)
    here, there = (displaced(block_body, ChainMail(), renumbered=order)[0] for order in (None, number))
    assert np.abs(here - there).max() < ROUND_OFF


def test_each_node_moves_as_little_as_it_must(block_body):
    """Any node put back a little towards where it was breaks a link."""
    x, links, _ = displaced(block_body, ChainMail())
    for i, axis in zip(*np.nonzero(np.abs(x - block_body.rest) > 1e-6), strict=True):
        if i > 1:
            trial = x.copy()
            trial[i, axis] += 1e-7 * np.sign(block_body.rest[i, axis] - x[i, axis])
            assert out_of_bounds(links, trial) > 0.5e-7


def test_rest_stays_at_rest(block_body):
    history = simulate(Setup(block_body, ChainMail(), Clock(0.02, 5, 2)))
    assert np.abs(history.final - block_body.rest).max() < ROUND_OFF


@pytest.mark.parametrize("sweeps", [0, 20])
def test_links_hold_and_nothing_enters_while_it_is_pressed(filled_ball, sweeps):
    method = ChainMail(sweeps=sweeps)
    planes = squeeze(filled_ball, 0.008, 1.0)
    setup = Setup(filled_ball, method, Clock(0.1, 12, 1), planes)
    links, state = method.links_of(setup.inside.body), setup.start()
    for frame in range(12):
        state = method.advance(state, setup.boundary(frame))
        torn = state.diagnostics.limited[0] > 0
        assert torn != (out_of_bounds(links, state.nodes.x) < ROUND_OFF) and not (torn and sweeps)
    history = simulate(setup)
    assert history.outcome == "finished" and history.penetration.max() <= 1.01e-12
    assert np.isnan(history.contact_force).all()  # geometry has no force
    assert np.array_equal(history.final, simulate(setup).final)


@pytest.mark.parametrize("backwards", [False, True])
def test_relaxation_stays_within_the_limits(block_body, backwards):
    """After a far move, where many links are at their limits."""
    x, links, _ = displaced(block_body, ChainMail())
    held = Attachment(np.array([0, 1]))
    setup = Setup(block_body, ChainMail(), Clock(0.1, 1, 1), attachments=(held,))
    before = x.copy()
    relax(x, setup.start().model, mail_of(links, len(x)), setup.boundary(0), (0, backwards))
    assert np.abs(x - before).max() > 0.01 * block_body.size
    assert out_of_bounds(links, x) < ROUND_OFF


def test_what_is_pressed_beyond_all_links_is_counted(filled_ball):
    high, low = (np.flatnonzero(sign * filled_ball.rest[:, 2] > 0.03) for sign in (1, -1))
    press = Attachment(high, Trajectory((0.0, 0.1), ((0, 0, 0), (0, 0, -0.06))))
    setup = Setup(filled_ball, ChainMail(), Clock(0.02, 5, 1), (), (press, Attachment(low)))
    history = simulate(setup)
    assert history.outcome == "finished" and history.limited_corrections > 0
