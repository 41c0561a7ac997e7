"""A case that is too large for any machine is refused with its numbers and stored as a failure."""

from dataclasses import replace

import pytest

from studies.runs.run import measure
from studies.store.record import Status
from tests.studies.tiny import SQUEEZE, tiny_case


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"dt": 1e-12}, "dt = 1e-12 s makes 4e+12 steps; at most 1e+08 are run: give dt near the limit of 0.0"),
        ({"dt_fraction": 1e-9}, "steps; at most 1e+08 are run: give dt near the limit of"),
        ({"dt": 1e-320}, "steps; at most 1e+08 are run"),
        ({"frames": 10**12}, "frames = 1000000000000 would record"),
        ({"frames": 10**7}, "GB; at most 0.5 GB are: ask for fewer frames"),
        ({"body": replace(tiny_case().body, stiffness=1e14)}, "the stability limit is"),
        ({"frames": 1, "dt": 1e-7}, "steps in a frame, whose paths take"),
        ({"scene": replace(SQUEEZE, duration=float("inf"))}, "the duration is inf s; give a finite number"),
    ],
    ids=lambda value: "",
)
def test_what_cannot_be_computed_is_refused_at_once(mesh_cache, changes, message):
    record = measure(tiny_case(**changes))
    assert record.status == Status.FAILED
    assert message in record.message
    assert "\n" not in record.message


def test_node_counts_that_no_mesher_offers_are_refused_without_it(monkeypatch):
    monkeypatch.setattr(
        "studies.geometry.mesher.jobs.run_worker", lambda *_: pytest.fail("the mesher is not needed for that")
    )
    for nodes in (0, 3, 10**9):
        record = measure(tiny_case(body=replace(tiny_case().body, nodes=nodes)))
        assert f"{nodes} surface nodes asked for, but the mesher offers 60 to 20000" in record.message
