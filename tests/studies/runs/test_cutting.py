"""Scenes with a cut from the mesh to the chart: the incised ball next to its reference, and one cut in two."""

from dataclasses import replace

import h5py
import numpy as np
import pytest

from massspring import ImplicitVolume, Shake
from studies.base.errors import DoesNotApply, StudyError
from studies.geometry.mesh.organ_mesh import boundary_triangles, triangle_areas
from studies.metrics.metrics import METRICS
from studies.metrics.run import Run, doubled
from studies.plots import cut_open, opening, pieces
from studies.reference.load import load_reference
from studies.reference.nested import solve_nested
from studies.reference.reference_solves import ReferenceSolve
from studies.reference.sample import parted
from studies.reference.solve import solve
from studies.runs.case import Case
from studies.runs.prepare import prepare
from studies.runs.recipes import QuadraticBody, SurfaceBody, TetrahedralBody
from studies.runs.run import measure
from studies.scene.library.ball_cuts import BALL_BISECTED, BALL_INCISED
from studies.scene.library.kidney_bisected import KIDNEY_BISECTED
from studies.store.record import write_record
from tests.campaigns import campaign

pytestmark = pytest.mark.slow
METRIC = {metric.name: metric for metric in METRICS}
ONE, QUADRATIC, SURFACE = TetrahedralBody(nodes=200), QuadraticBody(nodes=600), SurfaceBody(nodes=200)
NODAL = TetrahedralBody(nodes=200, law="cotangent", volumes="nodal")


@pytest.fixture(scope="module")
def incised(tmp_path_factory) -> dict[str, Run]:
    scene = replace(BALL_INCISED, reference=BALL_INCISED.reference.smaller())
    root = tmp_path_factory.mktemp("incised")
    solve(root, ReferenceSolve(scene))
    reference = load_reference(root, scene)
    cases = {body.kind: Case(scene, body, ImplicitVolume(), dt_fraction=0.8) for body in (ONE, QUADRATIC)}
    return {kind: Run(case, measure(case), reference) for kind, case in cases.items()}


def test_the_incision_gapes_as_in_the_reference(incised):
    for kind, most in (("tetrahedral", 12.0), ("quadratic", 6.0)):
        run = incised[kind]
        assert run.record.status == "ok", run.record.message
        assert METRIC["opening_error"](run) < most
        assert METRIC["mean_error"](run) < most
        assert abs(METRIC["force_end"](run)) < 10.0
        assert METRIC["overlap"](run) == 0.0
        assert METRIC["volume_worst"](run) < 0.05
        assert METRIC["piece_worst"](run) < 1e-2 and METRIC["piece_sum_worst"](run) < 5e-3
        assert METRIC["cut_energy"](run) < 1e-8 and METRIC["cut_momentum"](run) < 1e-10
        assert 0.8 < METRIC["cut_limit"](run) <= 1.0 + 1e-9  # copies are free to move apart: Rayleigh
        assert METRIC["cut_ms"](run) > 0.0


@pytest.mark.campaign
def test_the_body_is_judged_before_the_cut_too(incised):
    """The reference is then the uncut ball: solved without a cut, it has the same force within the bars of both."""
    reference = incised["quadratic"].reference
    scene = reference.scene
    assert scene.checkpoints[0] == scene.cut.at < scene.checkpoints[1]
    behind, front = parted(reference.mesh.p.T, len(reference.at.points)).T
    gaps = [np.abs(u[front] - u[behind]).max() for u in reference.field("displacement")]
    assert gaps[0] == 0.0 and min(gaps[1:]) > 1e-3
    whole = replace(scene, cuts=(), checkpoints=scene.checkpoints[:1])
    force = [one.force[0] for one in solve_nested(whole, {}).samples]
    assert reference.force[0] == pytest.approx(force[0], rel=0.02)
    # Cut to half its section, the ball is softer by far.
    ends = replace(scene, cuts=(), checkpoints=scene.checkpoints[-1:])
    assert reference.force[-1] < 0.7 * solve_nested(ends, {}).samples[0].force[0]
    for run in incised.values():
        assert abs(run.force[run.checkpoint_frames[0]] / reference.force[0] - 1) < 0.08


def test_before_the_cut_copies_lie_on_each_other_and_after_it_they_part(incised):
    run = incised["quadratic"]
    scene, frame = run.case.scene, int(run.record.attributes["cut_frame"])
    assert frame == round(scene.cut.at * scene.frames / scene.duration)
    rest = run.fields.rest
    np.testing.assert_array_equal(*rest[run.cut_pairs.T])
    assert np.abs(scene.cut.plane.level(rest[run.cut_pairs[:, 0]])).max() < 1e-4  # m: curved sides
    assert run.opening[:, 2].min() > 1e-3
    corners = rest[run.record.fields["cut_faces"].values]
    area = 0.5 * np.linalg.norm(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1).sum()
    assert area == pytest.approx(0.5 * np.pi * 0.05**2, rel=0.03)
    assert 0.8 * area < run.cut_weights.sum() < area  # without the shares of the front's nodes, which stay single


def test_the_chart_shows_both(incised, tmp_path):
    figure = opening.figure(list(incised.values()))
    (axes,) = figure.axes
    assert axes.get_ylabel() == "opening [mm]"
    *bodies, truth = (line.get_ydata() for line in axes.lines)
    assert len(bodies) == 2 and truth[-1] == pytest.approx(13.2, rel=0.05)
    assert all(line[-1] == pytest.approx(truth[-1], rel=0.1) for line in bodies)


def test_the_picture_shows_the_faces_of_the_cut_and_how_wide_they_gape(incised):
    """Of body and reference alike: as much of the surface as twice the half disc."""
    run = incised["quadratic"]
    figure = cut_open.figure([run])
    assert ["gapes 13" in axes.get_title() for axes in figure.axes] == [False, True, True]
    for points, triangles in (
        (run.fields.rest, run.fields.triangles.astype(np.int64)),
        (run.reference.field("nodes"), run.reference.triangles),
    ):
        inside = doubled(points, triangles, run.size)
        assert triangle_areas(points, triangles[inside]).sum() == pytest.approx(np.pi * 0.05**2, rel=0.03)


@pytest.mark.parametrize(("force", "words"), [(1.95, "1.95 N"), (-0.3, "−0.30 N"), (0.0412, "41.20 mN")])
def test_forces_in_the_picture_have_digits(force, words):
    assert cut_open.in_newtons(force) == words


def test_the_chart_of_pieces_shows_each_and_their_sum():
    run = Run(case := Case(BALL_BISECTED, ONE, ImplicitVolume(), dt_fraction=0.8), measure(case))
    (axes,) = pieces.figure([run]).axes
    *parts, whole, cut = (np.asarray(line.get_ydata()) for line in axes.lines)
    assert len(parts) == 2 and len(cut) == 2
    first = run.record.attributes["cut_frame"]
    # A half has no volume of its own before the cut; their sum always had.
    assert min(part[:first].max() for part in parts) > 10 * whole[:first].max()
    assert METRIC["piece_worst"](run) == pytest.approx(max(part[-1] for part in parts), abs=1e-3)
    assert METRIC["piece_sum_worst"](run) == pytest.approx(whole.max(), rel=1e-6)


def test_paraview_sees_the_cut_shut_before_and_open_after_it(incised, tmp_path):
    """The group VTKHDF of the file: cells on either side have nodes of their own, which part after the cut."""
    for run in incised.values():
        write_record(tmp_path / "run.h5", run.record)
        with h5py.File(tmp_path / "run.h5") as file:
            group = file["VTKHDF"]
            nodes, steps = int(group["NumberOfPoints"][0]), int(group["Steps"].attrs["NSteps"])
            points = group["Points"][()].reshape(steps, nodes, 3)
            cells = group["Connectivity"][()].reshape(-1, 4)
        outside = {frozenset(face) for face in boundary_triangles(cells.astype(np.int64)).tolist()}
        behind, front = run.cut_pairs.T
        other = np.arange(nodes)
        other[behind] = front
        faces = run.fields.cut_faces
        assert all(frozenset(face) in outside for face in faces.tolist())
        assert all(frozenset(face) in outside for face in other[faces].tolist())
        gap = np.linalg.norm(points[:, front] - points[:, behind], axis=2)
        assert gap[0].max() == 0.0 and gap[-1].min() > 1e-4 and gap[-1].max() > 0.01


@pytest.mark.parametrize("body", [ONE, campaign(QUADRATIC), SURFACE, NODAL])
def test_the_halves_of_a_ball_go_back_to_their_shape_and_volume(body):
    record = measure(Case(BALL_BISECTED, body, ImplicitVolume(), dt_fraction=0.8, recorded=("elastic", "kinetic")))
    assert record.status == "ok", record.message
    values = {name: field.values for name, field in record.fields.items()}
    moved = values["snapshots"][-1] - values["rest"]
    # The lower half is back where it was, the upper one has gone with its cap.
    assert np.abs(moved[values["cut_pairs"][:, 0]]).max() < 2e-5
    np.testing.assert_allclose(moved[values["cut_pairs"][:, 1]], [[0, 0, 0.01]] * len(values["cut_pairs"]), atol=2e-5)
    np.testing.assert_allclose(values["volume"][-1], values["volume_target"][-1], rtol=1e-6)
    whole = values["volume_target"][-1].sum()
    assert values["volume"].sum(axis=1) == pytest.approx(np.full(len(values["t"]), whole), rel=1e-4)
    assert values["elastic"][-1] < 1e-3 * values["elastic"].max()


def test_what_cannot_be_cut_is_refused():
    with pytest.raises(DoesNotApply, match="it keeps one volume, the body keeps 2"):
        prepare(Case(BALL_BISECTED, ONE, Shake()))
    loose = replace(BALL_BISECTED, held=BALL_BISECTED.held[:1])
    with pytest.raises(StudyError, match="leaves a piece that nothing holds"):
        prepare(Case(loose, ONE))
    late = replace(BALL_INCISED, cuts=(replace(BALL_INCISED.cut, at=4.0),))
    with pytest.raises(StudyError, match="is not between two of the 200 frames"):
        prepare(Case(late, ONE))
    early = replace(BALL_INCISED, checkpoints=(0.5, 1.0))
    with pytest.raises(StudyError, match=r"has its last checkpoint at 1 s and its cut at 1 s"):
        solve_nothing(early)
    same = replace(BALL_INCISED, checkpoints=(1.001, 4.0))
    with pytest.raises(StudyError, match=r"at 1\.001 s and cut 'incision' before it at 1 s are in one of 200 frames"):
        prepare(Case(same, ONE))
    with pytest.raises(DoesNotApply, match="cut 'incision' ends inside the organ, where this body has no tissue"):
        prepare(Case(BALL_INCISED, SURFACE))
    with pytest.raises(StudyError, match="leaves a piece that nothing holds"):
        prepare(Case(loose, SURFACE))


def test_a_surface_body_is_cut_in_two_closed_surfaces():
    """The paper's body: the same trace as the tetrahedral one has, one section for both sides, two volumes."""
    prepared, filled = (prepare(Case(BALL_BISECTED, body, ImplicitVolume())) for body in (SURFACE, ONE))
    before, after, opening = prepared.setup.body, prepared.body, prepared.opening
    np.testing.assert_array_equal(opening.parts, [0, 1])
    assert after.rest_volumes.sum() == pytest.approx(before.volume, rel=1e-13, abs=0)
    assert after.mass.sum() == pytest.approx(before.mass.sum(), rel=1e-12)
    behind, front = (after.rest[opening.pairs[:, side]] for side in range(2))
    np.testing.assert_array_equal(behind, front)
    assert np.abs(behind[:, 2]).max() < 1e-9
    np.testing.assert_array_equal(behind, filled.body.rest[filled.opening.pairs[:, 0]])
    born = opening.pairs[after.mass[opening.pairs].all(axis=1)]
    assert len(born) == len(opening.pairs) and len(opening.faces) == len(filled.opening.faces)
    assert prepared.mesh.surface_count == len(prepared.mesh.points) == len(after.surface_nodes)
    held = [np.isin(a.nodes, after.surface_nodes).all() for a in prepared.setup.events[0].attachments]
    assert held == [True, True]


def test_a_surface_body_is_recorded_and_measured_like_the_others(tmp_path):
    case = Case(BALL_BISECTED, SURFACE, ImplicitVolume(), dt_fraction=0.8, recorded=("elastic", "kinetic"))
    run = Run(case, measure(case))
    assert run.record.status == "ok", run.record.message
    first = run.record.attributes["cut_frame"]
    assert METRIC["piece_worst"](run) < 1e-3 and METRIC["piece_sum_worst"](run) < 1e-3
    assert METRIC["cut_momentum"](run) < 1e-10
    assert 0.1 < METRIC["cut_energy"](run) < 10.0  # that of the springs across
    assert 0.5 < METRIC["cut_limit"](run) < 1.0 and METRIC["cut_ms"](run) > 0.0
    # No new spring adds energy: it decreases from the cut to the next pull.
    total = run.field("elastic") + run.field("kinetic")
    assert (np.diff(total[first - 1 : first + 3]) < 0).all()
    (axes,) = pieces.figure([run]).axes
    assert len(axes.lines) == 4
    write_record(tmp_path / "run.h5", run.record)
    with h5py.File(tmp_path / "run.h5") as file:
        group = file["VTKHDF"]
        nodes, steps = int(group["NumberOfPoints"][0]), int(group["Steps"].attrs["NSteps"])
        points = group["Points"][()].reshape(steps, nodes, 3)
    gap = np.linalg.norm(np.subtract(*points[:, run.cut_pairs.T].transpose(1, 0, 2, 3)), axis=2)
    assert gap[0].max() == 0.0 and gap[-1].min() > 0.005


@pytest.mark.campaign
def test_a_piece_next_to_the_axis_gets_one_of_its_own_and_touches_the_rest():
    """The axis of a kidney is on one side of its cut, and the other side is pressed against it."""
    run = Run(case := Case(KIDNEY_BISECTED, SURFACE, ImplicitVolume(), dt_fraction=0.8), measure(case))
    assert run.record.status == "ok", run.record.message
    assert METRIC["overlap"](run) < 0.1 and METRIC["piece_worst"](run) < 1e-3
    assert run.force[run.checkpoint_frames[-1]] > run.force[run.checkpoint_frames[0]] > 0.0


def solve_nothing(scene):
    from studies.meshing.nested_mesh import base_mesh
    from studies.reference.nested import problem_of

    return problem_of(base_mesh(scene, 150, 0))
