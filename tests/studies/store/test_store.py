import json
from dataclasses import replace

import h5py
import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp

from studies.base.errors import DamagedFile, OtherVersion, StudyError
from studies.store import opening
from studies.store.checksums import Seal, seal_of
from studies.store.opening import open_results
from studies.store.record import SCHEMA, Field, Record, Status, peek, read_record, write_record
from studies.store.staleness import CASE_CHANGED, CODE_CHANGED, DAMAGED, MISSING, OTHER_VERSION, is_current, why_stale
from tests.studies import made_up_run

KEY = '{"dt": 0.001, "scene": "ball_squeeze"}'


def record(**changes) -> Record:
    parts = {
        "schema": SCHEMA,
        "kind": "made up",
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


@pytest.fixture
def trusted(monkeypatch):
    """Files that were changed through the library can be read by it: no other process need try first."""
    monkeypatch.setattr(opening, "_comes_to_an_end", lambda path: True)


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
    with open_results(path) as (file, untouched), pytest.raises(OSError, match="no write intent"):
        assert untouched
        file["t"][0] = 7.0
    read_record(path)
    assert path.read_bytes() == before


@pytest.mark.parametrize(
    ("changes", "sentence"),
    [
        ({"schema": SCHEMA + 1}, "has schema 3; this version writes 2"),
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
        assert why_stale(path, KEY, "f" * 64) == DAMAGED


def test_foreign_files_are_one_sentence(tmp_path):
    (tmp_path / "text.h5").write_text("hello")
    with pytest.raises(StudyError, match="is not an HDF5 file"):
        read_record(tmp_path / "text.h5")
    with h5py.File(tmp_path / "theirs.h5", "w") as file:
        file["x"] = 1.0
    with pytest.raises(StudyError, match="is an HDF5 file of another program"):
        peek(tmp_path / "theirs.h5")
    with pytest.raises(StudyError, match="there is no results file"):
        peek(tmp_path / "missing.h5")
    with pytest.raises(StudyError, match="there is no results file"):
        peek(tmp_path)


@pytest.mark.parametrize("schema", [0, SCHEMA + 1, "old"])
def test_another_schema_is_refused(tmp_path, trusted, schema):
    path = tmp_path / "a.h5"
    write_record(path, record())
    with h5py.File(path, "r+") as file:
        file.attrs["schema"] = schema
    with pytest.raises(StudyError, match=f"has results schema {schema}, this version reads {SCHEMA}"):
        read_record(path)


def spoil_text(file):
    del file["volume"]
    file["volume"] = "none"
    file["volume"].attrs.update({"unit": "m^3", "description": "volume"})


def scale_last(file):
    file["volume"][-1, 0] *= 1.5


def empty(file):
    del file["tetrahedra"]
    file.create_dataset("tetrahedra", data=np.zeros((0, 4), int)).attrs.update({"unit": "1", "description": "cells"})


def dangle(file):
    del file["volume"]
    file["volume"] = h5py.SoftLink("/nowhere")


def leave(file):
    del file["volume"]
    file["volume"] = h5py.ExternalLink("nowhere.h5", "/volume")


SPOILT = {
    "a value": (scale_last, "'volume' has changed since it was written"),
    "no field": (lambda file: file.__delitem__("volume"), "lacks 'volume'"),
    "soft link": (dangle, "lacks 'volume'"),
    "external link": (leave, "lacks 'volume'"),
    "text": (spoil_text, "'volume' has changed"),
    "empty": (empty, "'tetrahedra' has changed"),
    "a group": (lambda file: (file.__delitem__("rest"), file.create_group("rest")), "lacks 'rest'"),
    "no unit": (lambda file: file["t"].attrs.__delitem__("unit"), "'t' has lost its unit"),
    "another unit": (lambda file: file["t"].attrs.__setitem__("unit", "ms"), "'t' has changed"),
    "an attribute": (lambda file: file.attrs.__setitem__("dt", 0.06), "the attribute 'dt' has changed"),
    "no attribute": (lambda file: file.attrs.__delitem__("key"), "lacks the attribute 'key'"),
    "an odd status": (lambda file: file.attrs.__setitem__("status", "splendid"), "the attribute 'status' has changed"),
    "a numeric name": (lambda file: file.attrs.__setitem__("name", 3), "the attribute 'name' has changed"),
    "text for a number": (lambda file: file.attrs.__setitem__("dt_limit", "much"), "'dt_limit' has changed"),
    "the key": (lambda file: file.attrs.__setitem__("key", '{"beyond_limit'), "the attribute 'key' has changed"),
    "checksums": (lambda file: file.attrs.__setitem__("checksums", "{}"), "is cut off or damaged"),
    "no checksums": (lambda file: file.attrs.__delitem__("checksums"), "lacks the attribute 'checksums'"),
}


@pytest.mark.parametrize("fault", SPOILT)
def test_what_has_changed_is_damage_and_is_named(tmp_path, trusted, fault):
    """A change made through the library leaves a valid HDF5 file, whose own checksums are right again."""
    path, (spoil, told) = tmp_path / "a.h5", SPOILT[fault]
    stored = made_up_run.run().record
    write_record(path, stored)
    assert why_stale(path, stored.key, stored.fingerprint) is None
    with h5py.File(path, "r+") as file:
        spoil(file)
    with pytest.raises(DamagedFile) as problem:
        read_record(path)
    assert told in str(problem.value) and str(path) in str(problem.value) and "\n" not in str(problem.value)
    assert why_stale(path, stored.key, stored.fingerprint) == DAMAGED


@pytest.mark.parametrize("part", range(6))
def test_a_bit_that_flips_is_damage_or_means_nothing(tmp_path, part):
    """Told to be damaged, or everything in it is what it was; some bits send the library into an endless loop."""
    path, one = tmp_path / "a.h5", record()
    write_record(path, one)
    whole = path.read_bytes()
    place = (2 * part + 1) * len(whole) // 12
    path.write_bytes(whole[:place] + bytes([whole[place] ^ 1 << part]) + whole[place + 1 :])
    assert seal_of(path) is Seal.CHANGED
    if why_stale(path, KEY, "f" * 64) is None:
        assert_same(one, read_record(path))


def test_a_bit_among_the_numbers_is_always_damage(tmp_path, trusted):
    path, one = tmp_path / "a.h5", record()
    write_record(path, one)
    whole, values = path.read_bytes(), one.fields["snapshots/x"].values.tobytes()
    begin = whole.index(values)
    for place in range(begin, begin + len(values), 17):
        path.write_bytes(whole[:place] + bytes([whole[place] ^ 1]) + whole[place + 1 :])
        assert why_stale(path, KEY, "f" * 64) == DAMAGED
        with pytest.raises(DamagedFile):
            read_record(path, ["snapshots/x"])


def test_a_file_that_the_library_never_finishes_is_damaged(tmp_path, monkeypatch):
    path = tmp_path / "a.h5"
    write_record(path, record())
    with h5py.File(path, "r+") as file:
        file.attrs["note"] = "by hand"
    monkeypatch.setattr(opening, "PATIENCE", 0.01)
    with pytest.raises(DamagedFile, match="is cut off or damaged"):
        peek(path)


def test_a_record_that_is_not_as_its_table_says_is_not_written(tmp_path):
    stored = made_up_run.run().record
    odd = {
        "lacks 'volume'": replace(stored, fields={n: f for n, f in stored.fields.items() if n != "volume"}),
        "holds 'rest' with shape (27, 2), not (27, 3)": replace(
            stored, fields=stored.fields | {"rest": replace(stored.fields["rest"], values=np.zeros((27, 2)))}
        ),
        "holds 'more', which is no field of a run": replace(
            stored, fields=stored.fields | {"more": Field(np.zeros(1), "1", "more")}
        ),
        "has frames = '4.0', which is no whole number": replace(stored, attributes=stored.attributes | {"frames": 4.0}),
        "lacks the attribute 'law'": replace(
            stored, attributes={n: v for n, v in stored.attributes.items() if n != "law"}
        ),
        "holds a zero byte": replace(stored, name="a\0b"),
    }
    for told, one in odd.items():
        with pytest.raises(StudyError) as problem:
            write_record(tmp_path / "a.h5", one)
        assert told in str(problem.value)
    assert list(tmp_path.iterdir()) == []


def test_parts_that_others_add_are_left_alone(tmp_path):
    """A note, a group, a data set without a unit: foreign parts are no damage."""
    path, stored = tmp_path / "a.h5", made_up_run.run().record
    write_record(path, stored)
    with h5py.File(path, "r+") as file:
        file.attrs["note"] = "looked at on Monday"
        file["notes/by hand"] = np.arange(3.0)
    assert read_record(path).fields.keys() == stored.fields.keys()
    assert "note" not in peek(path).attributes
    assert why_stale(path, stored.key, stored.fingerprint) is None


def test_the_former_layout_is_stale_and_says_so(tmp_path):
    path = tmp_path / "a.h5"
    with h5py.File(path, "w") as file:
        file.attrs.update({"schema": 1, "kind": "run", "key": KEY, "name": "old", "status": "ok", "message": ""})
        file["t"] = np.arange(3.0)
    assert why_stale(path, KEY, "") == OTHER_VERSION
    with pytest.raises(OtherVersion, match="which stored no checksums: run its case again"):
        read_record(path)


def test_values_carry_the_checksums_of_the_format_too(tmp_path):
    write_record(tmp_path / "a.h5", record())
    with h5py.File(tmp_path / "a.h5") as file:
        assert file["t"].fletcher32 and file["snapshots/x"].fletcher32


def test_current_means_same_case_and_same_code(tmp_path):
    path = tmp_path / "a.h5"
    assert why_stale(path, KEY, "f" * 64) == MISSING
    write_record(path, record(status=Status.FAILED))
    assert is_current(path, KEY, "f" * 64)
    assert is_current(path, json.dumps(json.loads(KEY), sort_keys=False, indent=2), "f" * 64)
    assert why_stale(path, KEY.replace("0.001", "0.002"), "f" * 64) == CASE_CHANGED
    assert why_stale(path, KEY, "e" * 64) == CODE_CHANGED
