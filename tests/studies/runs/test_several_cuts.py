"""Several cuts in a scene: mirrored ones open as mirror images, their order does not matter, and pieces keep their
volumes at every event."""

from dataclasses import replace

import numpy as np
import pytest

from massspring import ImplicitVolume, Trajectory, simulate
from reference_fem import equilibrium_path, nodes
from studies.geometry import HalfSpace, OrganMesh, organ
from studies.geometry.mesh.organ_mesh import boundary_triangles
from studies.meshing.nested_mesh import base_mesh
from studies.meshing.opened_mesh import opened_elements
from studies.metrics.metrics import METRICS
from studies.metrics.run import Run
from studies.reference.load import load_reference
from studies.reference.nested import path_of, problems_of
from studies.reference.problem import problem_on
from studies.reference.reference_solves import ReferenceSolve
from studies.reference.solve import solve
from studies.runs.case import Case
from studies.runs.prepare import prepare, prepared_on
from studies.runs.recipes import QuadraticBody, TetrahedralBody
from studies.runs.run import measure
from studies.scene.cut import Cut, nearest_cut
from studies.scene.library.ball_cuts import AWAY, BALL_BISECTED, BALL_CUT_TWICE, CUT_AT, HALF, MIDDLE, RADIUS, SECOND_AT
from tests.campaigns import campaign

pytestmark = pytest.mark.slow
METRIC = {metric.name: metric for metric in METRICS}
ONE, NODAL = TetrahedralBody(nodes=200), TetrahedralBody(nodes=200, law="cotangent", volumes="nodal")
COARSE = 120
"""Surface nodes where nothing is compared with the reference."""
QUADRATIC = QuadraticBody(nodes=294, mass="stiffness")
UP = (0.0, 0.0, 1.0)
BELOW, ABOVE = BALL_CUT_TWICE.cuts
AT_ONCE = replace(BALL_CUT_TWICE, cuts=(BELOW, replace(ABOVE, at=CUT_AT)), reference=None)


def level(z: float) -> HalfSpace:
    return HalfSpace((0.0, 0.0, z), UP)


@pytest.fixture(scope="module")
def judged(tmp_path_factory) -> dict[str, Run]:
    scene = replace(BALL_CUT_TWICE, reference=BALL_CUT_TWICE.reference.smaller())
    root = tmp_path_factory.mktemp("twice")
    solve(root, ReferenceSolve(scene))
    reference = load_reference(root, scene)
    cases = {body.kind: Case(scene, body, ImplicitVolume(), dt_fraction=0.8) for body in (ONE, QUADRATIC)}
    return {kind: Run(case, measure(case), reference) for kind, case in cases.items()}


@pytest.mark.campaign
def test_both_incisions_gape_as_in_the_reference(judged):
    for kind, most, alike in (("tetrahedral", 20.0, 0.25), ("quadratic", 8.0, 0.08)):
        run = judged[kind]
        assert run.record.status == "ok", run.record.message
        assert METRIC["opening_error"](run) < most
        assert METRIC["mean_error"](run) < most
        assert abs(METRIC["force_end"](run)) < 12.0
        assert METRIC["overlap"](run) == 0.0
        assert METRIC["piece_worst"](run) < 1e-2 and METRIC["piece_sum_worst"](run) < 5e-3
        assert METRIC["cut_energy"](run) < 1e-8 and METRIC["cut_momentum"](run) < 1e-10
        assert METRIC["cut_limit"](run) <= 1.0 + 1e-9
        assert run.record.attributes["cut_events"] == 2
        # They are mirror images, on meshes that are not: to discretization.
        widest = [run.gap(run.opening)[run.cut_of_pairs == k].max() for k in (0, 1)]
        truth = run.gap(run.reference.opening(run.fields.rest[run.cut_pairs[:, 0]]))
        assert widest[0] == pytest.approx(widest[1], rel=alike) and min(widest) > 0.05 * RADIUS
        assert truth[run.cut_of_pairs == 0].max() == pytest.approx(truth[run.cut_of_pairs == 1].max(), rel=0.01)


@pytest.mark.campaign
def test_the_error_of_the_opening_is_that_of_the_worse_cut(judged):
    run = judged["quadratic"]
    truth, weights = run.reference.opening(run.fields.rest[run.cut_pairs[:, 0]]), run.cut_weights
    each = []
    for k in (0, 1):
        here = run.cut_of_pairs == k
        wrong = np.linalg.norm(run.opening[here] - truth[here], axis=1)
        each.append(100 * np.sqrt(weights[here] @ wrong**2 / (weights[here] @ (truth[here] ** 2).sum(axis=1))))
    assert METRIC["opening_error"](run) == pytest.approx(max(each)) and max(each) > 1.01 * min(each)


@pytest.mark.campaign
def test_the_reference_opens_one_cut_after_the_other(judged):
    """At each checkpoint the cuts before it are open and no other; with the second one never made, the second
    checkpoint has the same equilibrium."""
    reference = judged["quadratic"].reference
    x, cuts = reference.field("nodes"), BALL_CUT_TWICE.cuts
    corners = reference.mesh.p.T
    order = np.lexsort(corners.T)
    same = np.flatnonzero((corners[order][1:] == corners[order][:-1]).all(axis=1))
    one, other = order[same], order[same + 1]
    which = nearest_cut(cuts, x[one])
    apart = np.linalg.norm(reference.field("displacement")[:, one] - reference.field("displacement")[:, other], axis=2)
    gapes = np.array([[apart[k, which == cut].max() for cut in (0, 1)] for k in range(3)])
    assert np.array_equal(gapes > 1e-3, [[False, False], [True, False], [True, True]])
    assert gapes[0].max() == gapes[1, 1] == 0.0

    mesh = base_mesh(replace(BALL_CUT_TWICE, checkpoints=(SECOND_AT, 4.0)), 150, 0)
    path = path_of(mesh, problems_of(mesh))
    opened, parent = opened_elements(mesh.mesh, mesh.body.faces_of_cuts[0])
    (truth,) = equilibrium_path(problem_on(mesh.scene, opened, mesh.held_in(parent), None), (SECOND_AT,))[-1:]
    assert path[0].held_force == pytest.approx(truth.held_force, rel=1e-9, abs=1e-9)
    where = {tuple(place): u for place, u in zip(nodes(opened), truth.u, strict=True)}
    single = [k for k, place in enumerate(nodes(mesh.solved)) if abs(abs(place[2]) - AWAY * RADIUS) > 1e-9]
    moved = np.array([where[tuple(nodes(mesh.solved)[k])] for k in single])
    assert np.abs(path[0].u[single] - moved).max() < 1e-9 * RADIUS


def mirrored() -> OrganMesh:
    """A ball that is its own mirror image, cut above its middle and below it at the same height."""
    cuts = (Cut("middle", MIDDLE, at=1.0), Cut("above", level(AWAY * RADIUS), HALF, at=1.0))
    half = organ("ball", 250, {}, cuts=cuts)
    upper = half.tetrahedra[half.points[half.tetrahedra].mean(axis=1)[:, 2] > 0]
    used = np.unique(upper)
    new = np.full(len(half.points), -1)
    new[used] = np.arange(len(used))
    top = half.points[used]
    on = np.abs(top[:, 2]) < 1e-9
    twin = np.where(on, np.arange(len(top)), len(top) + np.cumsum(~on) - 1)
    points = np.concatenate([top, top[~on] * [1.0, 1.0, -1.0]])
    cells, faces = new[upper], new[half.cuts["above"]]
    every = np.concatenate([cells, twin[cells][:, [0, 2, 1, 3]]])
    outer = np.unique(boundary_triangles(every))
    order = np.concatenate([outer, np.setdiff1d(np.arange(len(points)), outer)])
    number = np.argsort(order)
    points, cells = points[order], number[every]
    rim = points[: len(outer), 2]
    patches = {"bottom": np.flatnonzero(rim < -0.6 * RADIUS), "top": np.flatnonzero(rim > 0.6 * RADIUS)}
    # Mirrored twice: the face as such, and its sense, for its front is above it.
    along = {"below": number[twin[faces]], "above": number[faces]}
    return OrganMesh("mirrored", points, boundary_triangles(cells), cells, len(outer), patches, cuts=along)


@pytest.mark.parametrize(("recipe", "same"), [(ONE, 1e-9), (NODAL, 2e-6)], ids=["one", "nodal"])
def test_mirrored_cuts_open_as_mirror_images(recipe, same):
    """To rounding; nodal volumes to where their iterations end."""
    mesh = mirrored()
    bottom, top = AT_ONCE.held
    down = Trajectory(top.path.times, tuple((0.0, 0.0, -z) for *_, z in top.path.displacements))
    scene = replace(AT_ONCE, held=(replace(bottom, path=down), top))
    prepared = prepared_on(Case(scene, recipe, ImplicitVolume(), dt_fraction=0.5), mesh)
    history = simulate(prepared.setup)
    assert history.outcome == "finished", history.message
    pairs, rest = prepared.opening.pairs, prepared.body.rest
    gap = history.final[pairs[:, 1]] - history.final[pairs[:, 0]]
    above = rest[pairs[:, 0], 2] > 0
    place = rest[pairs[:, 0], :2]
    one, other = (np.flatnonzero(side)[np.lexsort(place[side].T)] for side in (above, ~above))
    assert np.array_equal(place[one], place[other]) and gap[one, 2].max() > 0.05 * RADIUS
    assert np.abs(gap[one] - gap[other] * [-1.0, -1.0, 1.0]).max() < same * RADIUS


@pytest.mark.campaign
@pytest.mark.parametrize("recipe", [ONE, NODAL, QUADRATIC], ids=["one", "nodal", "quadratic"])
def test_the_order_of_the_cuts_does_not_matter_once_all_is_at_rest(recipe):
    """One after the other, as both at once, and the other first: the same rest."""
    turned = replace(AT_ONCE, cuts=(replace(BELOW, at=SECOND_AT), replace(ABOVE, at=CUT_AT)))
    ends, counts = [], []
    for scene in (replace(BALL_CUT_TWICE, reference=None), AT_ONCE, turned):
        prepared = prepare(Case(replace(scene, duration=8.0, frames=400), recipe, ImplicitVolume(), dt_fraction=0.8))
        history = simulate(prepared.setup)
        assert history.outcome == "finished", history.message
        assert max(one.energy for one in history.passages) < 1e-10
        assert max(one.momentum for one in history.passages) < 1e-12
        ends.append(history.final)
        counts.append(len(history.passages))
    assert counts == [2, 1, 2]
    assert max(np.abs(end - ends[1]).max() for end in ends) < 1e-6 * 2 * RADIUS


@pytest.mark.parametrize(("at", "energy"), [((CUT_AT, SECOND_AT), 1e-8), campaign((SECOND_AT, CUT_AT), 1e-10)])
@pytest.mark.parametrize(
    "recipe",
    [replace(ONE, nodes=COARSE), replace(NODAL, nodes=COARSE), QUADRATIC],
    ids=["one", "nodal", "quadratic"],
)
def test_a_section_and_an_incision_in_a_half(recipe, at, energy):
    """Each event keeps mass, momentum, energy and the sum of the volumes; the incision parts no piece. Halves at rest
    have a ten-millionth of the energy of their taut springs, which rounds."""
    cuts = (Cut("section", level(-0.2 * RADIUS), at=at[0]), Cut("incision", level(0.3 * RADIUS), HALF, at=at[1]))
    early, late = np.argsort(at)
    scene = replace(BALL_BISECTED, cuts=cuts)
    prepared = prepare(Case(scene, recipe, ImplicitVolume(), dt_fraction=0.8))
    setup, opening, body = prepared.setup, prepared.opening, prepared.body
    first, second = setup.events
    assert [event.frame for event in setup.events] == [50, 100] and opening.frame == 50
    for event in setup.events:
        assert event.body.mass.sum() == pytest.approx(setup.body.mass.sum(), rel=1e-13)
        assert event.body.rest_volumes.sum() == pytest.approx(setup.body.rest_volumes.sum(), rel=1e-13)
    assert len(np.unique(opening.parts)) == 2
    volumes = np.bincount(opening.parts, body.rest_volumes)
    height = 0.8 * RADIUS  # of the smaller part, a cap of the ball
    assert volumes.min() / volumes.sum() == pytest.approx(height**2 * (3 * RADIUS - height) / (4 * RADIUS**3), rel=0.03)
    history = simulate(setup, snapshots=(75, 125))
    assert history.outcome == "finished", history.message
    assert len(history.passages) == 2
    assert max(one.energy for one in history.passages) < energy
    assert max(one.momentum for one in history.passages) < 1e-12
    total = history.volume.sum(axis=1) / body.rest_volumes.sum()
    assert np.abs(total - 1).max() < 1e-4
    which = nearest_cut(cuts, body.rest[opening.pairs[:, 0]])
    gaps = [np.linalg.norm(x[opening.pairs[:, 1]] - x[opening.pairs[:, 0]], axis=1) for x in history.snapshots]
    assert gaps[0][which == late].max() == 0.0 < gaps[1][which == late].max() and gaps[0][which == early].max() > 1e-3
    assert first.body.node_count < second.body.node_count == body.node_count
