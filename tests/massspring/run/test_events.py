"""A body that is cut during a run: what the swap keeps, where the pieces go; an opened lumen."""

import itertools
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
    Ramp,
    Setup,
    Trajectory,
    Volumes,
    make_clock,
    quadratic_body,
    simulate,
    step_limit,
)
from massspring.body.opening import opened, parents
from massspring.body.partition import tetrahedron_faces
from massspring.body.points import PointVolumes
from massspring.body.quadratic import boundary_facets
from massspring.kernels.forces.springs import spring_forces_into
from massspring.run.events import Easing
from massspring.run.history import passage
from massspring.run.stages import stages_of
from tests.massspring.body.test_opening import euler
from tests.massspring.conftest import SOFT, block, boundary, hollow_block
from tests.massspring.cuts import CELLS, body_of_cells, layer_faces
from tests.massspring.quadratic import second_order

HALF, PULL = 2, 0.004
KINDS = ("one", "van_gelder nodal", "cotangent", "quadratic", "mixed")
"""Of bodies: their volumes, law or elements; "mixed": quadratic elements on one side keep their own volumes."""


class Cut:
    """A block that is held at both ends along x, pulled, and cut between its middle layers up to height `reach`."""

    def __init__(self, kind: str, reach: float = HALF, at: int = 6, frames: int = 12, free: bool = False, **options):
        points, _, cells = block(CELLS)
        self.faces = layer_faces(cells, CELLS, CELLS[0] // 2, reach)
        if kind in ("quadratic", "mixed"):
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
        if self.kind == "mixed":
            return body_alone(self.kind, points, cells)
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
        "elastic": taut + body.measured(x).local_energy,
        "volume": body.kept.measure(x).sum(),
    }


@pytest.mark.parametrize("kind", KINDS)
def test_targets_add_up_to_the_rest_volume_and_volumes_follow_them(kind):
    cut = Cut(kind)
    history = simulate(cut.setup)
    assert history.outcome == "finished" and history.min_j.min() > 0.2
    whole = cut.before.rest_volumes.sum()
    np.testing.assert_allclose(history.volume_target[5:].sum(axis=1), whole, rtol=1e-4)
    np.testing.assert_allclose(history.volume_target[6:].sum(axis=1), history.volume_target[6].sum(), rtol=1e-4)
    np.testing.assert_allclose(history.volume.sum(axis=1), whole, rtol=3e-4)
    np.testing.assert_allclose(history.volume_target[-1], cut.after.rest_volumes, rtol=1e-9)
    np.testing.assert_allclose(history.volume[-1], cut.after.rest_volumes, rtol=3e-3)
    (passed,) = history.passages
    assert passed.energy < 1e-12 and passed.momentum < 1e-12 and 0 < passed.ns < 1e9


def test_easing_runs_on_one_clock_to_nothing():
    easing = Easing(2.0, np.array([1e-6, -3e-6, 2e-6]), 0.5)
    left = easing.left(np.array([2.0, 2.25, 2.5, 9.0]))
    np.testing.assert_allclose(left, np.outer([1.0, 0.5, 0.0, 0.0], easing.off), atol=1e-21)
    np.testing.assert_allclose(left.sum(axis=1), 0.0, atol=1e-21)
    assert not Easing(2.0, np.ones(3), 0.0).left(np.array([2.0])).any()


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


EXACT = ImplicitVolume(tolerance=1e-12, most_iterations=1000)
ROWS = 20
STRETCH = 1.1


def body_alone(kind: str, points: np.ndarray, cells: np.ndarray) -> Body:
    """The body that `kind` makes of cells in one piece."""
    if kind == "mixed":
        return quadratic_body(points, cells, SOFT, own_volumes=points[cells].mean(axis=1)[:, 1] > 0.03)
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
    clock = replace(cut.clock, limit=None)  # the steps of both are then the same under load too
    history = simulate(replace(cut.setup, method=EXACT, clock=clock))
    right = cut.points[cut.cells].mean(axis=1)[:, 0] > 0.04
    for side, chosen in enumerate((~right, right)):
        used, cells = np.unique(cut.opened[chosen], return_inverse=True)
        half = body_alone(kind, cut.after.rest[used], cells.reshape(-1, cut.cells.shape[1]))
        held = (cut.held(half)[side],)
        alone = simulate(Setup(half, EXACT, clock, attachments=held, damping=5.0))
        assert np.abs(alone.final - half.rest).max() > 3e-3
        np.testing.assert_allclose(history.final[used], alone.final, atol=1e-9 * cut.after.size)


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


BOX, EDGE, FILLED = 4, 0.02, 1.15
FILLED_KINDS = ("wall and lumen", "nodal", "quadratic")


class Opened:
    """A box with walls one cell thick, fixed at its bottom and filled, then cut through its lid from edge to edge."""

    def __init__(self, kind: str, at: int = 20, frames: int = 60):
        self.corners, _, cells, self.lumen = hollow_block(BOX, EDGE)
        grid = np.round(self.corners / EDGE)
        faces, _, second = tetrahedron_faces(cells)
        faces = faces.astype(np.int64)
        lid = (grid[faces][:, :, 0] == 2).all(axis=1) & (grid[faces][:, :, 2] >= 3).all(axis=1) & (second >= 0)
        faces = faces[lid]
        a, b, c = grid[faces].transpose(1, 0, 2)
        turned = np.cross(b - a, c - a)[:, 0] < 0
        faces[turned] = faces[turned][:, ::-1]
        self.kind, self.corner_cells = kind, cells
        points = self.corners
        if kind == "quadratic":
            points, cells = second_order(points, cells)
        opening = opened(cells, faces, len(points))
        self.points, self.cells, self.opening = points, cells, opening
        self.before = self.body(points, cells, self.lumen)
        self.after = self.body(points[opening.parent], opening.cells, None)
        limit = step_limit(self.after)
        count = self.after.kept.count
        if kind == "quadratic":
            volumes = parents(self.before.kept.corner_volume, self.after.kept.corner_volume)
        else:
            volumes = opening.parent if kind == "nodal" else np.zeros(count, dtype=int)
        self.event = Event(
            self.after, opening.parent, volumes, at, self.held(self.after), ended=(self.before.kept.count - 1,)
        )
        self.setup = Setup(
            self.before,
            ImplicitVolume(tolerance=1e-9, most_iterations=500),
            make_clock(3.0, frames, 0.5 * limit.damped, limit),
            attachments=self.held(self.before),
            damping=30.0,
            targets={"lumen": Ramp((0.0, 0.5), (1.0, FILLED))},
            events=(self.event,),
        )

    def body(self, points, cells, lumen):
        if self.kind == "quadratic":
            return quadratic_body(points, cells, SOFT, None if lumen is None else self._facets(lumen))
        body = body_of_cells(points, cells)
        surfaces = {} if lumen is None else {"lumen": lumen}
        if self.kind == "nodal":
            nodal = Volumes.nodal(body)
            return body.keeping(nodal.joined(Volumes.closed_surfaces(body, surfaces)) if surfaces else nodal)
        return body.keeping(Volumes.closed_surfaces(body, {"wall": body.triangles, **surfaces}))

    def _facets(self, lumen):
        facets = boundary_facets(self.cells.astype(np.uint32)).astype(np.int64)
        lumen_faces = {tuple(sorted(row)) for row in lumen.tolist()}
        inner = [tuple(sorted(row)) in lumen_faces for row in facets[:, :3].tolist()]
        return facets[inner][:, [0, 2, 1, 5, 4, 3]]

    def held(self, body):
        return (Attachment(np.flatnonzero(body.rest[:, 2] < 0.25 * EDGE)),)


def test_a_cut_through_the_wall_joins_its_two_surfaces():
    cut = Opened("nodal")
    assert euler(boundary(cut.corner_cells)) == 4
    assert euler(boundary(cut.opening.cells.astype(np.int64))) == 2


@pytest.mark.parametrize("kind", FILLED_KINDS)
def test_the_content_goes_and_the_wall_keeps_its_volumes(kind):
    """Filled until the cut; nothing loads the wall then: it goes back to what it was, and its content with it."""
    cut = Opened(kind)
    history = simulate(cut.setup, snapshots=(20,))
    assert history.outcome == "finished", history.message
    assert np.abs(history.snapshots[0] - cut.after.rest).max() > 0.01 * cut.after.size
    np.testing.assert_allclose(history.final, cut.after.rest, atol=1e-4 * cut.after.size)
    wall = history.volume.sum(axis=1)
    np.testing.assert_allclose(wall, cut.after.rest_volumes.sum(), rtol=1e-4)
    np.testing.assert_allclose(history.volume[-1], cut.after.rest_volumes, rtol=1e-4)
    (passed,) = history.passages
    assert passed.energy < 1e-12 and passed.momentum < 1e-12


def test_volumes_that_cannot_end_are_refused():
    cut = Opened("nodal")
    count = cut.before.kept.count
    for ended in ((count,), (count - 1, count - 1)):
        with pytest.raises(MassSpringError, match=f"are not among the {count} before it, or one is given twice"):
            replace(cut.setup, events=(replace(cut.event, ended=ended),))
    with pytest.raises(MassSpringError, match=f"do not name all {count} before it"):
        replace(cut.setup, events=(replace(cut.event, ended=()),))
