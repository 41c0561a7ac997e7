"""Scenes with a cut that the mesh of the body does not know: the same run, reference and metrics."""

import numpy as np
import pytest

from massspring import ImplicitVolume
from studies.metrics.metrics import METRICS
from studies.metrics.run import Run
from studies.reference.load import reference_for
from studies.runs.case import Case
from studies.runs.recipes import TetrahedralBody
from studies.runs.run import measure
from studies.scene.library.ball_cuts import BALL_BISECTED, BALL_INCISED
from studies.store.record import write_record

pytestmark = pytest.mark.slow
METRIC = {metric.name: metric for metric in METRICS}
ONE = TetrahedralBody(nodes=350, cut="virtual")
NODAL = TetrahedralBody(nodes=350, law="cotangent", volumes="nodal", cut="virtual")


def run_of(scene, body, root, **settings) -> Run:
    case = Case(scene, body, ImplicitVolume(), dt_fraction=0.8, **settings)
    return Run(case, measure(case), reference_for(root, scene))


def test_an_incision_that_ends_inside_cells_gapes_as_in_the_reference(tmp_path):
    run = run_of(BALL_INCISED, ONE, tmp_path)
    assert run.record.status == "ok", run.record.message
    truth = run.reference.opening(run.fields.rest[run.cut_pairs[:, 0]])
    gap, true_gap = (run.cut_weights @ u[:, 2] for u in (run.opening, truth))
    # Where only cells that are cut through are copied, the front stands too early: an error of 27 %.
    assert gap / true_gap == pytest.approx(1.0, abs=0.1)
    assert METRIC["opening_error"](run) < 12.0
    assert METRIC["mean_error"](run) < 5.0
    assert abs(METRIC["force_end"](run)) < 12.0
    assert METRIC["overlap"](run) == 0.0
    assert METRIC["volume_worst"](run) < 5e-3
    assert METRIC["cut_energy"](run) < 1e-8 and METRIC["cut_momentum"](run) < 1e-10
    assert 0.95 < METRIC["cut_limit"](run) < 1 + 1e-6


@pytest.mark.parametrize("body", [ONE, NODAL], ids=["one", "nodal"])
def test_a_section_leaves_pieces_with_their_volumes(body, tmp_path):
    run = run_of(BALL_BISECTED, body, tmp_path, recorded=("surface",))
    assert run.record.status == "ok", run.record.message
    volume, target = run.part_volumes
    assert volume.shape[1] == 2
    below, above = target[-1]
    whole = float(run.attributes.rest_volume)
    assert below + above == pytest.approx(whole, rel=1e-12)
    assert min(below, above) > 0.49 * whole
    assert METRIC["piece_worst"](run) < 1e-2 and METRIC["piece_sum_worst"](run) < 5e-3
    assert METRIC["cut_energy"](run) < 1e-8 and METRIC["cut_momentum"](run) < 1e-10
    # The file takes it: its fields fit together.
    write_record(tmp_path / "run.h5", run.record)
    assert Run.load(tmp_path / "run.h5").case == run.case
    # Each half is as it was, but for the shift of the cap that is pulled.
    behind, front = run.cut_pairs.T
    last = run.fields.snapshots[-1]
    np.testing.assert_allclose(last[front, 2] - last[behind, 2], 0.01, atol=2e-3)
    surface, nodes = run.field("surface"), run.field("surface_node")
    np.testing.assert_allclose(surface[-1], last[nodes], atol=1e-7)
    assert run.fields.mass.sum() == pytest.approx(1060.0 * whole, rel=1e-9)
