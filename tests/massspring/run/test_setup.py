"""A run renumbers the nodes of a large body, and starts where it is put; nothing outside the run shows it."""

from dataclasses import replace

import numpy as np
import pytest

from massspring import (
    Attachment,
    Clock,
    Free,
    ImplicitVolume,
    MassSpringError,
    Setup,
    Volumes,
    simulate,
    surface_body,
    tetrahedral_body,
)
from massspring.body.membranes import membrane_body
from massspring.kernels.fused.chunk import LANES
from massspring.layout.allocate import start
from massspring.run.renumber import MANY, Numbered, numbered, renumbered
from tests.massspring.conftest import SOFT, block, icosphere
from tests.massspring.methods.test_methods import clock_for, squeeze, thrown


def test_a_start_away_from_rest_is_where_the_run_starts(ball_body):
    """Moved and turned as a whole it stays so: nothing pulls it back."""
    moved = ball_body.rest[:, [1, 2, 0]] + [0.1, 0.0, 0.0]
    setup = Setup(ball_body, ImplicitVolume(), clock_for(ball_body, 2, 5), positions=moved)
    assert np.array_equal(setup.start().x, moved)
    assert np.abs(simulate(setup).final - moved).max() < 1e-13


ROUND_OFF = 1e-12
"""Of sums in another order, over 20 steps with changing contacts; what one wrong number does is above 1e-3."""


@pytest.fixture(scope="module")
def ball():
    body = surface_body(*icosphere(3), SOFT)
    assert body.node_count >= MANY
    return body


def shuffled(body):
    """The body with the numbers of its nodes drawn at random, and those numbers."""
    place = np.random.default_rng(5).permutation(body.node_count)
    return renumbered(body, place), place


def pressed(body, method, v, clock) -> Setup:
    """Thrown and squeezed between planes, slightly shrunk, and held at one side by nodes in no order."""
    held = np.flatnonzero(body.rest[:, 0] < 0.9 * body.rest[:, 0].min())[::-1]
    return Setup(
        body,
        method,
        clock,
        squeeze(body, 0.004, clock.duration),
        (Attachment(held),),
        damping=20.0,
        velocity=v,
        positions=0.9999 * body.rest,
    )


def in_mesh_order(setup: Setup) -> Setup:
    """The same, run with the numbers of the mesh."""
    plain = replace(setup)
    vars(plain)["inside"] = Numbered(setup.body, None)
    return plain


@pytest.mark.parametrize("method", [Free(), ImplicitVolume()], ids=lambda method: method.name)
def test_the_numbers_of_the_nodes_change_nothing(ball, method):
    """Three runs: by the numbers of the mesh, by those of the slices, and of a mesh numbered at random."""
    other, place = shuffled(ball)
    v, clock = 0.1 * thrown(ball), clock_for(ball, 2, 10)
    plain = simulate(in_mesh_order(pressed(ball, method, v, clock)), snapshots=(1,))
    assert np.abs(plain.contact_force).max() > 0 and np.abs(plain.held_force).max() > 0
    for history, number in (
        (simulate(pressed(ball, method, v, clock), (1,)), slice(None)),
        (simulate(pressed(other, method, v[np.argsort(place)], clock), (1,)), place),
    ):
        assert np.abs(history.final[number] - plain.final).max() < ROUND_OFF * ball.size
        assert np.abs(history.snapshots[0][number] - plain.snapshots[0]).max() < ROUND_OFF * ball.size
        for name in ("volume", "pressure", "contact_force", "held_force", "kinetic", "elastic", "penetration"):
            a, b = getattr(history, name), getattr(plain, name)
            assert np.abs(a - b).max() <= 1e3 * ROUND_OFF * np.abs(b).max(), name


def test_one_volume_per_node_keeps_its_name_and_node():
    """Pressures and volumes come in the order of the volumes, which is that of the mesh."""
    body = tetrahedral_body(*block((8, 8, 7)), SOFT)
    body = body.keeping(Volumes.nodal(body))
    assert body.node_count >= MANY
    setup = pressed(body, ImplicitVolume(tolerance=1e-12), 0.1 * thrown(body), clock_for(body, 2, 10))
    history, plain = simulate(setup), simulate(in_mesh_order(setup))
    assert np.abs(history.final - plain.final).max() < 1e-9 * body.size  # the tolerance of the solves, not round-off
    assert np.abs(history.pressure - plain.pressure).max() < 1e-6 * np.abs(plain.pressure).max()


def test_nodes_of_a_full_slice_follow_each_other(ball):
    """From a mesh numbered at random too, and all but the last of a kind are full."""
    for body in (ball, shuffled(ball)[0]):
        inside = numbered(body)
        assert sorted(inside.permutation) == list(range(body.node_count))
        slices = start(inside.body).model.slices
        assert slices.split_node.min() == body.node_count - len(slices.split_node)
        assert (slices.first[slices.pieces :] >= 0).sum() == (body.node_count - len(slices.split_node)) // LANES
        for s in np.flatnonzero(slices.first >= 0):
            assert np.array_equal(slices.node[s], slices.first[s] + np.arange(LANES))
        assert (start(shuffled(ball)[0]).model.slices.first == -1).all()


def test_a_body_is_the_same_under_other_numbers(hollow_body):
    """Volumes, their shares of triangles, springs, triangle springs and masses go with their nodes."""
    for body in (hollow_body, membrane_body(*icosphere(2), 0.002, SOFT)):
        other, place = shuffled(body)
        x = body.rest + 0.001 * np.random.default_rng(1).normal(size=body.rest.shape)
        y = np.empty_like(x)
        y[place] = x
        assert np.allclose(other.kept.measure(y), body.kept.measure(x), rtol=1e-12)
        assert np.array_equal(other.mass[place], body.mass) and np.array_equal(other.rest[place], body.rest)
        assert np.array_equal(y[other.springs.ends], x[body.springs.ends])
        assert np.array_equal(y[other.membrane.triangles], x[body.membrane.triangles])
        assert np.array_equal(y[other.tetrahedra], x[body.tetrahedra])
        assert np.array_equal(y[other.triangles], x[body.triangles])


def test_damping_changes_where_nothing_moves_any_more():
    """A free body that flies loses c dt of its speed in each step; a frame that begins at the time counts as later."""
    body = tetrahedral_body(*block((1, 1, 1)), SOFT)
    flies = np.full_like(body.rest, 0.1)
    setup = Setup(body, Free(), Clock(0.1, 6, 100), damping=0.5, damping_at_rest=(0.3, 4.0), velocity=flies)
    way = simulate(setup, range(1, 7)).snapshots[:, 0, 0] - body.rest[0, 0]
    speed = 0.1 * np.cumprod(np.repeat([1.0 - 0.5e-3, 1.0 - 4.0e-3], 300))
    assert np.allclose(way, 1e-3 * np.cumsum(speed)[99::100], rtol=1e-9)
    with pytest.raises(MassSpringError, match="damping 1000 1/s reverses"):
        replace(setup, damping_at_rest=(0.3, 1000.0))
