"""Faces of a cut that touch: what presses shut is as if it had not been cut, nothing is lost, nothing overlaps."""

from dataclasses import replace

import numpy as np
import pytest

from massspring import (
    Attachment,
    Body,
    ImplicitVolume,
    MassSpringError,
    Plane,
    Setup,
    Trajectory,
    Volumes,
    make_clock,
    simulate,
    step_limit,
)
from massspring.body.opening import opened
from massspring.kernels.contact.face_pairs import measure_pairs, normals_into, turn_faces
from massspring.layout.face_pairs import face_pairs
from massspring.methods.method import begin_frame
from tests.massspring.conftest import boundary
from tests.massspring.cuts import body_of_cells, mirrored_block
from tests.massspring.quadratic import second_order

KINDS = ("one", "van_gelder nodal", "cotangent", "quadratic")
MIDDLE, PRESS = 0.04, 0.004  # m


class Halves:
    """A block in two halves that are held at both ends along x and move towards each other, and the same uncut."""

    def __init__(self, kind: str, height: float = np.inf):
        points, cells, faces = mirrored_block()
        faces = faces[points[faces][:, :, 2].max(axis=1) < height]
        if kind == "quadratic":
            points, cells = second_order(points, cells)
        opening = opened(cells, faces, len(points))
        self.kind, self.parent, self.pairs = kind, opening.parent, opening.pairs
        self.whole = self.body(points, cells)
        self.cut = self.body(points[opening.parent], opening.cells)
        if kind == "one" and height == np.inf:
            self.cut = in_pieces(self.cut)
        limit = step_limit(self.cut)
        self.clock = make_clock(1.0, 40, 0.7 * limit.damped, limit)

    def body(self, points: np.ndarray, cells: np.ndarray) -> Body:
        body = body_of_cells(points, cells, "cotangent" if self.kind == "cotangent" else "van_gelder")
        return body.keeping(Volumes.nodal(body)) if self.kind == "van_gelder nodal" else body

    def setup(self, body: Body, touching: bool = False, way: float = PRESS, **options) -> Setup:
        held = tuple(
            Attachment(
                np.flatnonzero(side * (body.rest[:, 0] - MIDDLE) > 0.034),
                Trajectory((0.0, 0.5), ((0.0, 0.0, 0.0), (-side * way, 0.0, 0.0))),
            )
            for side in (-1, 1)
        )
        options = {"attachments": held, "damping": 20.0, "pairs": self.pairs if touching else None, **options}
        return Setup(body, ImplicitVolume(tolerance=1e-9), options.pop("clock", self.clock), **options)

    def gaps(self, x: np.ndarray) -> np.ndarray:
        return (x[self.pairs[:, 1]] - x[self.pairs[:, 0]])[:, 0]


def in_pieces(body: Body) -> Body:
    cells = body.tetrahedra.astype(int)
    front = body.rest[cells].mean(axis=1)[:, 0] > MIDDLE
    return body.keeping(
        Volumes.closed_surfaces(body, {name: boundary(cells[front == k]) for k, name in enumerate("ab")})
    )


@pytest.mark.parametrize(
    ("kind", "height", "most"),
    [
        ("one", np.inf, 1e-9),
        ("one", 0.045, 1e-9),
        ("quadratic", np.inf, 1e-6),
        ("quadratic", 0.045, 1e-6),
        ("cotangent", 0.045, 1e-6),
        # Uncut, the rim is in tension here; a cut opens there, as it must.
        ("cotangent", np.inf, 1e-2),
        ("van_gelder nodal", np.inf, 2e-2),
    ],
)
def test_a_cut_in_a_plane_of_symmetry_pressed_shut_is_as_if_it_were_not(kind, height, most):
    halves = Halves(kind, height)
    whole = simulate(halves.setup(halves.whole))
    cut = simulate(halves.setup(halves.cut, touching=True))
    assert cut.outcome == "finished"
    force = np.abs(whole.held_force[:, 1, 0])
    assert force[-1] > 2.0
    # Waves on the way there may open the rim for a moment.
    np.testing.assert_allclose(np.abs(cut.held_force[-10:, 1, 0]), force[-10:], atol=most * force[-1])
    moved, truth = cut.final - halves.cut.rest, (whole.final - halves.whole.rest)[halves.parent]
    assert np.linalg.norm(moved - truth, axis=1).mean() < most * np.linalg.norm(truth, axis=1).max()
    assert halves.gaps(cut.final).min() > -1e-12


def steps(setup: Setup):
    """Step by step: frame, state before, state after, its pairs and the boundary with the row of that step."""
    state = setup.start()
    for frame in range(setup.clock.frames):
        boundary = setup.boundary(frame)
        for step in range(len(boundary.position)):
            row = {
                name: getattr(boundary, name)[step : step + 1]
                for name in ("position", "velocity", "held_displacement", "volume_target")
            }
            before = begin_frame(state, boundary)
            state = setup.method.advance(state, boundary._replace(**row))
            assert state.pairs is not None
            yield frame, before, state, state.pairs, boundary._replace(**row)


def begun_apart(halves: Halves, setup: Setup, gap: float = 2e-4, way: float = -PRESS) -> Setup:
    """The same from faces that are `gap` [m] apart; each end moves outwards by `way` [m]."""
    rest = setup.body.rest
    side = np.where(rest[:, 0] > MIDDLE, 1.0, -1.0)
    side[halves.pairs] = [-1.0, 1.0]
    held = [
        replace(a, path=Trajectory((0.0, 0.5), ((s * gap / 2, 0, 0), (s * (gap / 2 + way), 0, 0))))
        for a, s in zip(setup.attachments, (-1, 1), strict=True)
    ]
    return replace(setup, attachments=tuple(held), positions=rest + gap / 2 * side[:, None] * [1.0, 0.0, 0.0])


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize(("plane", "entering"), [(False, False), (True, False), (False, True)])
def test_a_step_solves_volumes_pairs_and_obstacles_together(kind, plane, entering):
    """All conditions of eq. 9.9 and 9.10 hold at its end at once, to round-off and the tolerance of volumes."""
    halves = Halves(kind)
    # Tilted against the cut, so that what it takes from a node it takes from a pair too.
    down = np.array([0.1, 0.0, -1.0]) / np.hypot(0.1, 1.0)
    first = tuple(halves.cut.rest[np.argmin(halves.cut.rest @ down)])
    sinks = Trajectory((0.0, 0.5), ((0, 0, 0), tuple(0.03 * down)))
    setup = halves.setup(halves.cut, True, obstacles=(Plane(first, tuple(down), sinks),) if plane else ())
    if entering:
        setup = begun_apart(halves, setup)
    before, after, pairs, boundary = next(
        (before, after, pairs, boundary)
        for frame, before, after, pairs, boundary in steps(setup)
        if (((pairs.touches > 0) & (pairs.gap > 1e-9)).any() if entering else frame > 4)
    )
    i, j = pairs.node.T.astype(int)
    along = np.einsum("pi,pi->p", pairs.normal, after.nodes.x[j] - after.nodes.x[i])
    touching = pairs.touches > 0
    assert touching.sum() > (0 if entering else 5)
    assert np.abs(along[touching]).max() < 1e-15
    # The first meeting may ask for more passes of the active set than a step has.
    assert entering or (pairs.impulse[touching] > -1e-12 * pairs.impulse.max()).all() or kind == "quadratic"
    # The plane squeezes quadratic faces past each other; pairs that slipped beyond their reach are none.
    able = ~touching & np.isfinite(pairs.gap)
    assert entering or (along[able] > -1e-12).all(), along[able].min()
    assert (pairs.impulse[~touching] == 0.0).all()
    target = setup.body.kept.jacobian(before.x) @ (after.x - before.x).ravel()
    missing = boundary.volume_target[0] - setup.body.kept.measure(before.x)
    np.testing.assert_allclose(target, missing, atol=3e-9 * setup.body.rest_volumes.max())
    if plane and kind != "quadratic":
        both = after.contacts.mode[pairs.node[touching]] > 0
        assert both.any()
        on = np.flatnonzero(after.contacts.mode)
        assert np.ptp(after.nodes.x[on] @ down) < 1e-15


def test_the_mean_normal_is_the_slope_of_the_gap_where_faces_touch():
    """Finite differences of n(x)·(x_front − x_behind), the normal moving with the nodes (eq. 9.8)."""
    halves = Halves("cotangent")
    pairs = face_pairs(halves.cut, halves.pairs)
    random = np.random.default_rng(3)
    x = halves.cut.rest + 2e-3 * random.normal(size=(halves.whole.node_count, 3))[halves.parent]
    i, j = halves.pairs.T

    def gap(x: np.ndarray) -> np.ndarray:
        normals_into(pairs, x)
        return np.einsum("pi,pi->p", pairs.normal, x[j] - x[i])

    way = random.normal(size=x.shape)
    slope = (gap(x + 1e-7 * way) - gap(x - 1e-7 * way)) / 2e-7
    normals_into(pairs, x)
    np.testing.assert_allclose(slope, np.einsum("pi,pi->p", pairs.normal, way[j] - way[i]), rtol=1e-6, atol=1e-7)
    np.testing.assert_allclose(np.linalg.norm(pairs.normal, axis=1), 1.0)
    # Both sides count alike: seen from the other side it is the same direction.
    shifted = x.copy()
    shifted[j] += 1e-3 * random.normal(size=(len(j), 3))
    normals_into(pairs, shifted)
    ahead = pairs.normal.copy()
    turned = pairs._replace(corner=np.ascontiguousarray(pairs.corner[:, [3, 4, 5, 0, 1, 2]]))
    normals_into(turned, shifted)
    np.testing.assert_allclose(ahead, turned.normal, atol=1e-12)


@pytest.mark.parametrize("kind", ["cotangent", "quadratic"])
def test_impulses_of_pairs_that_slipped_act_along_the_slope_of_their_gaps(kind):
    """Finite differences of Σ k n(x)·(x_front − x_behind) with slip (eq. 9.11); neither force nor moment is left."""
    halves = Halves(kind)
    pairs = face_pairs(halves.cut, halves.pairs)
    i, j = halves.pairs.T
    random = np.random.default_rng(5)
    x = halves.cut.rest + 1e-3 * random.normal(size=halves.cut.rest.shape)
    x[j] += [0.0, 2e-3, -1e-3]
    pairs = pairs._replace(reach=np.full(len(i), 1.0), impulse=random.uniform(0.5, 1.0, len(i)))

    def pushed(x: np.ndarray) -> float:
        normals_into(pairs, x)
        return pairs.impulse @ np.einsum("pi,pi->p", pairs.normal, x[j] - x[i])

    way = random.normal(size=x.shape)
    slope = (pushed(x + 1e-7 * way) - pushed(x - 1e-7 * way)) / 2e-7
    velocity, mass, gradient = np.zeros_like(x), random.uniform(0.5, 2.0, len(x)), random.normal(size=x.shape)
    measure_pairs(pairs, x, np.ones(len(x)))
    flow = turn_faces(pairs, x, 1.0 / mass, velocity, gradient)
    assert flow == pytest.approx((gradient * velocity).sum(), rel=1e-12)
    assert turn_faces(pairs, x, 1.0 / mass, np.zeros_like(x), None) == 0.0
    force = mass[:, None] * velocity
    assert np.abs(force).max() > 0.01
    np.add.at(force, j, pairs.impulse[:, None] * pairs.normal)
    np.add.at(force, i, -pairs.impulse[:, None] * pairs.normal)
    assert slope == pytest.approx((force * way).sum(), rel=1e-6)
    assert np.abs(force.sum(axis=0)).max() < 1e-12 * np.abs(force).sum()
    assert np.abs(np.cross(x, force).sum(axis=0)).max() < 1e-12 * np.abs(force).sum() * np.abs(x).max()


def test_a_warning_names_faces_that_slide_by_more_than_an_edge():
    halves = Halves("one")
    setup = halves.setup(halves.cut, True)
    away = Trajectory((0.0, 0.2, 0.8), ((0, 0, 0), (-0.002, 0, 0), (-0.002, 0.03, 0)))
    slides = replace(setup, attachments=(setup.attachments[0], replace(setup.attachments[1], path=away)))
    with pytest.warns(UserWarning, match="slid over each other by more than an edge"):
        simulate(slides)


def test_pairs_that_cannot_be_are_refused():
    halves = Halves("one")
    body, pairs = halves.cut, halves.pairs
    setup = halves.setup(body, True)
    with pytest.raises(MassSpringError, match="2 nodes on a cut are attached and their copies are not"):
        replace(setup, attachments=(Attachment(pairs[:2, 0]),))
    with pytest.raises(MassSpringError, match="in float64 and without"):
        replace(setup, precision="float32")
    for wrong, sentence in (
        (pairs[:, [0, 0]], "name a node twice"),
        (pairs + len(body.rest), "beyond the 96 of the body"),
        (pairs[::-1] * [1, 0] + pairs * [0, 1], "lie apart at rest"),
    ):
        with pytest.raises(MassSpringError, match=sentence):
            replace(setup, pairs=wrong).start()
