"""A record is read as it was written; what could not be read back is refused."""

from dataclasses import replace

import numpy as np
import pytest
import xarray
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp

from studies.base.errors import StudyError
from studies.store.record import SCHEMA, Field, Record, Status, new_fields, new_record, peek, read_record, write_record
from studies.store.schema import LAYOUTS, REFERENCE_FIELDS, TIMING_FIELDS
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
    named = {f"a{i}": v for i, v in enumerate(attributes)}
    one = record(fields=fields, attributes=named, message=message, status=status)
    write_record(tmp_path / "a.h5", one)
    assert_same(one, read_record(tmp_path / "a.h5"))


def test_some_fields_and_none(tmp_path):
    write_record(tmp_path / "a.h5", record())
    assert list(read_record(tmp_path / "a.h5", ["positions"]).fields) == ["positions"]
    assert peek(tmp_path / "a.h5").fields == {}
    assert peek(tmp_path / "a.h5").attributes == record().attributes
    with pytest.raises(StudyError, match="unknown field 'position'; did you mean 'positions'"):
        read_record(tmp_path / "a.h5", ["position"])


RUN = made_up_run.run().record
FLAT = replace(RUN.fields["rest"], values=np.zeros((27, 2)))
TWO_VOLUMES = replace(RUN.fields["pressure"], values=np.zeros((4, 2)))
REFUSED = {
    "has schema 3; this version writes 2": record(schema=SCHEMA + 1),
    "a case must be JSON text, not 'ball'": record(key="ball"),
    "unknown status 'fine'": record(status="fine"),
    "attribute 'status' = 'ok'": record(attributes={"status": "ok"}),
    "attribute 'nested'": record(attributes={"nested": {"a": 1}}),
    "an array is a field": record(attributes={"long": np.zeros(1000)}),
    "a name without '/'": record(fields={"group/t": Field(np.zeros(2), "s", "time")}),
    "a unit": record(fields={"t": Field(np.zeros(2), "", "time")}),
    "a description": record(fields={"t": Field(np.zeros(2), "s", "")}),
    "dtype kind 'O'": record(fields={"t": Field(np.array([{}]), "s", "time")}),
    "contains a null byte": record(name="a\0b"),
    "lacks 'volume'": replace(RUN, fields={n: f for n, f in RUN.fields.items() if n != "volume"}),
    "holds 'rest' with shape (27, 2), not (27, 3)": replace(RUN, fields=RUN.fields | {"rest": FLAT}),
    "holds 'pressure' with shape (4, 2), not (4, 1)": replace(RUN, fields=RUN.fields | {"pressure": TWO_VOLUMES}),
    "holds 't' in 'ms', not in 's'": replace(RUN, fields=RUN.fields | {"t": replace(RUN.fields["t"], unit="ms")}),
    "holds 'more', which is not a field of a run": replace(RUN, fields=RUN.fields | {"more": FLAT}),
    "has frames = '4.0', not a whole number": replace(RUN, attributes=RUN.attributes | {"frames": 4.0}),
    "lacks the attribute 'law'": replace(RUN, attributes={n: v for n, v in RUN.attributes.items() if n != "law"}),
}


@pytest.mark.parametrize("sentence", REFUSED)
def test_what_could_not_be_read_back_is_not_written(tmp_path, sentence):
    with pytest.raises(StudyError) as problem:
        write_record(tmp_path / "a.h5", REFUSED[sentence])
    assert sentence in str(problem.value) and "\n" not in str(problem.value)
    assert list(tmp_path.iterdir()) == []


def test_a_field_without_a_line_in_a_table_is_refused():
    with pytest.raises(StudyError, match=r"lists the field 'volumes'; give it a line there"):
        new_fields(REFERENCE_FIELDS, {"volumes": made_up_run.T})


TIMES = {"frame_ns": np.ones((2, 3)), "stage_ns": np.ones((2, 3)), "stages": np.array(["springs", "volume λ"])}
KINDS = {
    "run": lambda: made_up_run.run().record,
    "reference": lambda: reference_record(made_up_run.SCENE),
    "timing": lambda: new_record(
        kind="timing", key=KEY, name="ball", status=Status.OK, message="", fingerprint="",
        attributes={"core": None, "threads": 1, "repeats": 2}, fields=new_fields(TIMING_FIELDS, TIMES),
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
