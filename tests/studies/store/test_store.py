import json
from dataclasses import replace
from hashlib import sha256

import h5py
import numpy as np
import pytest
import xarray
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp

from studies.base.errors import OtherVersion, StudyError
from studies.store.entry import CASE_CHANGED, CODE_CHANGED, DAMAGED, MISSING, OTHER_VERSION, why_stale
from studies.store.new_record import new_fields, new_record
from studies.store.opening import open_results, sealed
from studies.store.record import SCHEMA, Field, Record, Status, peek, read_record, write_record
from studies.store.schema import LAYOUTS, TIMING_FIELDS
from tests.studies import made_up_run
from tests.studies.report.view.made import reference_record

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
            "positions": Field(np.arange(24.0).reshape(2, 4, 3), "m", "positions"),
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
    fields = {f"f{i}": Field(v, "1", "anything") for i, v in enumerate(values)}
    one = record(
        fields=fields, attributes={f"a{i}": v for i, v in enumerate(attributes)}, message=message, status=status
    )
    write_record(tmp_path / "a.h5", one)
    assert_same(one, read_record(tmp_path / "a.h5"))


def test_some_fields_and_none(tmp_path):
    write_record(tmp_path / "a.h5", record())
    assert list(read_record(tmp_path / "a.h5", ["positions"]).fields) == ["positions"]
    assert peek(tmp_path / "a.h5").fields == {}
    assert peek(tmp_path / "a.h5").attributes == record().attributes
    with pytest.raises(StudyError, match="unknown field 'position'; did you mean 'positions'"):
        read_record(tmp_path / "a.h5", ["position"])


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
        ({"schema": SCHEMA + 1}, "has schema 3; this version writes 2"),
        ({"key": "ball"}, "a case must be JSON text, not 'ball'"),
        ({"status": "fine"}, "unknown status 'fine'.*known are .*not-converged"),
        ({"attributes": {"status": "ok"}}, "attribute 'status' = 'ok'"),
        ({"attributes": {"nested": {"a": 1}}}, "attribute 'nested'"),
        ({"attributes": {"long": np.zeros(1000)}}, "an array is a field"),
        ({"fields": {"group/t": Field(np.zeros(2), "s", "time")}}, "a name without '/'"),
        ({"fields": {"t": Field(np.zeros(2), "", "time")}}, "field 't'.*a unit"),
        ({"fields": {"t": Field(np.zeros(2), "s", "")}}, "a description"),
        ({"fields": {"t": Field(np.array([{}]), "s", "time")}}, "dtype kind 'O'"),
    ],
)
def test_what_could_not_be_read_back_is_refused(tmp_path, changes, sentence):
    with pytest.raises(StudyError, match=sentence):
        write_record(tmp_path / "a.h5", record(**changes))
    assert list(tmp_path.iterdir()) == []


def test_a_record_that_is_not_as_its_table_says_is_not_written(tmp_path):
    stored = made_up_run.run().record
    odd = {
        "lacks 'volume'": replace(stored, fields={n: f for n, f in stored.fields.items() if n != "volume"}),
        "holds 'rest' with shape (27, 2), not (27, 3)": replace(
            stored, fields=stored.fields | {"rest": replace(stored.fields["rest"], values=np.zeros((27, 2)))}
        ),
        "holds 'more', which is not a field of a run": replace(
            stored, fields=stored.fields | {"more": Field(np.zeros(1), "1", "more")}
        ),
        "has frames = '4.0', not a whole number": replace(stored, attributes=stored.attributes | {"frames": 4.0}),
        "lacks the attribute 'law'": replace(
            stored, attributes={n: v for n, v in stored.attributes.items() if n != "law"}
        ),
        "contains a null byte": replace(stored, name="a\0b"),
    }
    for message, one in odd.items():
        with pytest.raises(StudyError) as problem:
            write_record(tmp_path / "a.h5", one)
        assert message in str(problem.value)
    assert list(tmp_path.iterdir()) == []


def test_a_file_with_digests_of_its_parts_is_read_as_before(tmp_path):
    """As files written earlier have them, in chunks with checksums of the format."""
    path, stored = tmp_path / "a.h5", made_up_run.run().record
    write_record(path, stored)
    with h5py.File(path, "r+") as file:
        file.attrs["checksums"] = '{"attributes": {}, "fields": {}}'
        values = file["volume"][()]
        attributes = dict(file["volume"].attrs)
        del file["volume"], attributes["DIMENSION_LIST"]
        file.create_dataset("volume", data=values, chunks=values.shape, fletcher32=True).attrs.update(attributes)
    path.write_bytes(sealed(path.read_bytes()))
    assert_same(stored, read_record(path))
    assert why_stale(path, stored.key, stored.fingerprint) is None


@pytest.mark.parametrize("spoilt", [None, 5, 600, -1])
def test_a_file_with_its_seal_at_the_beginning_is_read_as_before(tmp_path, spoilt):
    """In the user block of HDF5, as files written earlier have it; a changed byte is damage there too."""
    path, stored = tmp_path / "a.h5", made_up_run.run().record
    write_record(path, stored)
    with h5py.File(path) as new, h5py.File(tmp_path / "b.h5", "w", libver="v110", userblock_size=512) as old:
        old.attrs.update(new.attrs)
        for name in new:
            new.copy(name, old)
    image = (tmp_path / "b.h5").read_bytes()[512:]
    words = (
        f"organbench results; bytes and SHA-256 of what follows these 512: {len(image)} {sha256(image).hexdigest()}\n"
    )
    content = bytearray(words.encode().ljust(512, b"\0") + image)
    if spoilt is not None:
        content[spoilt] ^= 1
    path.write_bytes(content)
    assert why_stale(path, stored.key, stored.fingerprint) == (None if spoilt is None else DAMAGED)
    if spoilt is None:
        assert_same(stored, read_record(path))


def test_the_former_layout_is_stale_and_says_so(tmp_path):
    path = tmp_path / "a.h5"
    with h5py.File(path, "w") as file:
        file.attrs.update({"schema": 1, "kind": "run", "key": KEY, "name": "old", "status": "ok", "message": ""})
        file["t"] = np.arange(3.0)
    assert why_stale(path, KEY, "") == OTHER_VERSION
    with pytest.raises(OtherVersion, match="which stored no checksums: run its case again"):
        read_record(path)


KINDS = {
    "run": lambda: made_up_run.run().record,
    "reference": lambda: reference_record(made_up_run.SCENE),
    "timing": lambda: new_record(
        kind="timing", key=KEY, name="ball", status=Status.OK, message="", fingerprint="",
        attributes={"core": None, "threads": 1, "repeats": 2},
        fields=new_fields(TIMING_FIELDS, {
            "frame_ns": np.ones((2, 3)), "stage_ns": np.ones((2, 3)), "stages": np.array(["springs", "volume λ"]),
        }),
    ),
}  # fmt: skip


@pytest.mark.parametrize("kind", KINDS)
def test_xarray_opens_a_record_with_named_dimensions(tmp_path, kind):
    path, stored = tmp_path / "a.h5", KINDS[kind]()
    write_record(path, stored)
    with xarray.open_dataset(path) as shown:
        assert set(shown.variables) == set(stored.fields)
        for name, field in stored.fields.items():
            assert shown[name].dims == tuple(LAYOUTS[kind][0][name].shape.split())
            assert shown[name].attrs == {"unit": field.unit, "description": field.description}
            np.testing.assert_array_equal(shown[name].values, field.values)
        assert shown.attrs["name"] == stored.name and {*stored.attributes} <= {*shown.attrs}


def test_current_means_same_case_and_same_code(tmp_path):
    path = tmp_path / "a.h5"
    assert why_stale(path, KEY, "f" * 64) == MISSING
    write_record(path, record(status=Status.FAILED))
    assert why_stale(path, KEY, "f" * 64) is None
    assert why_stale(path, json.dumps(json.loads(KEY), sort_keys=False, indent=2), "f" * 64) is None
    assert why_stale(path, KEY.replace("0.001", "0.002"), "f" * 64) == CASE_CHANGED
    assert why_stale(path, KEY, "e" * 64) == CODE_CHANGED
