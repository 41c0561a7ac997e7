import json

import h5py
import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp

from studies.base.errors import StudyError
from studies.store.record import (
    SCHEMA,
    Field,
    Record,
    Status,
    is_current,
    open_results,
    peek,
    read_record,
    why_stale,
    write_record,
)

KEY = '{"dt": 0.001, "scene": "ball_squeeze"}'


def record(**changes) -> Record:
    parts = {
        "schema": SCHEMA,
        "kind": "run",
        "key": KEY,
        "name": "ball/implicit_volume",
        "status": Status.OK,
        "message": "",
        "fingerprint": "f" * 64,
        "machine": "01234567",
        "attributes": {"dt": 1e-3, "frames": 40, "auto": True, "label": "σ é", "limit": None, "g": [0.0, -9.81]},
        "fields": {
            "t": Field(np.linspace(0, 1, 5), "s", "time of each frame"),
            "snapshots/x": Field(np.arange(24.0).reshape(2, 4, 3), "m", "positions"),
            "stage": Field(np.array(["springs", "volume λ"]), "", "names of the stages"),
            "ids": Field(np.arange(3, dtype=np.uint32), "1", "node numbers"),
        },
    }
    return Record(**(parts | changes))


def assert_same(a: Record, b: Record) -> None:
    for name in ("schema", "kind", "key", "name", "status", "message", "fingerprint", "machine", "attributes"):
        assert getattr(a, name) == getattr(b, name), name
    assert a.fields.keys() == b.fields.keys()
    for name, item in a.fields.items():
        other = b.fields[name]
        assert (item.unit, item.description) == (other.unit, other.description)
        assert item.values.dtype.kind == other.values.dtype.kind
        np.testing.assert_array_equal(item.values, other.values)


def test_what_is_written_is_read(tmp_path):
    write_record(tmp_path / "new" / "a.h5", record())
    back = read_record(tmp_path / "new" / "a.h5")
    assert_same(record(), back)
    assert isinstance(back.status, Status)
    assert [type(back.attributes[k]) for k in ("dt", "frames", "auto", "label")] == [float, int, bool, str]
    assert back.fields["ids"].values.dtype == np.uint32


def test_a_failure_is_a_record_with_nan_tails(tmp_path):
    volume = np.array([1.0, 0.9, np.nan, np.nan])
    failed = record(status=Status.DIVERGED, message="at t = 0.2 s", fields={"volume": Field(volume, "m^3", "enclosed")})
    write_record(tmp_path / "a.h5", failed)
    assert_same(failed, read_record(tmp_path / "a.h5"))


shapes = hnp.array_shapes(min_dims=0, max_dims=3, min_side=0, max_side=4)
arrays = st.sampled_from(["f8", "f4", "i8", "i4", "u4", "?"]).flatmap(lambda kind: hnp.arrays(kind, shapes))
texts = st.text(st.characters(exclude_categories=["Cs"], exclude_characters="\0"), max_size=20)
plain_values = st.one_of(st.none(), st.booleans(), st.floats(allow_nan=False), st.integers(-(2**63), 2**63 - 1), texts)


@settings(max_examples=60, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(
    values=st.lists(arrays, max_size=3), attributes=st.lists(plain_values, max_size=3), message=texts,
    status=st.sampled_from(Status),
)  # fmt: skip
def test_anything_allowed_survives(tmp_path, values, attributes, message, status):
    fields = {f"group/f{i}": Field(v, "1", "anything") for i, v in enumerate(values)}
    one = record(
        fields=fields, attributes={f"a{i}": v for i, v in enumerate(attributes)}, message=message, status=status
    )
    write_record(tmp_path / "a.h5", one)
    assert_same(one, read_record(tmp_path / "a.h5"))


def test_some_fields_and_none(tmp_path):
    write_record(tmp_path / "a.h5", record())
    assert list(read_record(tmp_path / "a.h5", ["snapshots/x"]).fields) == ["snapshots/x"]
    assert peek(tmp_path / "a.h5").fields == {}
    assert peek(tmp_path / "a.h5").attributes == record().attributes
    with pytest.raises(StudyError, match="unknown field 'snapshot/x'; did you mean 'snapshots/x'"):
        read_record(tmp_path / "a.h5", ["snapshot/x"])


def test_reading_changes_nothing(tmp_path):
    path = tmp_path / "a.h5"
    write_record(path, record())
    before = path.read_bytes()
    with open_results(path) as file, pytest.raises(OSError, match="no write intent"):
        file["t"][0] = 7.0
    read_record(path)
    assert path.read_bytes() == before


@pytest.mark.parametrize(
    ("changes", "sentence"),
    [
        ({"schema": SCHEMA + 1}, "has schema 2; this version writes 1"),
        ({"key": "ball"}, "a case must be JSON text, not 'ball'"),
        ({"status": "fine"}, "unknown status 'fine'.*known are .*not-converged"),
        ({"attributes": {"status": "ok"}}, "attribute 'status' = 'ok'"),
        ({"attributes": {"nested": {"a": 1}}}, "attribute 'nested'"),
        ({"attributes": {"long": np.zeros(1000)}}, "an array is a field"),
        ({"fields": {"t": Field(np.zeros(2), "", "time")}}, "field 't'.*a unit"),
        ({"fields": {"t": Field(np.zeros(2), "s", "")}}, "a description"),
        ({"fields": {"t": Field(np.array([{}]), "s", "time")}}, "dtype kind 'O'"),
    ],
)
def test_what_could_not_be_read_back_is_refused(tmp_path, changes, sentence):
    with pytest.raises(StudyError, match=sentence):
        write_record(tmp_path / "a.h5", record(**changes))
    assert list(tmp_path.iterdir()) == []


def test_a_cut_off_file_is_one_sentence_wherever_it_was_cut(tmp_path):
    path = tmp_path / "a.h5"
    write_record(path, record())
    whole = path.read_bytes()
    for size in {*range(0, 200, 7), *range(200, len(whole), 97), len(whole) - 1}:
        path.write_bytes(whole[:size])
        with pytest.raises(StudyError, match="cut off") as problem:
            read_record(path)
        assert "\n" not in str(problem.value)
        assert why_stale(path, KEY, "f" * 64).startswith("unreadable: ")


def test_foreign_files_are_one_sentence(tmp_path):
    (tmp_path / "text.h5").write_text("hello")
    with pytest.raises(StudyError, match="is not an HDF5 file"):
        read_record(tmp_path / "text.h5")
    with h5py.File(tmp_path / "theirs.h5", "w") as file:
        file["x"] = 1.0
    with pytest.raises(StudyError, match="not a results file of organbench"):
        peek(tmp_path / "theirs.h5")
    with pytest.raises(StudyError, match="there is no results file"):
        peek(tmp_path / "missing.h5")
    with pytest.raises(StudyError, match="there is no results file"):
        peek(tmp_path)


@pytest.mark.parametrize("schema", [0, SCHEMA + 1, "old"])
def test_another_schema_is_refused(tmp_path, schema):
    path = tmp_path / "a.h5"
    write_record(path, record())
    with h5py.File(path, "r+") as file:
        file.attrs["schema"] = schema
    with pytest.raises(StudyError, match=f"has results schema {schema}, this version reads {SCHEMA}"):
        read_record(path)


def test_a_lost_attribute_or_an_unknown_status_is_named(tmp_path):
    path = tmp_path / "a.h5"
    write_record(path, record())
    with h5py.File(path, "r+") as file:
        file.attrs["status"] = "splendid"
    with pytest.raises(StudyError, match=r"unknown status in .*a.h5 'splendid'"):
        peek(path)
    with h5py.File(path, "r+") as file:
        del file.attrs["key"]
    with pytest.raises(StudyError, match="lacks the attribute 'key'"):
        peek(path)


def test_current_means_same_case_and_same_code(tmp_path):
    path = tmp_path / "a.h5"
    assert why_stale(path, KEY, "f" * 64) == "missing"
    write_record(path, record(status=Status.FAILED))
    assert is_current(path, KEY, "f" * 64)
    assert is_current(path, json.dumps(json.loads(KEY), sort_keys=False, indent=2), "f" * 64)
    assert why_stale(path, KEY.replace("0.001", "0.002"), "f" * 64) == "the case changed"
    assert why_stale(path, KEY, "e" * 64) == "the code changed"
