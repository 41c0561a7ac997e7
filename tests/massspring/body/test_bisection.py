"""The paper's surface body cut in pieces during a run: what is kept, what is lost, and where the pieces go."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.sparse import csr_array

from massspring import (
    Attachment,
    Body,
    Event,
    ImplicitVolume,
    MassSpringError,
    Setup,
    Trajectory,
    make_clock,
    simulate,
    step_limit,
    surface_body,
    tetrahedral_body,
)
from massspring.body.bisection import affine, cut_surface, harmonic
from massspring.body.opening import Opening, opened
from massspring.kernels.forces.springs import spring_forces_into
from massspring.kernels.forces.volume import enclosed_volume
from massspring.layout.sell_chunks import slices_of
from massspring.run.events import kept_momentum
from massspring.run.history import Numbers
from massspring.run.stages import stages_of
from tests.massspring.conftest import SOFT, block, boundary
from tests.massspring.cuts import layer_faces

ACROSS, ALONG = ((6, 3, 3), 3), ((3, 3, 6), 1)
"""Cells of a block, its axis along the longest side, and the layer along x after which it is cut: across the axis, or
next to it, so that one piece has no node on it."""


def surface_of(points: np.ndarray, tetrahedra: np.ndarray) -> Body:
    """The paper's body on the boundary of tetrahedra."""
    outer, triangles = np.unique(boundary(tetrahedra), return_inverse=True)
    return surface_body(points[outer], triangles.reshape(-1, 3), SOFT)


def surfaces_after(points: np.ndarray, tetrahedra: np.ndarray, opening: Opening) -> tuple[np.ndarray, ...]:
    """Nodes, triangles and parents of the boundary after an opening, as `cut_surface` takes them, and what the nodes
    are called in the opened mesh."""
    outer = np.unique(boundary(tetrahedra))
    number = np.full(len(points), -1)
    number[np.concatenate([outer, np.setdiff1d(np.arange(len(points)), outer)])] = np.arange(len(points))
    used, after = np.unique(boundary(opening.cells.astype(np.int64)), return_inverse=True)
    parent = opening.parent[used]
    return points[parent], after.reshape(-1, 3), number[parent], used


class Cut:
    """A block's surface that is held at one end along x, pulled at the other and cut in two on the way."""

    def __init__(self, shape=ACROSS, at: int = 6, frames: int = 12, free: bool = False, **options):
        cells, layer = shape
        points, _, tetrahedra = block(cells)
        on = np.unravel_index(np.arange(len(points)), np.add(cells, 1))[0] == layer
        self.level = 0.02 * layer
        points[on, 0] = self.level
        opening = opened(tetrahedra, layer_faces(tetrahedra, cells, layer), len(points))
        self.before = surface_of(points, tetrahedra)
        self.points, self.triangles, self.parent, used = surfaces_after(points, tetrahedra, opening)
        self.pieces = cut_surface(self.before, self.points, self.triangles, self.parent)
        self.pairs = np.searchsorted(used, opening.pairs[np.isin(opening.pairs, used).all(axis=1)])
        self.after, self.growth, self.free, self.end = self.pieces.body, self.pieces.growth, free, 0.02 * cells[0]
        limit = step_limit(self.after)
        self.clock = make_clock(options.pop("duration", 0.24), frames, 0.5 * limit.damped, limit)
        event = Event(
            self.after, self.pieces.parent, np.zeros(2, dtype=int), at, self.held(self.after), growth=self.growth
        )
        self.setup = Setup(
            self.before,
            ImplicitVolume(),
            self.clock,
            attachments=self.held(self.before),
            events=(event,),
            **{"damping": 5.0, **options},
        )

    def held(self, body: Body) -> tuple[Attachment, ...]:
        x = body.rest[body.surface_nodes, 0]
        still = Attachment(np.flatnonzero(x < 0.006))
        path = Trajectory((0.0, 0.06), ((0.0, 0.0, 0.0), (0.006, 0.002, 0.0)))
        return (still,) if self.free else (still, Attachment(np.flatnonzero(x > self.end - 0.006), path))

    def at_the_event(self):
        """The states just before and just after it, and the stage that begins."""
        first, second = stages_of(self.setup)
        state = first.start
        for frame in range(second.frame):
            state = self.setup.method.advance(state, first.boundary(frame))
        stage = second.entered(state)
        return state, stage.start, stage


def energy(body: Body, rest_length: np.ndarray, x: np.ndarray, of=slice(None)) -> float:
    ends = body.springs.ends.astype(int)
    stretch = np.linalg.norm(x[ends[:, 0]] - x[ends[:, 1]], axis=1) - rest_length
    return float((0.5 * body.springs.stiffness * stretch**2)[of].sum())


@pytest.fixture(params=[ACROSS, ALONG], ids=["across", "along"])
def cut(request) -> Cut:
    return Cut(request.param)


def test_the_pieces_are_closed_and_their_volumes_add_up(cut):
    state, after, _ = cut.at_the_event()
    assert np.abs(state.x - cut.before.rest).max() > 3e-3
    for was, now in ((cut.before.rest, cut.after.rest), (state.x, after.x)):
        volumes = cut.after.kept.measure(now)
        assert len(volumes) == 2 and volumes.min() > 0.2 * volumes.max()
        assert volumes.sum() == pytest.approx(enclosed_volume(was, cut.before.triangles), rel=1e-13, abs=0)
    behind = cut.after.rest[cut.growth.piece == cut.growth.piece[0], 0]
    assert behind.max() == cut.level
    assert cut.after.kept.measure(cut.after.rest)[cut.growth.piece[0]] == pytest.approx(
        cut.level * np.prod(np.ptp(cut.before.rest, axis=0)[1:]), rel=0.3
    )


def test_mass_momentum_and_angular_momentum_are_kept(cut):
    state, after, _ = cut.at_the_event()
    assert np.linalg.norm(cut.before.mass @ state.v) > 1e-3
    assert cut.after.mass.min() > 0.0
    for one, other in (
        (cut.before.mass.sum(), cut.after.mass.sum()),
        (cut.before.mass @ state.v, cut.after.mass @ after.v),
        (cut.before.mass @ np.cross(state.x, state.v), cut.after.mass @ np.cross(after.x, after.v)),
    ):
        np.testing.assert_allclose(other, one, rtol=1e-12, atol=1e-12 * np.abs(one).max())


def test_each_piece_keeps_its_own_momentum(cut):
    """Behind the cut all moves one way, in front of it the other: nodes in the section alone belong to both."""
    v = np.where(cut.after.rest[:, :1] < cut.level, [[0.0, 0.3, 0.0]], [[0.0, 0.0, -0.2]])
    v += np.cross([5.0, -3.0, 2.0], cut.after.rest)
    velocity = kept_momentum(v, cut.after.rest, cut.after.mass, cut.growth)
    for k in range(2):
        of = cut.growth.piece == k
        before, after = cut.growth.mass[of], cut.after.mass[of]
        assert before.sum() == pytest.approx(after.sum(), rel=1e-12)
        np.testing.assert_allclose(after @ velocity[of], before @ v[of], rtol=1e-12, atol=1e-15)
        turn = [m @ np.cross(cut.after.rest[of], w[of]) for m, w in ((after, velocity), (before, v))]
        np.testing.assert_allclose(*turn, rtol=1e-12, atol=1e-15)
    assert np.abs(velocity - v).max() > 1e-3  # mass has moved to the section


def test_the_elastic_energy_falls_by_that_of_the_springs_across(cut):
    state, after, _ = cut.at_the_event()
    springs = cut.before.springs
    side = np.sign(cut.before.rest[springs.ends.astype(int), 0] - cut.level)
    across = side[:, 0] * side[:, 1] < 0
    assert across.sum() > 10
    before = energy(cut.before, springs.rest_length, state.x)
    lost = energy(cut.before, springs.rest_length, state.x, across)
    now = energy(cut.after, after.model.rest_length, after.x)
    assert 0.02 * before < lost < 0.9 * before
    assert now == pytest.approx(before - lost, rel=1e-12)


def test_new_springs_begin_without_force_and_end_with_their_rest_lengths(cut):
    _, after, stage = cut.at_the_event()
    new, rest = cut.growth.springs, cut.after.springs.rest_length
    ends = cut.after.springs.ends[new].astype(int)
    length = np.linalg.norm(after.x[ends[:, 0]] - after.x[ends[:, 1]], axis=1)
    np.testing.assert_allclose(after.model.rest_length[new], length, rtol=1e-14)
    assert np.abs(length / rest[new] - 1).max() > 1e-3
    born = np.flatnonzero(cut.growth.mass == 0.0)
    force = np.zeros_like(after.x)
    spring_forces_into(after.x, cut.after.springs.ends, after.model.rest_length, cut.after.springs.stiffness, force)
    assert len(born) and np.abs(force[born]).max() < 1e-12 * np.abs(force).max()
    # Every frame the lanes of the kernel hold what the springs have, from the event to the end of the way.
    state, frames = after, stage.frame + int(stage.letting_in.time / cut.clock.frame) + 3
    for frame in range(stage.frame, frames):
        state = stage.let_in(state, frame)
        springs = replace(stage.setup.inside.body.springs, rest_length=state.model.rest_length)
        slices = slices_of(springs, state.model.triangles, state.model.inverse_mass, stage.setup.inside.body.rest)
        np.testing.assert_array_equal(state.model.slices.rest_length, slices.rest_length)
    assert frames > stage.frame + 3
    np.testing.assert_array_equal(state.model.rest_length, rest)


def test_before_the_cut_new_nodes_are_carried_and_copies_lie_on_each_other(cut):
    history = simulate(cut.setup, snapshots=(5, 12))
    assert history.outcome == "finished"
    before, after = history.snapshots
    np.testing.assert_array_equal(*before[cut.pairs.T])
    assert np.linalg.norm(np.subtract(*after[cut.pairs.T]), axis=1).min() > 1e-4
    # What is on the section moves as its outline: between the least and the most of it.
    on = (cut.after.rest[:, 0] == cut.level) & (cut.growth.mass > 0)
    born = np.intersect1d(cut.pairs, np.flatnonzero(cut.growth.mass == 0))
    moved = before - cut.after.rest
    assert len(born) and (moved[born] > moved[on].min(axis=0)).all() and (moved[born] < moved[on].max(axis=0)).all()
    np.testing.assert_allclose(history.volume.sum(axis=1), cut.before.volume, rtol=1e-3)


def test_pieces_go_back_to_their_shape_and_volume(cut):
    calm = Cut(ACROSS if cut.end > 0.1 else ALONG, frames=60, at=20, duration=3.0, damping=60.0)
    history = simulate(calm.setup)
    assert history.outcome == "finished" and history.kinetic[-1] < 1e-12
    assert history.elastic[-1] < 1e-6 * history.elastic.max()
    np.testing.assert_allclose(history.volume[-1], calm.after.rest_volumes, rtol=1e-9)
    moved = history.final - calm.after.rest
    of = calm.growth.piece == calm.growth.piece[0]
    np.testing.assert_allclose(moved[of], 0.0, atol=1e-6)
    np.testing.assert_allclose(moved[~of], np.tile([0.006, 0.002, 0.0], ((~of).sum(), 1)), atol=1e-6)


def test_weights_meet_every_place():
    """A section with two holes' worth of freedom: random places in a plane, and others next to a surface."""
    points, _, tetrahedra = block(ACROSS[0])
    faces = layer_faces(tetrahedra, ACROSS[0], ACROSS[1])
    sides, count = np.unique(
        np.sort(faces[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2), axis=1), axis=0, return_counts=True
    )
    rim = np.unique(sides[count == 1])
    order = np.concatenate([rim, np.setdiff1d(np.unique(faces), rim)])
    number = np.full(len(points), -1)
    number[order] = np.arange(len(order))
    flat = points[order]
    flat[:, 0] = 0.06
    inside, outline, weights = harmonic(flat, number[faces], len(rim))
    assert len(inside) == 4 and len(outline) == len(rim) == 12
    np.testing.assert_allclose(weights @ flat[outline], flat[inside], atol=1e-15)
    cloud, places = np.random.default_rng(2).standard_normal((2, 30, 3))
    coefficients = affine(cloud, places)
    np.testing.assert_allclose(coefficients @ cloud, places, atol=1e-12)
    np.testing.assert_allclose(coefficients.sum(axis=1), 1.0, rtol=1e-12)


def test_numbers_over_two_events_are_carried_through_both():
    x = np.random.default_rng(1).standard_normal((5, 3))
    first = Numbers(np.array([0, 1, 2, 3, 4, 4]), np.zeros(1, dtype=int))
    grown = Numbers(np.array([0, 1, 2, 3, 4, 5, 0]), np.zeros(1, dtype=int))
    weights = np.vstack([np.eye(6), [0.5, 0.5, 0, 0, 0, 0]])
    grown = replace(grown, carry=csr_array(weights))
    np.testing.assert_allclose(grown.after(first).carried(x), weights @ x[first.nodes], rtol=1e-15)
    np.testing.assert_allclose(first.after(first).nodes, first.nodes[first.nodes])


def test_what_cannot_be_cut_so_is_refused():
    cut = Cut()
    with pytest.raises(MassSpringError, match="the surfaces are one piece"):
        count = len(cut.before.surface_nodes)
        cut_surface(cut.before, cut.before.rest[:count], cut.before.triangles.astype(np.int64), np.arange(count))
    with pytest.raises(MassSpringError, match="only the paper's surface body is cut so"):
        points, triangles, tetrahedra = block((2, 2, 2))
        cut_surface(tetrahedral_body(points, triangles, tetrahedra, SOFT), cut.points, cut.triangles, cut.parent)
    with pytest.raises(MassSpringError, match="leave out some of the"):
        cut_surface(cut.before, cut.points, cut.triangles, np.where(cut.parent == 0, 1, cut.parent))
    (event,) = cut.setup.events

    def refused(match, body=event.body, **changed):
        with pytest.raises(MassSpringError, match=match):
            replace(cut.setup, events=(replace(event, body=body, growth=replace(cut.growth, **changed)),))

    refused("a new node is not carried to its place", carry=0.9 * cut.growth.carry)
    refused("do not add up to its mass", mass=2.0 * cut.growth.mass)
    refused(
        "a piece gains or loses mass",
        body=replace(event.body, mass=np.where(cut.growth.piece, 1.0, 2.0) * event.body.mass),
    )
    refused("springs that are not new are stiffer", springs=cut.growth.springs[:0])
