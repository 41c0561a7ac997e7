"""Bodies that are cut in a run, against exact answers: bodies without a cut, volumes before, affine motions."""

import itertools
from dataclasses import replace

import numpy as np
import pytest

from massspring import (
    Attachment,
    Body,
    Event,
    ImplicitVolume,
    Setup,
    Trajectory,
    Volumes,
    make_clock,
    simulate,
    step_limit,
)
from massspring.body.opening import opened, parents
from massspring.body.volumes import tetrahedron_volumes
from massspring.kernels.forces.springs import spring_forces_into
from massspring.kernels.forces.volume import enclosed_volume
from massspring.run.stages import stages_of
from tests.massspring.conftest import block, boundary
from tests.massspring.cuts import body_of_cells, layer_faces
from tests.massspring.quadratic import second_order
from tests.massspring.run.test_events import KINDS, Cut, volumes_before

EXACT = ImplicitVolume(tolerance=1e-12, most_iterations=1000)
ROWS = 20
STRETCH = 1.1


def body_alone(kind: str, points: np.ndarray, cells: np.ndarray) -> Body:
    """The body that `kind` makes of cells in one piece."""
    body = body_of_cells(points, cells, "cotangent" if kind == "cotangent" else "van_gelder")
    return body.keeping(Volumes.nodal(body)) if kind == "van_gelder nodal" else body


class Late(Cut):
    """The block of test_events, its ends moved once it is in two parts."""

    def held(self, body: Body) -> tuple[Attachment, ...]:
        x, times = body.rest[:, 0], (0.0, 0.04, 0.1)
        ends = ((x < 0.006, (-0.004, 0.003, 0.0)), (x > 0.074, (0.01, 0.0, 0.002)))
        return tuple(
            Attachment(np.flatnonzero(end), Trajectory(times, ((0.0,) * 3, (0.0,) * 3, there))) for end, there in ends
        )


@pytest.mark.parametrize("kind", KINDS)
def test_halves_that_move_apart_are_bodies_of_the_halves_alone(kind):
    cut = Late(kind, np.inf, at=1)
    history = simulate(replace(cut.setup, method=EXACT))
    right = cut.points[cut.cells].mean(axis=1)[:, 0] > 0.04
    for side, chosen in enumerate((~right, right)):
        used, cells = np.unique(cut.opened[chosen], return_inverse=True)
        half = body_alone(kind, cut.after.rest[used], cells.reshape(-1, cut.cells.shape[1]))
        held = (cut.held(half)[side],)
        alone = simulate(Setup(half, EXACT, cut.clock, attachments=held, damping=5.0))
        assert np.abs(alone.final - half.rest).max() > 3e-3
        np.testing.assert_allclose(history.final[used], alone.final, atol=1e-9 * cut.after.size)


@pytest.mark.parametrize("kind", KINDS)
def test_at_the_event_the_parts_hold_what_the_whole_held(kind):
    """Surfaces of both parts, each by itself, against the one surface before, in the places of that moment."""
    cut = Cut(kind, np.inf)
    first, second = stages_of(cut.setup)
    state = first.start
    for frame in range(second.frame):
        state = cut.setup.method.advance(state, first.boundary(frame))
    assert np.abs(state.x - cut.before.rest).max() > 1e-3
    tetrahedra = cut.after.tetrahedra.astype(np.int64)
    right = cut.after.rest[tetrahedra].mean(axis=1)[:, 0] > 0.04
    for before, after in ((cut.before.rest, cut.after.rest), (state.x, second.entered(state).start.x)):
        parts = [enclosed_volume(after, boundary(tetrahedra[side]).astype(np.uint32)) for side in (~right, right)]
        assert sum(parts) == pytest.approx(enclosed_volume(before, cut.before.triangles), rel=1e-13, abs=0)
        assert tetrahedron_volumes(after, cut.after.tetrahedra)[right].sum() == pytest.approx(
            parts[1], rel=1e-12, abs=0
        )


def slit(kind: str, cells_count: tuple[int, int, int], heights: list[int], flat: bool = False):
    """Points and cells of a block, and of each height the cells of the block cut up to there, with their bodies and
    events one frame after the other; a `flat` cut has no node off its plane."""
    points, _, tetrahedra = block(cells_count)
    middle = cells_count[0] // 2
    if flat:
        at = np.unravel_index(np.arange(len(points)), np.add(cells_count, 1))[0]
        points[at == middle, 0] = 0.02 * middle
    cells = tetrahedra
    if kind == "quadratic":
        points, cells = second_order(points, tetrahedra)
    before = body_alone(kind, points, cells)
    chain = [(cells, before)]
    for height in heights:
        opening = opened(cells, layer_faces(tetrahedra, cells_count, middle, height), len(points))
        chain.append((opening.cells, body_alone(kind, points[opening.parent], opening.cells)))
    return points, chain


def vector(values: np.ndarray) -> tuple[float, float, float]:
    x, y, z = (float(value) for value in values)
    return x, y, z


def events_of(chain: list, held) -> tuple[Event, ...]:
    return tuple(
        Event(after, parents(was, now), volumes_before(before, was, after, now), frame, held(after))
        for frame, ((was, before), (now, after)) in enumerate(itertools.pairwise(chain), start=1)
    )


STRAIN = np.diag([1.0, STRETCH, 1.0 / STRETCH]) - np.eye(3)
"""Along a slit whose normal is x: stress is the same everywhere, and with the pressure at rest none acts on it."""


@pytest.mark.parametrize("kind", ["cotangent", "quadratic"])
def test_plane_strain_along_a_slit_is_in_balance(kind):
    """At every node but those of the outside, so at both copies of those of the slit."""
    _, chain = slit(kind, (4, 4, 4), [3], flat=True)
    (_, before), (_, after) = chain
    x, pull = after.rest + after.rest @ STRAIN, np.empty_like(after.rest)
    spring_forces_into(x, after.springs.ends, after.springs.rest_length, after.springs.stiffness, pull)
    left = pull + (after.kept.jacobian(x).T @ after.rest_lam).reshape(-1, 3)
    outer = before.rest[np.unique(before.triangles)]
    inside = ~(after.rest[:, None] == outer).all(axis=2).any(axis=1)
    assert inside[before.node_count :].sum() >= 6  # copies
    assert np.abs(left[inside]).max() < 1e-12 * np.abs(pull).max()
    assert np.abs(left[~inside]).max() > 1e-2 * np.abs(pull).max()  # what holds the outside


def test_plane_strain_along_a_slit_keeps_it_shut():
    """Quadratic elements, which their volumes do not lock where all of the outside is held."""
    points, chain = slit("quadratic", (2, 3, 3), [2], flat=True)
    (_, before), (_, after) = chain

    def held(body: Body) -> tuple[Attachment, ...]:
        """Each node of the outside, with its copy if it has one."""
        return tuple(
            Attachment(np.flatnonzero((body.rest == place).all(axis=1)), Trajectory((0.0,), (vector(STRAIN @ place),)))
            for place in before.rest[np.unique(before.triangles)]
        )

    limit = step_limit(after)
    clock = make_clock(0.2, 12, 0.5 * limit.damped, limit)
    strained = before.rest + before.rest @ STRAIN
    setup = Setup(before, EXACT, clock, attachments=held(before), positions=strained)
    history = simulate(replace(setup, events=events_of(chain, held)))
    assert history.outcome == "finished", history.message
    free = np.setdiff1d(np.arange(len(points), after.node_count), np.concatenate([a.nodes for a in held(after)]))
    assert len(free) >= 2  # copies inside
    np.testing.assert_allclose(history.final - after.rest, after.rest @ STRAIN, atol=1e-9 * after.size)


@pytest.mark.parametrize("kind", ["one", "cotangent", "quadratic"])
def test_twenty_events_end_where_one_does(kind):
    """A cut that goes on row by row, and all of it at once."""

    def held(body: Body) -> tuple[Attachment, ...]:
        x, path = body.rest[:, 0], Trajectory((0.0, 0.06), ((0.0, 0.0, 0.0), (0.001, 0.0, 0.0)))
        return Attachment(np.flatnonzero(x < 0.006)), Attachment(np.flatnonzero(x > 0.034), path)

    ends = []
    for heights in ([ROWS], list(range(1, ROWS + 1))):
        _, chain = slit(kind, (2, 1, ROWS + 1), heights)
        before, after = chain[0][1], chain[-1][1]
        limit = step_limit(after)
        clock = make_clock(3.0, 40, 0.5 * limit.damped, limit)
        setup = Setup(before, EXACT, clock, attachments=held(before), damping=60.0)
        history = simulate(replace(setup, events=events_of(chain, held)))
        assert history.outcome == "finished" and history.min_j.min() > 0.2, history.message
        ends.append(history.final)
    np.testing.assert_allclose(ends[0], ends[1], atol=1e-6 * after.size)
    parted = ends[0][np.arange(len(ends[0])) >= before.node_count]
    assert len(parted) >= 2 * ROWS
