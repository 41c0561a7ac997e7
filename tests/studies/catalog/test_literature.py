"""The literature's contestants run like ours, store what they have, and are skipped where a scene asks for more."""

from dataclasses import replace

import numpy as np
import pytest
from threadpoolctl import threadpool_limits

from massspring import LITERATURE, ChainMail, ElasticResponse, LinearModes
from studies.catalog.accuracy import judged_at_rest
from studies.catalog.literature import LITERATURE_STUDY, literature_cases
from studies.catalog.study import smoke_case
from studies.metrics.metrics import METRICS
from studies.metrics.run import Run
from studies.runs.case import Case, case_from_json
from studies.runs.recipes import TetrahedralBody
from studies.runs.run import measure, replay, run_case
from studies.scene.library import BALL_CLAMPED, BALL_SQUEEZE, SPLEEN_SAG
from studies.store.record import Status, read_record
from tests.campaigns import campaign

NODAL = TetrahedralBody(nodes=150, law="cotangent", volumes="nodal")


@pytest.fixture(scope="module", autouse=True)
def one_thread():
    """As in the processes of a sweep: products of a few hundred rows do not gain from a second."""
    with threadpool_limits(1):
        yield


@pytest.fixture(scope="module", params=LITERATURE, ids=lambda kind: kind.name)
def ran(request, one_thread, mesh_cache, tmp_path_factory):
    """The case on the ball held at both caps, made small, and where its record lies."""
    (case,) = (case for case in literature_cases(BALL_CLAMPED) if type(case.method) is request.param)
    case = replace(smoke_case(case), scene=replace(BALL_CLAMPED, reference=None))
    if isinstance(case.method, LinearModes | ElasticResponse):
        case = replace(case, body=NODAL)
    return case, run_case(tmp_path_factory.mktemp("literature"), "literature", case)


def test_each_runs_and_its_record_is_read_back(ran):
    case, path = ran
    record = read_record(path)
    assert (record.status, record.message) == (Status.OK, "")
    assert case_from_json(record.key) == case.replaced(timed=False)
    force = record.fields["held_force"].values
    assert np.isnan(force).all() if isinstance(case.method, ChainMail) else force[-1, 1, 2] < -0.2


def test_a_replay_is_equal_to_the_last_bit(ran):
    assert replay(ran[1])[2] is None


def test_metrics_without_a_reference_are_numbers(ran):
    case, path = ran
    run = Run(case, read_record(path), None, None)
    values = {metric.name: metric(run) for metric in METRICS if metric.name in ("volume_worst", "min_j", "j_spread")}
    assert np.isfinite(list(values.values())).all() and 0.5 < values["volume_worst"] < 20.0


@pytest.mark.parametrize(
    ("scene", "method", "body", "sentence"),
    [
        (BALL_SQUEEZE, LinearModes(), NODAL, "no nodes are clamped"),
        (BALL_SQUEEZE, ElasticResponse(), NODAL, "no nodes are clamped"),
        (BALL_CLAMPED, ElasticResponse(), TetrahedralBody(nodes=150), "its springs must have no length"),
        campaign(SPLEEN_SAG, ChainMail(), TetrahedralBody(nodes=150), "gravity has no effect"),
    ],
    ids=lambda value: getattr(value, "name", ""),
)
def test_what_a_scene_asks_beyond_them_is_a_skip_with_a_reason(mesh_cache, scene, method, body, sentence):
    record = measure(Case(scene, body, method, dt=0.02))
    assert record.status == Status.SKIPPED and sentence in record.message


@pytest.mark.parametrize("scene", judged_at_rest(), ids=lambda scene: scene.name)
def test_each_is_one_case_next_to_ours_in_every_scene(scene):
    cases = [case for case in LITERATURE_STUDY.cases if case.scene == scene]
    others = [case for case in cases if type(case.method) in LITERATURE]
    assert [type(case.method) for case in others] == list(LITERATURE) and len(cases) == len(others) + 2
    assert not any(case.method.capabilities.conditionally_stable for case in others if case.dt != "auto")
