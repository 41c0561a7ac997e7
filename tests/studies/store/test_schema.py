"""One table says what results hold: the document, the code that reads fields by name and real records agree with it."""

import re
from pathlib import Path

import pytest

from studies.exchange.entry import ENTRY, SECONDS
from studies.metrics.timing.cases import timing_file
from studies.runs.current import case_path
from studies.runs.run import OWN_FILES
from studies.store.record import read_record
from studies.store.schema import LAYOUTS, LENGTHS, RUN_FIELDS, fault
from tests.studies import made_up_run
from tests.studies.tiny import tiny_case

REPOSITORY = Path(__file__).parents[3]
BY_NAME = re.compile(r"""\.field\(\s*"(\w+)"\s*\)|\.fields\["(\w+)"\]|(?:run|self)\.fields\.(\w+)""")


@pytest.mark.parametrize("kind", LAYOUTS)
def test_every_letter_is_explained(kind):
    fields, attributes = LAYOUTS[kind]
    letters = {part for spec in fields.values() for part in spec.shape.split() if not part.isdigit()}
    letters |= {spec.length for spec in attributes.values() if spec.length}
    assert letters <= set(LENGTHS)
    assert all(spec.description and (spec.unit or spec.kind == "text") for spec in fields.values())


def test_fields_are_read_by_names_of_the_tables():
    names = {name for fields, _ in LAYOUTS.values() for name in fields}
    read = set()
    for file in (REPOSITORY / "studies").rglob("*.py"):
        read |= {"".join(groups) for groups in BY_NAME.findall(file.read_text(encoding="utf-8"))}
    assert {"volume", "snapshots", "frame_ns", "displacement"} <= read
    assert read <= names


def test_a_made_up_run_is_as_its_table_says():
    record = made_up_run.run().record
    assert fault(record.kind, record.status, record.attributes, record.fields) is None


def test_what_a_run_writes_is_what_its_tables_list(finished_sweep):
    record = read_record(case_path(finished_sweep, "tiny", tiny_case()))
    optional = {name for name, spec in RUN_FIELDS.items() if spec.optional}
    assert set(record.fields) == set(RUN_FIELDS) - optional | {"frame_steps", "inside", "kinetic", "elastic", "work"}
    assert set(record.attributes) == set(LAYOUTS["run"][1]) - {
        OWN_FILES,
        ENTRY,
        SECONDS,
        *(name for name in LAYOUTS["run"][1] if name.startswith(("cut_", "damping_"))),
        "heaviness_limit",
        "league",
    }  # with an option
    timing = read_record(timing_file(finished_sweep, "tiny", tiny_case(timed=True)))
    assert set(timing.fields) == set(LAYOUTS["timing"][0])
    assert set(timing.attributes) == set(LAYOUTS["timing"][1])
