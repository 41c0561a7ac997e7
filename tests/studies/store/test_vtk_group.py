"""Records that ParaView opens: the group against the VTKHDF specification, and read back by VTK itself."""

import time
from dataclasses import replace

import h5py
import numpy as np
import pytest

from studies.base.errors import DamagedFile
from studies.runs.current import case_path
from studies.store import opening
from studies.store import record as storing
from studies.store.entry import DAMAGED, why_stale
from studies.store.layout.vtk_group import GROUP
from studies.store.record import Record, read_record, write_record
from studies.store.schema import Status
from tests.studies.made_up_run import SCENE, run
from tests.studies.store.test_store import assert_same
from tests.studies.tiny import tiny_case
from tests.studies.view.made import reference_record
from tests.studies.view.test_vtkhdf import exact

NO_CELLS = {"tetrahedra": np.empty((0, 4), np.uint32)}
NO_STEP = {"snapshots": np.empty((0, 27, 3)), "snapshot_frame": np.empty(0, int)}
RECORDS = {
    "a filled body": lambda: run().record,
    "a surface body": lambda: run(values=NO_CELLS).record,
    "a run that ended early": lambda: run(values=NO_STEP, status=Status.DIVERGED).record,
    "a reference": lambda: reference_record(SCENE),
}


@pytest.fixture(params=RECORDS)
def stored(request, tmp_path):
    """A record, its file."""
    record, path = RECORDS[request.param](), tmp_path / "a.h5"
    write_record(path, record)
    return record, path


def values(record: Record, name: str) -> np.ndarray:
    return record.fields[name].values


def steps_of(record: Record) -> np.ndarray:
    """Their times [s], (K,)."""
    return values(record, "t")[values(record, "snapshot_frame") - 1] if record.kind == "run" else values(record, "t")


def cells_of(record: Record) -> np.ndarray:
    return values(record, "tetrahedra" if len(values(record, "tetrahedra")) else "triangles")


def points_of(record: Record, step: int) -> np.ndarray:
    if record.kind == "reference":
        return values(record, "nodes")
    return values(record, "snapshots")[step] if len(steps_of(record)) else values(record, "rest")


def nodal_of(record: Record, step: int) -> dict[str, np.ndarray]:
    if record.kind == "reference":
        return {"displacement": values(record, "displacement")[step]}
    return {name: values(record, name) for name in ("rest", "mass")}


def histories_of(record: Record) -> dict[str, np.ndarray]:
    """What has as many rows as `t`, and none per node."""
    rows, others = len(values(record, "t")), ("snapshots", "displacement", "snapshot_frame")
    found = {name: values(record, name) for name in record.fields if name not in others}
    return {name: each.reshape(rows, -1) for name, each in found.items() if len(each) == rows and each.size}


def test_types_and_shapes_are_those_of_the_specification(stored):
    record, path = stored
    steps, cells, points = len(steps_of(record)), cells_of(record), len(points_of(record, 0))
    wanted = {
        "NumberOfPoints": ("int64", (1,)),
        "NumberOfCells": ("int64", (1,)),
        "NumberOfConnectivityIds": ("int64", (1,)),
        "Points": ("float64", (max(steps, 1) * points if record.kind == "run" else points, 3)),
        "Connectivity": ("int64", (cells.size,)),
        "Offsets": ("int64", (len(cells) + 1,)),
        "Types": ("uint8", (len(cells),)),
    }
    histories = {f"FieldData/{name}": each for name, each in histories_of(record).items()}
    nodal = {f"PointData/{name}": each for name, each in nodal_of(record, 0).items()} if steps else {}
    moving = steps if record.kind == "reference" else 1
    wanted |= {name: ("float64", (moving * points, *each.shape[1:])) for name, each in nodal.items()}
    if steps:
        row = ("int64", (steps,))
        wanted |= {f"Steps/{name}": row for name in ("PartOffsets", "NumberOfParts", "PointOffsets")}
        wanted |= {f"Steps/{name}": ("int64", (steps, 1)) for name in ("CellOffsets", "ConnectivityIdOffsets")}
        wanted |= {f"Steps/{name.replace('/', 'Offsets/')}": row for name in (*histories, *nodal)}
        wanted |= {f"Steps/{name.replace('/', 'Sizes/')}": ("int64", (steps, 2)) for name in histories}
        wanted["Steps/Values"] = ("float64", (steps,))
    with h5py.File(path) as file:
        group = file[GROUP]
        found = {name: (str(group[name].dtype), group[name].shape) for name in wanted}
        assert found == wanted
        assert set(group["FieldData"]) == set(histories_of(record))
        assert {len(group[name]) for name in histories} == {len(values(record, "t"))}
        assert {group[name].ndim for name in histories} <= {1, 2}
        assert ("Steps" in group) == (steps > 0)


def test_attributes_are_those_of_the_specification(stored):
    record, path = stored
    with h5py.File(path) as file:
        group = file[GROUP]
        assert (group.attrs["Version"].dtype, group.attrs["Version"].tolist()) == (np.int64, [2, 0])
        kind = group.attrs.get_id("Type")
        assert not kind.get_type().is_variable_str() and kind.get_type().get_cset() == h5py.h5t.CSET_ASCII
        assert kind.shape == () and group.attrs["Type"] == b"UnstructuredGrid"
        steps = group["Steps"].attrs["NSteps"] if len(steps_of(record)) else np.int64(0)
        assert steps == len(steps_of(record)) and steps.dtype == np.int64


def test_vtk_reads_every_step_to_the_last_bit(stored):
    """In any order, as a person drags the slider."""
    hdf = pytest.importorskip("vtkmodules.vtkIOHDF", reason="VTK is not installed: pip install 'organbench[view]'")
    support = pytest.importorskip("vtkmodules.util.numpy_support")
    record, path = stored
    times, cells = steps_of(record), cells_of(record)
    reader = hdf.vtkHDFReader()
    reader.SetFileName(str(path))
    reader.UpdateInformation()
    assert reader.GetNumberOfSteps() == max(len(times), 1)
    for step in (*range(len(times)), 0):
        reader.UpdateTimeStep(times[step]) if len(times) else reader.Update()
        read = reader.GetOutputDataObject(0)
        exact(support.vtk_to_numpy(read.GetPoints().GetData()), points_of(record, step))
        exact(support.vtk_to_numpy(read.GetCells().GetConnectivityArray()), cells.ravel().astype(np.int64))
        exact(support.vtk_to_numpy(read.GetCells().GetOffsetsArray()), cells.shape[1] * np.arange(len(cells) + 1))
        assert {read.GetCellType(k) for k in range(len(cells))} == {{3: 5, 4: 10}[cells.shape[1]]}
        for data, wanted in (
            (read.GetPointData(), nodal_of(record, step)),
            (read.GetFieldData(), histories_of(record)),
        ):
            for name, each in wanted.items():
                exact(support.vtk_to_numpy(data.GetArray(name)).reshape(each.shape), each)


def test_no_number_is_stored_twice(stored):
    """Of its own the group has a few numbers for each step, and how the cells are numbered, which is deflated."""
    record, path = stored
    with h5py.File(path) as file:
        fields, items = [file[name] for name in record.fields], {}
        file[GROUP].visititems(items.__setitem__)
        own = {name: item for name, item in items.items() if isinstance(item, h5py.Dataset) and item not in fields}
        sizes = {name: item.id.get_storage_size() for name, item in own.items()}
    assert sizes.pop("Offsets") < 150
    assert 0 < sum(sizes.values()) <= 3 * 8 + 4 * 8 * len(steps_of(record))


@pytest.fixture
def of_before(monkeypatch):
    """Records are written as they were without the group, in the format that h5py chooses."""
    monkeypatch.setattr(storing, "FORMAT", None)
    monkeypatch.setattr(storing, "add_vtk_group", lambda *_: None)


def test_a_record_without_the_group_is_read_as_before_and_is_larger(finished_sweep, tmp_path, of_before):
    new, old = case_path(finished_sweep, "tiny", tiny_case()), tmp_path / "a.h5"
    record = read_record(new)
    write_record(old, record)
    with h5py.File(old) as file:
        assert GROUP not in file
    assert_same(replace(record, attributes={}), replace(read_record(old), attributes={}))  # some are NaN
    assert why_stale(old, record.key, record.fingerprint) is None
    assert new.stat().st_size < 0.9 * old.stat().st_size


@pytest.mark.parametrize("part", ["Offsets", "Steps/PointOffsets", "Steps/Values"])
def test_a_bit_that_flips_in_the_group_is_damage(tmp_path, monkeypatch, part):
    monkeypatch.setattr(opening, "_comes_to_an_end", lambda path: True)
    path, record = tmp_path / "a.h5", run().record
    write_record(path, record)
    with h5py.File(path) as file:
        item = file[GROUP][part]
        content = item.id.read_direct_chunk((0,))[1] if part == "Offsets" else item[:].tobytes()
    whole = path.read_bytes()
    assert whole.count(content) == 1
    place = whole.index(content)
    path.write_bytes(whole[:place] + bytes([whole[place] ^ 1]) + whole[place + 1 :])
    with pytest.raises(DamagedFile):
        read_record(path)
    assert why_stale(path, record.key, record.fingerprint) == DAMAGED


def test_the_same_record_is_the_same_bytes_at_any_time(stored):
    record, path = stored
    before = path.read_bytes()
    time.sleep(1.1)  # stamps of HDF5 are in seconds
    write_record(path, record)
    assert path.read_bytes() == before


def test_so_many_checkpoints_that_no_head_holds_their_numbers(tmp_path):
    count = 4100
    values = {"snapshots": np.zeros((count, 27, 3)), "snapshot_frame": np.full(count, 2)}
    write_record(tmp_path / "a.h5", run(values=values).record)
    with h5py.File(tmp_path / "a.h5") as file:
        assert file[GROUP]["Steps/FieldDataSizes/volume"][:].tolist() == [[-1, 4]] * count
        assert file[GROUP]["Steps/PointOffsets"][-1] == 27 * (count - 1)


def test_a_record_without_a_body_has_no_group(tmp_path):
    failed = replace(run(status=Status.FAILED).record, fields={}, attributes={})
    write_record(tmp_path / "a.h5", failed)
    with h5py.File(tmp_path / "a.h5") as file:
        assert GROUP not in file
