"""A body that is cut during a run: what the swap keeps, and where the pieces go."""

from dataclasses import replace

import numpy as np
import pytest

from massspring import (
    METHODS,
    Attachment,
    Body,
    Event,
    ImplicitVolume,
    MassSpringError,
    Setup,
    Trajectory,
    Volumes,
    make_clock,
    simulate,
    step_limit,
)
from massspring.body.opening import opened, parents
from massspring.body.points import PointVolumes
from massspring.run.events import Easing
from massspring.run.history import passage
from massspring.run.stages import stages_of
from tests.massspring.conftest import block, boundary
from tests.massspring.cuts import CELLS, body_of_cells, layer_faces
from tests.massspring.quadratic import second_order

HALF, PULL = 2, 0.004
KINDS = ("one", "van_gelder nodal", "cotangent", "quadratic")


class Cut:
    """A block that is held at both ends along x, pulled, and cut between its middle layers up to height `reach`."""

    def __init__(self, kind: str, reach: float = HALF, at: int = 6, frames: int = 12, free: bool = False, **options):
        points, _, cells = block(CELLS)
        self.faces = layer_faces(cells, CELLS, CELLS[0] // 2, reach)
        if kind == "quadratic":
            points, cells = second_order(points, cells)
        self.points, self.cells, self.kind, self.free = points, cells, kind, free
        self.before = self.body(points, cells)
        self.opened, self.after = self.opened_along(self.faces)
        limit = step_limit(self.after)
        self.clock = make_clock(options.pop("duration", 0.24), frames, 0.5 * limit.damped, limit)
        self.setup = Setup(
            self.before,
            ImplicitVolume(),
            self.clock,
            attachments=self.held(self.before),
            events=(self.event(self.before, self.cells, self.after, self.opened, at),),
            **{"damping": 5.0, **options},
        )

    def body(self, points: np.ndarray, cells: np.ndarray) -> Body:
        body = body_of_cells(points, cells, "cotangent" if self.kind == "cotangent" else "van_gelder")
        if self.kind == "one" and len(points) > len(self.points):
            part = points[cells].mean(axis=1)[:, 0] > 0.04
            return body.keeping(
                Volumes.closed_surfaces(body, {name: boundary(cells[part == k]) for k, name in enumerate("ab")})
            )
        return body.keeping(Volumes.nodal(body)) if self.kind == "van_gelder nodal" else body

    def opened_along(self, faces: np.ndarray) -> tuple[np.ndarray, Body]:
        opening = opened(self.cells, faces, len(self.points))
        if self.kind == "one" and len(faces) < len(layer_faces(self.cells, CELLS, CELLS[0] // 2)):
            return opening.cells, body_of_cells(self.points[opening.parent], opening.cells)
        return opening.cells, self.body(self.points[opening.parent], opening.cells)

    def held(self, body: Body) -> tuple[Attachment, ...]:
        x = body.rest[:, 0]
        still = Attachment(np.flatnonzero(x < 0.006))
        path = Trajectory((0.0, 0.06), ((0.0, 0.0, 0.0), (PULL, 0.0, 0.0)))
        return (still,) if self.free else (still, Attachment(np.flatnonzero(x > 0.074), path))

    def event(self, before: Body, cells: np.ndarray, after: Body, opened_cells: np.ndarray, at: int) -> Event:
        return Event(
            after,
            parents(cells, opened_cells),
            volumes_before(before, cells, after, opened_cells),
            at,
            self.held(after),
        )


def volumes_before(before: Body, cells, after: Body, opened_cells) -> np.ndarray:
    if isinstance(before.kept, PointVolumes) and isinstance(after.kept, PointVolumes):
        return parents(before.kept.corner_volume, after.kept.corner_volume)
    return np.zeros(after.kept.count, dtype=int) if before.kept.count == 1 else parents(cells, opened_cells)


@pytest.mark.parametrize("kind", KINDS)
def test_the_swap_keeps_mass_momentum_and_energy(kind):
    cut = Cut(kind)
    first, second = stages_of(cut.setup)
    state = first.start
    for frame in range(second.frame):
        state = cut.setup.method.advance(state, first.boundary(frame))
    entered = second.entered(state).start
    one, other = (measures(stage.setup.body, x) for stage, x in ((first, state), (second, entered)))
    assert one["kinetic"] > 0 and one["elastic"] > 0
    for name in one:
        np.testing.assert_allclose(other[name], one[name], rtol=1e-12, atol=1e-14)


def measures(body: Body, state) -> dict:
    ends, springs, x, v = body.springs.ends.astype(int), body.springs, state.x, state.v
    length = np.linalg.norm(x[ends[:, 0]] - x[ends[:, 1]], axis=1)
    taut = 0.5 * springs.stiffness @ (length - springs.rest_length) ** 2 - body.rest_energy
    return {
        "mass": body.mass.sum(),
        "momentum": body.mass @ v,
        "turn": (body.mass[:, None] * np.cross(x, v)).sum(axis=0),
        "kinetic": 0.5 * body.mass @ (v**2).sum(axis=1),
        "elastic": taut + body.local_energy(x),
        "volume": body.kept.measure(x).sum(),
    }


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("reach", [HALF, np.inf])
def test_targets_add_up_to_the_rest_volume_and_volumes_follow_them(kind, reach):
    cut = Cut(kind, reach)
    history = simulate(cut.setup)
    assert history.outcome == "finished" and history.min_j.min() > 0.2
    whole = cut.before.rest_volumes.sum()
    np.testing.assert_allclose(history.volume_target[5:].sum(axis=1), whole, rtol=1e-4)
    np.testing.assert_allclose(history.volume_target[6:].sum(axis=1), history.volume_target[6].sum(), rtol=1e-4)
    np.testing.assert_allclose(history.volume.sum(axis=1), whole, rtol=3e-4)
    np.testing.assert_allclose(history.volume_target[-1], cut.after.rest_volumes, rtol=1e-9)
    # Each piece has its own volume in the end.
    np.testing.assert_allclose(history.volume[-1], cut.after.rest_volumes, rtol=3e-3)
    pieces = np.array([history.volume[:, side].sum(axis=1) for side in sides(cut)])
    own = np.array([cut.after.rest_volumes[side].sum() for side in sides(cut)])
    np.testing.assert_allclose(pieces[:, -1], own, rtol=3e-4)


def sides(cut: Cut) -> list[np.ndarray]:
    """Volumes behind and in front of the cut; of a piece that is one, all."""
    if len(cut.after.rest_volumes) == 1:
        return [np.ones(1, dtype=bool)]
    if cut.kind == "one":
        return [np.array([True, False]), np.array([False, True])]
    return [np.ones(len(cut.after.rest_volumes), dtype=bool)]


def test_easing_runs_on_one_clock_to_nothing():
    easing = Easing(2.0, np.array([1e-6, -3e-6, 2e-6]), 0.5)
    left = easing.left(np.array([2.0, 2.25, 2.5, 9.0]))
    np.testing.assert_allclose(left, np.outer([1.0, 0.5, 0.0, 0.0], easing.off), atol=1e-21)
    np.testing.assert_allclose(left.sum(axis=1), 0.0, atol=1e-21)
    assert not Easing(2.0, np.ones(3), 0.0).left(np.array([2.0])).any()


def test_pieces_that_are_led_to_their_volumes_are_not_thrown_apart(monkeypatch):
    """One volume, bisected while pulled hard: each piece is off its volume, and a step that corrects it all pops."""
    energies = []
    for left in (Easing.left, lambda self, t: np.zeros((len(t), len(self.off)))):
        monkeypatch.setattr(Easing, "left", left)
        cut = Cut("van_gelder nodal", np.inf, frames=240, at=120)
        energies.append(simulate(cut.setup).kinetic[120:124].max())
    assert energies[0] < 0.8 * energies[1]


@pytest.mark.parametrize("kind", KINDS)
def test_a_freed_piece_falls_as_a_point_does(kind):
    cut = Cut(kind, np.inf, free=True, damping=0.0, gravity=(0.0, 0.0, -9.81), duration=0.12)
    history = simulate(cut.setup, snapshots=range(1, 13))
    assert history.outcome == "finished"
    piece = np.unique(cut.opened[cut.points[cut.cells].mean(axis=1)[:, 0] > 0.04])
    mass = cut.after.mass[piece]
    centre = mass @ history.snapshots[:, piece].transpose(1, 0, 2).reshape(len(piece), -1) / mass.sum()
    centre = centre.reshape(-1, 3)
    falling = np.diff(centre[5:], n=2, axis=0)
    # Constant acceleration in symplectic Euler: second differences over whole frames are exactly g t².
    np.testing.assert_allclose(falling, np.tile([0, 0, -9.81 * cut.clock.frame**2], (len(falling), 1)), atol=1e-12)


@pytest.mark.parametrize("kind", ["one", "quadratic"])
def test_two_events_end_where_one_does(kind):
    """Springs remember nothing: at rest the order in which faces opened does not matter."""
    ends = []
    for parts in (1, 2):
        cut = Cut(kind, frames=60, at=20, duration=3.0, damping=60.0)
        if parts == 2:
            height = cut.points[cut.faces].mean(axis=1)[:, 2]
            cells, body = cut.opened_along(cut.faces[height < np.median(height)])
            events = (
                cut.event(cut.before, cut.cells, body, cells, 10),
                cut.event(body, cells, cut.after, cut.opened, 20),
            )
            cut.setup = replace(cut.setup, events=events)
        history = simulate(cut.setup)
        assert history.outcome == "finished" and history.kinetic[-1] < 1e-12
        ends.append(history.final)
    np.testing.assert_allclose(ends[0], ends[1], atol=1e-6 * cut.after.size)
    assert np.linalg.norm(ends[0] - cut.after.rest, axis=1).max() > 0.5 * PULL


@pytest.mark.parametrize("kind", KINDS)
def test_a_body_cut_later_comes_to_rest_where_one_cut_before_does(kind):
    cut = Cut(kind, frames=60, at=20, duration=3.0, damping=60.0)
    later = simulate(cut.setup)
    before = simulate(replace(cut.setup, body=cut.after, attachments=cut.held(cut.after), events=()))
    np.testing.assert_allclose(later.final, before.final, atol=1e-6 * cut.after.size)
    np.testing.assert_allclose(later.held_force[-1], before.held_force[-1], atol=1e-5 * np.abs(before.held_force).max())


@pytest.mark.parametrize("method", [m for m in METHODS if m.capabilities.events], ids=lambda m: m.name)
def test_an_event_that_changes_nothing_changes_nothing(method):
    """Bit for bit: a method that remembers more than places, speeds and pressures would differ."""
    points, _, cells = block(CELLS)
    if method.capabilities.point_volumes is True:
        points, cells = second_order(points, cells)
    body = body_of_cells(points, cells, "cotangent" if method.capabilities.keeps == "elements" else "van_gelder")
    if not method.capabilities.facet_contact:
        body = replace(body, contact_facets=body.contact_facets[:0])
    held = (Attachment(np.flatnonzero(points[:, 0] < 0.006)),)
    limit = step_limit(body, added=method().added_stiffness(body))
    setup = Setup(body, method(), make_clock(0.02, 6, 0.4 * limit.damped, limit), (), held, (0.0, 0.0, -9.81))
    same = Event(body, np.arange(body.node_count), np.arange(body.kept.count), 3, held)
    plain, evented = simulate(setup), simulate(replace(setup, events=(same,)))
    assert plain.outcome == "finished"
    np.testing.assert_array_equal(plain.final, evented.final)
    np.testing.assert_array_equal(plain.pressure, evented.pressure)


def refused(setup: Setup, match: str, **changed) -> None:
    with pytest.raises(MassSpringError, match=match):
        replace(setup, **changed)


def test_events_that_cannot_be_are_refused():
    cut = Cut("one")
    event = cut.setup.events[0]
    for frame in (0, 12):
        refused(cut.setup, "give rising numbers from 1 to 11", events=(replace(event, frame=frame),))
    refused(cut.setup, "kept volumes after an event", events=(replace(event, volume_parent=np.zeros(2, dtype=int)),))
    refused(cut.setup, "nodes after an event", events=(replace(event, parent=event.parent[:-1]),))
    moved = replace(event.body, rest=event.body.rest + 1e-4)
    refused(cut.setup, "moves no node", events=(replace(event, body=moved),))
    heavier = replace(event.body, mass=2.0 * event.body.mass)
    refused(cut.setup, "do not add up to its mass", events=(replace(event, body=heavier),))
    refused(cut.setup, "in float64 and without", precision="float32")
    uniform = [body_of_cells(*mesh, "uniform") for mesh in ((cut.points, cut.cells), (event.body.rest, cut.opened))]
    refused(
        cut.setup,
        "springs of law 'uniform' do not add up",
        body=uniform[0],
        events=(replace(event, body=uniform[1]),),
    )


@pytest.mark.parametrize("kind", KINDS)
def test_the_history_says_that_an_event_keeps_energy_and_momentum_and_what_it_cost(kind):
    (passed,) = simulate(Cut(kind).setup).passages
    assert passed.energy < 1e-12 and passed.momentum < 1e-12
    assert 0 < passed.ns < 1e9


def test_an_event_that_pushes_would_be_seen():
    """All nodes at one speed that doubles: four times the energy, twice the momentum."""
    cut = Cut("one")
    start = stages_of(cut.setup)[0].start

    def moving(speed):
        return replace(start, nodes=start.nodes._replace(v=np.tile([0.0, speed, 0.0], (len(start.nodes.v), 1))))

    pushed = passage(moving(0.1), cut.before, moving(0.2), cut.before, 7)
    assert (pushed.energy, pushed.momentum, pushed.ns) == pytest.approx((3.0, 1.0, 7), rel=1e-9)
    lost = replace(start, nodes=start.nodes._replace(x=1.01 * start.nodes.x))
    assert passage(lost, cut.before, start, cut.before, 7).energy == pytest.approx(1.0, rel=1e-9)
