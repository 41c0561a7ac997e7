"""The size of a record is known before it is made, within a factor of two."""

from dataclasses import replace

import pytest

from studies.runs.run import run_case
from studies.runs.size import record_bytes, timing_bytes
from studies.timing.cases import timing_file
from tests.studies.tiny import tiny_case

NODAL = replace(tiny_case().body, volumes="nodal")
SURFACE = replace(tiny_case().body, kind="surface")


@pytest.mark.parametrize(
    "changes",
    [{}, {"body": NODAL, "frames": 100}, {"recorded": ("kinetic", "surface"), "frames": 60}, {"body": SURFACE}],
    ids=["few frames", "many volumes", "with a replay", "surface"],
)
def test_it_is_that_of_the_file(tmp_path, changes):
    case = tiny_case(**changes)
    assert 0.5 < record_bytes(case) / run_case(tmp_path, "tiny", case).stat().st_size < 2.0


def test_so_is_that_of_frame_times(finished_sweep):
    case = tiny_case(timed=True)
    assert 0.5 < timing_bytes(case) / timing_file(finished_sweep, "tiny", case).stat().st_size < 2.0


def test_what_is_recorded_counts():
    plain = record_bytes(tiny_case())
    assert record_bytes(tiny_case(frames=1000)) > 2 * plain
    assert record_bytes(tiny_case(recorded=("surface",))) > plain
    assert record_bytes(tiny_case(body=NODAL, frames=1000)) > 5 * record_bytes(tiny_case(frames=1000))
