"""A cut that advances: however many events it takes, what is kept at each and the end are as for one."""

import itertools
from dataclasses import replace

import numpy as np
import pytest

from massspring import ImplicitVolume, simulate, step_limit
from studies.meshing.graded_mesh import MIDDLE, halved
from studies.meshing.scene_mesh import mesh_for
from studies.meshing.shaping import quadratic_mesh
from studies.reference.published import physics, published
from studies.runs.case import Case
from studies.runs.prepare import Prepared, prepared_on
from studies.runs.recipes import QuadraticBody, TetrahedralBody
from studies.runs.run import measure
from studies.scene.clock import MOST_EVENTS, event_frames
from studies.scene.library import BALL_BISECTED, BALL_INCISED, LIVER_CUT_LIVE, LIVER_INCISED
from tests.campaigns import campaigns_but

ALONG = (1.0, 0.0, 0.0)
UNTIL = 2.0
BODIES = {
    "one": TetrahedralBody(nodes=120),
    "cotangent": TetrahedralBody(nodes=120, law="cotangent", volumes="nodal"),
    "quadratic": QuadraticBody(nodes=4 * 100 - 6),
}


def advancing(scene, until: float = UNTIL):
    """The scene with its cut from −x to +x over a stretch of time, and the last pull early enough to come to rest."""
    return replace(scene, cuts=(replace(scene.cut, until=until, along=ALONG),))


def mesh_of(scene, kind: str):
    """With evenly spread nodes, which is quick to make."""
    if kind == "quadratic":
        return quadratic_mesh(scene, *halved(scene, 100, 0, 0, even=True), MIDDLE)
    return mesh_for(scene, BODIES[kind].nodes, even=True)


def prepared(scene, kind: str, mesh=None, **options) -> Prepared:
    case = Case(scene, BODIES[kind], ImplicitVolume(**options), dt_fraction=0.8)
    return prepared_on(case, mesh_of(scene, kind) if mesh is None else mesh)


@pytest.mark.slow
@pytest.mark.parametrize("kind", campaigns_but(BODIES, lambda kind: kind != "quadratic"))
def test_twenty_events_end_where_one_does_and_keep_momentum_and_energy(kind):
    scene = replace(BALL_INCISED, duration=6.0, frames=300, checkpoints=(1.0, 6.0))
    mesh, ends = mesh_of(scene, kind), []
    for one in (scene, advancing(scene)):
        made = prepared(one, kind, mesh, tolerance=1e-12, most_iterations=1000)
        history = simulate(made.setup)
        assert history.outcome == "finished" and history.min_j.min() > 0.3
        assert history.kinetic[-1] < 1e-12
        assert max(passage.energy for passage in history.passages) < 1e-12
        assert max(passage.momentum for passage in history.passages) < 1e-12
        ends.append((history.final, len(history.passages), made.body))
    (once, events, _), (slowly, many, body) = ends
    assert events == 1 and 8 <= many <= MOST_EVENTS
    np.testing.assert_allclose(slowly, once, atol=1e-6 * body.size)
    assert np.abs(once - body.rest).max() > 0.05 * body.size


@pytest.mark.slow
@pytest.mark.parametrize("kind", BODIES)
def test_no_stage_of_a_cut_lengthens_the_step(kind):
    """Copies are free to move apart: the highest frequency never falls (Rayleigh)."""
    setup = prepared(advancing(BALL_INCISED), kind).setup
    frequencies = [step_limit(body).frequency for body in (setup.body, *(event.body for event in setup.events))]
    assert len(frequencies) > 8
    assert all(after >= before * (1 - 1e-6) for before, after in itertools.pairwise(frequencies))


@pytest.mark.slow
@pytest.mark.parametrize("kind", ["one", "cotangent"])
def test_a_ball_that_is_cut_in_two_by_and_by_keeps_the_volumes_of_both_parts(kind):
    scene = advancing(BALL_BISECTED, until=1.4)
    record = measure(case := Case(scene, BODIES[kind], ImplicitVolume(), dt_fraction=0.8))
    assert record.status == "ok", record.message
    values = {name: field.values for name, field in record.fields.items()}
    first, events = int(record.attributes["cut_frame"]), int(record.attributes["cut_events"])
    assert first == 50 and events > 5
    whole = values["volume_target"][-1].sum()
    np.testing.assert_allclose(values["volume"].sum(axis=1), whole, rtol=1e-4)
    # All targets are on one clock: their sum is that of what was there at the event.
    np.testing.assert_allclose(values["volume_target"].sum(axis=1), whole, rtol=1e-5)
    np.testing.assert_allclose(values["volume"][-1], values["volume_target"][-1], rtol=1e-5)
    assert len(np.unique(values["cut_parts"])) == 2 and case.scene.cut.within is None


def test_a_front_opens_what_it_has_passed_and_nothing_else():
    made = prepared(advancing(BALL_INCISED), "one")
    frames = [event.frame for event in made.setup.events]
    history = simulate(made.setup, snapshots=range(1, 201))
    behind, front = made.opening.pairs.T
    apart = np.abs(history.snapshots[:, front] - history.snapshots[:, behind]).max(axis=2) > 0
    opens = apart.argmax(axis=0)
    assert not apart[: frames[0]].any() and apart[-1].all() and opens.max() == frames[-1]
    # Evenly from one side to the other, in steps of 50/19 frames; the last nodes part with all faces around them.
    place = made.body.rest[behind, 0]
    late = opens - (50 + 50 * (place - place.min()) / np.ptp(place))
    assert np.sum(late < -1e-6) <= 2 and np.mean(late < 50 / 19 + 0.5) > 0.8


def test_stages_that_open_nothing_make_no_event_and_events_have_frames_of_their_own():
    cut = advancing(BALL_INCISED).cut
    assert event_frames(BALL_INCISED, BALL_INCISED.cut, 200) == [50]
    assert event_frames(BALL_INCISED, replace(cut, until=1.06), 200) == [50, 51, 52, 53]
    frames = event_frames(BALL_INCISED, cut, 200)
    assert len(frames) == MOST_EVENTS and frames[0] == 50 and frames[-1] == 100
    events = prepared(advancing(BALL_INCISED), "one").setup.events
    assert len(events) < MOST_EVENTS and {event.frame for event in events} < set(frames)
    nodes = [event.body.node_count for event in events]
    assert (np.diff(nodes) > 0).all()


def test_the_reference_does_not_depend_on_how_a_cut_advances():
    assert physics(LIVER_CUT_LIVE) == physics(LIVER_INCISED)
    assert published(LIVER_CUT_LIVE) == published(LIVER_INCISED) is not None
    assert physics(replace(LIVER_INCISED, cuts=(replace(LIVER_INCISED.cut, at=2.5),))) != physics(LIVER_INCISED)
