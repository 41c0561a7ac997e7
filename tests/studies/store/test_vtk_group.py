"""Records that ParaView opens: the group as VTK itself reads it."""

import time
from dataclasses import replace

import h5py
import numpy as np
import pytest

from studies.store.opening import VIEWS
from studies.store.record import Record, write_record
from studies.store.schema import Status
from tests.studies.made_up_run import SCENE, run
from tests.studies.report.view.made import reference_record
from tests.studies.report.view.test_vtkhdf import exact

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
    fields = {name: values(record, name) for name in record.fields if name not in others}
    return {name: each.reshape(rows, -1) for name, each in fields.items() if len(each) == rows and each.size}


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
        for data, arrays in (
            (read.GetPointData(), nodal_of(record, step)),
            (read.GetFieldData(), histories_of(record)),
        ):
            for name, each in arrays.items():
                exact(support.vtk_to_numpy(data.GetArray(name)).reshape(each.shape), each)


def test_no_number_is_stored_twice(stored):
    """Of its own the group has a few numbers for each step, and how the cells are numbered, which is deflated."""
    record, path = stored
    with h5py.File(path) as file:
        fields, items = [file[name] for name in record.fields], {}
        file[VIEWS].visititems(items.__setitem__)
        own = {name: item for name, item in items.items() if isinstance(item, h5py.Dataset) and item not in fields}
        sizes = {name: item.id.get_storage_size() for name, item in own.items()}
    assert sizes.pop("Offsets") < 150
    assert 0 < sum(sizes.values()) <= 3 * 8 + 4 * 8 * len(steps_of(record))


def test_the_same_record_is_the_same_bytes_at_any_time(tmp_path):
    for number, make in enumerate(RECORDS.values()):
        write_record(tmp_path / f"{number}.h5", make())
    before = [path.read_bytes() for path in sorted(tmp_path.iterdir())]
    time.sleep(1.1)  # stamps of HDF5 are in seconds
    for number, make in enumerate(RECORDS.values()):
        write_record(tmp_path / f"{number}.h5", make())
    assert [path.read_bytes() for path in sorted(tmp_path.iterdir())] == before


def test_a_record_without_a_body_has_no_group(tmp_path):
    failed = replace(run(status=Status.FAILED).record, fields={}, attributes={})
    write_record(tmp_path / "a.h5", failed)
    with h5py.File(tmp_path / "a.h5") as file:
        assert VIEWS not in file
