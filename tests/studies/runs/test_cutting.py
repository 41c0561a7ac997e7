"""Scenes with a cut from the mesh to the chart: the incised ball next to its reference, and one cut in two."""

from dataclasses import replace

import h5py
import numpy as np
import pytest

from massspring import ImplicitVolume
from studies.metrics.metrics import METRICS
from studies.metrics.run import Run
from studies.plots import pieces
from studies.reference.load import load_reference
from studies.reference.nested import solve_nested
from studies.reference.reference_solves import ReferenceSolve
from studies.reference.sample import parted
from studies.reference.solve import solve
from studies.runs.case import Case
from studies.runs.recipes import QuadraticBody, SurfaceBody, TetrahedralBody
from studies.runs.run import measure
from studies.scene.library.ball_cuts import BALL_BISECTED, BALL_INCISED
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
