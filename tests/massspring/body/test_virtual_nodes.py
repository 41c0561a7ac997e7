"""Cells cut by a sheet that no face follows: what must stay exact, how far a front opens, and what is refused."""

import numpy as np
import pytest
from scipy.sparse import csr_array
from scipy.sparse.csgraph import connected_components
from scipy.spatial import ConvexHull

from massspring import (
    Attachment,
    Body,
    Event,
    ExplicitElements,
    ImplicitVolume,
    MassSpringError,
    Setup,
    Volumes,
    make_clock,
    simulate,
    step_limit,
    tetrahedral_body,
)
from massspring.analysis.stiffness import stiffness_at_rest
from massspring.body.virtual_nodes import VirtualNodes, part_in_front, virtual_nodes
from massspring.body.volumes import tetrahedron_volumes
from massspring.kernels.constraint.jacobian import rows_into
from tests.massspring.conftest import SOFT, block, boundary

NORMAL = np.array([0.2, -0.3, 1.0]) / np.linalg.norm([0.2, -0.3, 1.0])
OFF = 0.0031
"""Of the plane from the middle of the ball [m]."""
KINDS = ("one", "van_gelder", "cotangent")


def plane(points: np.ndarray) -> np.ndarray:
    return (points - points.mean(axis=0)) @ NORMAL - OFF


def cut_by_plane(points: np.ndarray, cells: np.ndarray, reach: float = np.inf) -> VirtualNodes:
    """The cells cut by a plane up to x = `reach` [m]; cells on both sides of that by half of their section."""
    x = points[:, 0] - points[:, 0].mean() - reach
    behind = (x < 0)[cells]
    part = np.where(behind.all(axis=1), 1.0, np.where(behind.any(axis=1), 0.5, 0.0))
    return virtual_nodes(cells, plane(points), x < 0, part)


def body_of(kind: str, points: np.ndarray, triangles: np.ndarray, cells: np.ndarray, share=None) -> Body:
    law = "cotangent" if kind == "cotangent" else "van_gelder"
    body = tetrahedral_body(points, triangles, cells, SOFT, law, share)
    return body if kind == "one" else body.keeping(Volumes.nodal(body))


@pytest.fixture(scope="module", params=["whole", "half"])
def both(request, filled_ball):
    reach = np.inf if request.param == "whole" else 0.004
    rest, triangles, cells = filled_ball.rest, filled_ball.triangles, filled_ball.tetrahedra
    cut = cut_by_plane(rest, cells, reach)

    def bodies(kind: str) -> tuple[Body, Body]:
        return (
            body_of(kind, rest, triangles, cells),
            body_of(kind, rest[cut.parent], triangles, cut.cells, cut.share),
        )

    return cut, bodies


def pieces(cut: VirtualNodes) -> np.ndarray:
    """Of each copy: copies are connected by their nodes."""
    n, cells = len(cut.parent), cut.cells.astype(int)
    ends = np.repeat(cells[:, 0], 4), cells.ravel()
    label = connected_components(csr_array((np.ones(cells.size), ends), shape=(n, n)), directed=False)[1]
    return np.unique(label[cells[:, 0]], return_inverse=True)[1]


def test_a_ball_cut_in_two_parts_into_pieces_of_exactly_what_lies_on_either_side(filled_ball):
    rest, cells = filled_ball.rest, filled_ball.tetrahedra
    cut = cut_by_plane(rest, cells)
    part = pieces(cut)
    assert part.max() == 1
    volumes = cut.share * tetrahedron_volumes(rest[cut.parent], cut.cells)
    level, edges = plane(rest), np.sort(filled_ball.triangles[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2), axis=1)
    a, b = edges[(level[edges] > 0).sum(axis=1) == 1].astype(int).T
    crossing = rest[a] + (level[a] / (level[a] - level[b]))[:, None] * (rest[b] - rest[a])
    for piece in (0, 1):
        side = cut.side[(part == piece) & (cut.side != 0)]
        assert np.ptp(side) == 0
        # The surface is convex, and so is what lies on one side.
        truth = ConvexHull(np.concatenate([rest[np.sign(level) == side[0]], crossing])).volume
        assert volumes[part == piece].sum() == pytest.approx(truth, rel=1e-12)
    assert volumes.sum() == pytest.approx(filled_ball.volume, rel=1e-13, abs=0)


def test_the_share_of_a_cell_is_that_of_points_spread_evenly_in_it():
    rng = np.random.default_rng(3)
    levels = rng.normal(size=(40, 4))
    levels[np.ptp(np.sign(levels), axis=1) == 0, 0] *= -1
    places = rng.dirichlet(np.ones(4), 200_000)
    counted = (levels @ places.T > 0).mean(axis=1)
    np.testing.assert_allclose(part_in_front(levels), counted, atol=5e-3)
    np.testing.assert_allclose(part_in_front(levels) + part_in_front(-levels), 1.0, rtol=1e-15)
    sliver = np.array([[1e-6, -1.0, -2.0, -0.5], [1.0, 1.0, 1.0, -1e-6]])
    np.testing.assert_allclose(part_in_front(sliver), [1e-18, 1.0], rtol=1e-5)


@pytest.mark.parametrize("kind", KINDS)
def test_mass_springs_and_volumes_of_the_copies_add_up_to_what_was(both, kind):
    cut, bodies = both
    before, after = bodies(kind)
    shares = np.bincount(cut.cell, weights=cut.share)
    np.testing.assert_allclose(shares, 1.0, rtol=1e-14)
    merged = np.bincount(cut.parent, weights=after.mass, minlength=before.node_count)
    np.testing.assert_allclose(merged, before.mass, rtol=1e-13)
    x = before.rest + 0.002 * np.random.default_rng(5).standard_normal(before.rest.shape)
    for measured in (energy, lambda body, x: body.kept.measure(x).sum()):
        assert measured(after, x[cut.parent]) == pytest.approx(measured(before, x), rel=1e-12, abs=0)
    assert after.volume == before.volume


def energy(body: Body, x: np.ndarray) -> float:
    ends, springs = body.springs.ends.astype(int), body.springs
    length = np.linalg.norm(x[ends[:, 0]] - x[ends[:, 1]], axis=1)
    return float(0.5 * springs.stiffness @ (length - springs.rest_length) ** 2)


@pytest.mark.parametrize("kind", KINDS)
def test_no_sliver_shortens_the_step(both, kind):
    cut, bodies = both
    assert cut.share.min() < 1e-3
    before, after = (step_limit(body).damped for body in bodies(kind))
    assert 0.95 < after / before < 1 + 1e-6  # Rayleigh: copies may move together


def test_the_step_is_never_shorter_than_that_of_the_cells_alone(both):
    """However small their shares: each cell with nodes of its own has the highest frequency that any joining leaves."""
    _, bodies = both
    before, after = bodies("one")
    cells = before.tetrahedra
    alone = np.arange(cells.size, dtype=np.uint32).reshape(-1, 4)
    apart = tetrahedral_body(before.rest[cells].reshape(-1, 3), boundary(alone), alone, SOFT)
    assert step_limit(after).frequency <= step_limit(apart).frequency * (1 + 1e-4)


@pytest.mark.parametrize("kind", KINDS)
def test_volumes_of_the_kernel_and_their_slopes_are_the_sums_over_cells(both, kind):
    cut, bodies = both
    _, body = bodies(kind)
    rng = np.random.default_rng(11)
    x = body.rest + 0.001 * rng.standard_normal(body.rest.shape)
    state = ImplicitVolume().start(body)
    rows_into(x, state.model.inverse_mass, state.rows)
    each = cut.share * tetrahedron_volumes(x, cut.cells)
    truth = np.array([each.sum()]) if kind == "one" else np.bincount(cut.cells.ravel(), np.repeat(each / 4, 4))
    np.testing.assert_allclose(state.rows.volume, truth, rtol=1e-9)
    np.testing.assert_allclose(body.kept.measure(x), truth, rtol=1e-9)
    way, step = rng.standard_normal(x.shape), 1e-7
    slope = (body.kept.measure(x + step * way) - body.kept.measure(x - step * way)) / (2 * step)
    row = np.repeat(np.arange(body.kept.count), np.diff(state.rows.row_start.astype(int)))
    terms = np.einsum("ei,ei->e", state.rows.value[:, :3], way[state.rows.column])
    np.testing.assert_allclose(
        np.bincount(row, terms, body.kept.count), slope, rtol=1e-6, atol=1e-6 * np.abs(slope).max()
    )


def test_stiffness_at_rest_is_the_slope_of_springs_and_pressures(both):
    _, bodies = both
    _, body = bodies("cotangent")
    way, step = np.random.default_rng(2).standard_normal(body.rest.shape), 1e-6

    def forces(x: np.ndarray) -> np.ndarray:
        ends, pull = body.springs.ends.astype(int), np.zeros_like(x)
        each = body.springs.stiffness[:, None] * (x[ends[:, 1]] - x[ends[:, 0]])
        np.add.at(pull, ends[:, 0], each)
        np.add.at(pull, ends[:, 1], -each)
        return pull.ravel() + body.kept.jacobian(x).T @ body.rest_lam

    assert np.abs(forces(body.rest)).max() < 1e-10 * body.rest_pressure * body.size**2
    slope = (forces(body.rest + step * way) - forces(body.rest - step * way)) / (2 * step)
    np.testing.assert_allclose(
        -stiffness_at_rest(body) @ way.ravel(), slope, rtol=1e-5, atol=1e-6 * np.abs(slope).max()
    )


@pytest.mark.parametrize("kind", KINDS)
def test_the_event_keeps_momentum_and_energy_and_the_volume_follows(both, kind):
    cut, bodies = both
    before, after = bodies(kind)
    limit = step_limit(after)
    clock = make_clock(0.2, 10, 0.5 * limit.damped, limit)
    volumes = np.zeros(1, int) if kind == "one" else cut.parent
    speed = 0.05 * np.random.default_rng(4).standard_normal(before.rest.shape)
    setup = Setup(before, ImplicitVolume(), clock, velocity=speed, events=(Event(after, cut.parent, volumes, 4),))
    history = simulate(setup, snapshots=[9, 10])
    assert history.outcome == "finished"
    (passage,) = history.passages
    assert passage.energy < 1e-10 and passage.momentum < 1e-12
    np.testing.assert_allclose(history.volume.sum(axis=1), before.volume, rtol=1e-4)
    # Nothing outside pushes it: its centre of mass moves with the momentum of the start.
    centre = np.einsum("i,fij->fj", after.mass, history.snapshots) / after.mass.sum()
    drift = before.mass @ speed / before.mass.sum()
    np.testing.assert_allclose(centre[1] - centre[0], drift * clock.frame, rtol=1e-8)


def test_pieces_of_a_bisected_body_fall_apart():
    points, triangles, cells = block((4, 3, 3))
    cut = cut_by_plane(points, cells)
    before = body_of("cotangent", points, triangles, cells)
    after = body_of("cotangent", points[cut.parent], triangles, cut.cells, cut.share)
    part = np.zeros(after.node_count, int)
    part[cut.cells] = pieces(cut)[:, None]
    lower = part[np.argmin(points @ NORMAL)]
    held = np.flatnonzero((part[: len(points)] != lower) & (points[:, 2] > 0.055))
    limit = step_limit(after, held_nodes=held)
    setup = Setup(
        before,
        ImplicitVolume(),
        make_clock(0.15, 10, 0.5 * limit.damped, limit),
        attachments=(Attachment(held),),
        gravity=(0.0, 0.0, -9.81),
        events=(Event(after, cut.parent, cut.parent, 1, (Attachment(held),)),),
    )
    x = simulate(setup, snapshots=[2, 6, 10]).snapshots
    mass = np.where(part == lower, after.mass, 0.0)
    height = x[:, :, 2] @ mass / mass.sum()
    # Free fall has a second difference of g t², less by nothing: nothing holds the lower piece.
    assert height[2] - 2 * height[1] + height[0] == pytest.approx(-9.81 * (4 * setup.clock.frame) ** 2, rel=1e-6)


def test_only_nodes_behind_the_front_are_parted(filled_ball):
    cut = cut_by_plane(filled_ball.rest, filled_ball.tetrahedra, 0.004)
    n = filled_ball.node_count
    x = filled_ball.rest[:, 0] - filled_ball.rest[:, 0].mean()
    assert len(cut.parent) > n and (x[cut.parent[n:]] < 0.004).all()
    assert np.array_equal(cut.parent[:n], np.arange(n))
    assert pieces(cut).max() == 0
    # A joining copy stands on the nodes that were there, and each side on its own.
    joining = (cut.side == 0) & (cut.share < 1)
    assert joining.any() and (cut.cells[joining] < n).all()
    level = plane(filled_ball.rest)[cut.parent]
    for sign in (1, -1):
        own = cut.cells[cut.side == sign]
        assert (own[sign * level[own] > 0] < n).all()


def test_what_cannot_be_cut_is_refused(filled_ball):
    rest, cells = filled_ball.rest, filled_ball.tetrahedra
    everywhere, whole, level = np.ones(len(rest), bool), np.ones(len(cells)), plane(rest)
    with pytest.raises(MassSpringError, match="1 nodes lie on the sheet of a cut"):
        virtual_nodes(cells, np.where(np.arange(len(rest)) == 3, 0.0, level), everywhere, whole)
    with pytest.raises(MassSpringError, match="a cut parts no cell"):
        virtual_nodes(cells, level + 1.0, everywhere, whole)
    cut = virtual_nodes(cells, level, everywhere, whole)
    shared = body_of("cotangent", rest[cut.parent], filled_ball.triangles, cut.cells, cut.share)
    assert "a part alone is tissue" in (ExplicitElements().why_not(shared) or "")
    lloyd = [
        tetrahedral_body(rest, filled_ball.triangles, cells, SOFT, "lloyd"),
        tetrahedral_body(rest[cut.parent], filled_ball.triangles, cut.cells, SOFT, "lloyd", cut.share),
    ]
    limit = step_limit(lloyd[1])
    clock = make_clock(0.02, 2, 0.2 * limit.damped, limit)
    with pytest.raises(MassSpringError, match="springs of law 'lloyd' do not add up"):
        Setup(lloyd[0], ImplicitVolume(), clock, events=(Event(lloyd[1], cut.parent, np.zeros(1, int), 1),))
