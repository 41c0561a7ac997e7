"""A stored run by names and types: all of them from the tables of studies/store/schema.py."""

import shutil
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from studies import Run, StudyError
from studies.metrics.timing.cases import timing_file
from studies.runs.current import case_path
from studies.store.record import read_record, write_record
from studies.store.schema import RUN_ATTRIBUTES, RUN_FIELDS, RunAttributes, RunFields, Status
from tests.studies.tiny import tiny_case

TYPES = {"number": (float, np.floating, int), "whole number": (int, np.integer), "text": (str,)}


@pytest.fixture
def path(finished_sweep, tmp_path):
    return shutil.copy(case_path(finished_sweep, "tiny", tiny_case()), tmp_path / "run.h5")


def test_every_line_of_the_tables_is_a_name_of_the_run(path):
    run, record = Run.load(path), read_record(path)
    assert run.case == tiny_case() and run.reference is None and run.timing is None
    for name, line in RUN_FIELDS.items():
        value = getattr(run.fields, name)
        assert getattr(RunFields, name) is line and line.name == name
        if name in record.fields:
            assert np.array_equal(value, record.fields[name].values, equal_nan=True), name
            assert line.unit == record.fields[name].unit and value.ndim == len(line.shape.split())
        else:
            assert line.optional and value is None, name
    for name, line in RUN_ATTRIBUTES.items():
        value = getattr(run.attributes, name)
        assert getattr(RunAttributes, name) is line and value is run.record.attributes.get(name)
        assert isinstance(value, TYPES[line.kind]) or (value is None and line.optional), name


def test_the_document_reads_a_run(path, capsys):
    """With this file in the place of its own."""
    text = (Path(__file__).parents[3] / "docs" / "results.md").read_text(encoding="utf-8")
    code = text.split("## In Python")[1].split("```python\n")[1].split("```")[0]
    line = next(line for line in code.splitlines() if "Run.load" in line)
    exec(code.replace(line, f"run = Run.load({str(path)!r})"), {})
    assert "ImplicitVolume" in capsys.readouterr().out


def test_a_field_and_an_attribute_of_one_name_are_two_things(path):
    run = Run.load(path)
    assert run.fields.triangles.shape == (run.attributes.triangles, 3)


def test_a_file_without_what_came_later_opens(path):
    """Parts that are optional were added since the first file was written."""
    record = read_record(path)
    later = {name for name, line in RUN_ATTRIBUTES.items() if line.optional}
    kept = {name: value for name, value in record.attributes.items() if name not in later}
    assert len(kept) < len(record.attributes)
    write_record(path, replace(record, attributes=kept))
    run = Run.load(path)
    assert run.attributes.seconds is None and run.attributes.dt == record.attributes["dt"]


def test_what_was_not_computed_is_one_sentence(path):
    record = read_record(path)
    write_record(path, replace(record, status=Status.FAILED, fields={}, attributes={"warnings": ""}))
    run = Run.load(path)
    with pytest.raises(StudyError, match=rf"the record of {record.name}, failed, holds no 'volume'"):
        run.volume_ratio  # noqa: B018
    with pytest.raises(StudyError, match="holds no 'dt'"):
        run.attributes.dt  # noqa: B018
    with pytest.raises(AttributeError, match="volumes"):
        run.fields.volumes  # noqa: B018


def test_only_a_run_is_one(finished_sweep):
    file = timing_file(finished_sweep, "tiny", tiny_case(timed=True))
    with pytest.raises(StudyError, match="holds a timing, not a run; read_record opens it"):
        Run.load(file)
