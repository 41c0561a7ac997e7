"""The file for ParaView against the VTKHDF specification, and read back by VTK itself."""

import h5py
import numpy as np
import pytest

from studies.base.errors import StudyError
from studies.reference.solution import Solution
from studies.report.view.bodies import shown_reference, shown_run
from studies.report.view.side_by_side import Grid, side_by_side
from studies.report.view.vtkhdf import write_grid
from tests.studies.made_up_run import SCENE, run
from tests.studies.report.view.made import reference_record


@pytest.fixture(scope="module")
def grid() -> Grid:
    """A reference, a filled body and a surface body, one of which ended early."""
    solution = Solution(SCENE, reference_record(SCENE))
    filled = shown_run(run(), solution, "filled")
    snapshots = run().field("snapshots")[:1]
    empty = {"tetrahedra": np.empty((0, 4), int), "snapshots": snapshots, "snapshot_frame": np.array([2])}
    surface = shown_run(run(values=empty), solution, "surface (diverged)")
    return side_by_side(np.array(SCENE.checkpoints), [shown_reference(solution, "reference"), filled, surface])


@pytest.fixture(scope="module")
def path(grid, tmp_path_factory):
    path = tmp_path_factory.mktemp("view") / "cube.vtkhdf"
    assert write_grid(path, grid) == path.stat().st_size
    return path


def test_types_and_shapes_are_those_of_the_specification(path, grid):
    steps, points, _ = grid.points.shape
    cells, ids = len(grid.types), len(grid.connectivity)
    layout = {
        "NumberOfPoints": ("int64", (1,)),
        "NumberOfCells": ("int64", (1,)),
        "NumberOfConnectivityIds": ("int64", (1,)),
        "Points": ("float64", (steps * points, 3)),
        "Connectivity": ("int64", (ids,)),
        "Offsets": ("int64", (cells + 1,)),
        "Types": ("uint8", (cells,)),
        "PointData/displacement": ("float64", (steps * points, 3)),
        "PointData/error": ("float64", (steps * points, 3)),
        "PointData/offset": ("float64", (points, 3)),
        "PointData/case": ("int32", (points,)),
        "CellData/case": ("int32", (cells,)),
        "FieldData/time": ("float64", (steps, 1)),
        "FieldData/volume_ratio": ("float64", (steps, 3)),
        "FieldData/force": ("float64", (steps, 3)),
        "FieldData/case_name": ("object", (3,)),
        "Steps/Values": ("float64", (steps,)),
        "Steps/PartOffsets": ("int64", (steps,)),
        "Steps/NumberOfParts": ("int64", (steps,)),
        "Steps/PointOffsets": ("int64", (steps,)),
        "Steps/CellOffsets": ("int64", (steps, 1)),
        "Steps/ConnectivityIdOffsets": ("int64", (steps, 1)),
    }
    data = [name for name in layout if "Data/" in name]
    layout |= {f"Steps/{name.replace('/', 'Offsets/')}": ("int64", (steps,)) for name in data}
    layout |= {
        f"Steps/{name.replace('/', 'Sizes/')}": ("int64", (steps, 2)) for name in data if name.startswith("Field")
    }
    with h5py.File(path) as file:
        items = {}
        file["VTKHDF"].visititems(items.__setitem__)
        datasets = {name: (str(x.dtype), x.shape) for name, x in items.items() if isinstance(x, h5py.Dataset)}
    assert datasets == layout


def test_attributes_are_those_of_the_specification(path):
    with h5py.File(path) as file:
        root = file["VTKHDF"]
        assert (root.attrs["Version"].dtype, root.attrs["Version"].tolist()) == (np.int64, [2, 0])
        kind = root.attrs.get_id("Type")
        assert kind.get_type().get_class() == h5py.h5t.STRING
        assert not kind.get_type().is_variable_str() and kind.get_type().get_cset() == h5py.h5t.CSET_ASCII
        assert kind.shape == () and root.attrs["Type"] == b"UnstructuredGrid"
        assert root["Steps"].attrs["NSteps"] == 2 and root["Steps"].attrs["NSteps"].dtype == np.int64
        assert h5py.check_string_dtype(root["FieldData/case_name"].dtype).encoding == "ascii"
        assert dict(root["PointData/error"].attrs)["unit"] == "m"


def test_numbers_agree_with_one_another(path, grid):
    with h5py.File(path) as file:
        root = file["VTKHDF"]
        points, cells = int(root["NumberOfPoints"][0]), int(root["NumberOfCells"][0])
        offsets, types = root["Offsets"][:], root["Types"][:]
        assert offsets[0] == 0 and offsets[-1] == root["NumberOfConnectivityIds"][0] == len(root["Connectivity"])
        assert (np.diff(offsets) == np.select([types == 5, types == 10, types == 24], [3, 4, 10])).all()
        assert set(types) == {5, 10, 24} and len(types) == cells
        assert root["Connectivity"][:].min() >= 0 and root["Connectivity"][:].max() < points
        assert root["Steps/Values"][:].tolist() == list(SCENE.checkpoints)
        for name, rows in (("error", points), ("displacement", points), ("offset", 0), ("case", 0)):
            assert root[f"Steps/PointDataOffsets/{name}"][:].tolist() == [0, rows]
        assert root["Steps/PointOffsets"][:].tolist() == [0, points]
        for name, row, size in (("force", 1, [3, 1]), ("time", 1, [1, 1]), ("case_name", 0, [1, 3])):
            assert root[f"Steps/FieldDataOffsets/{name}"][:].tolist() == [0, row]
            assert root[f"Steps/FieldDataSizes/{name}"][:].tolist() == [size, size]


@pytest.mark.parametrize("name", ["cube.vtu", "cube"])
def test_other_suffixes_are_refused(grid, tmp_path, name):
    with pytest.raises(StudyError, match=r"choose a name that ends in \.vtkhdf"):
        write_grid(tmp_path / name, grid)
    assert list(tmp_path.iterdir()) == []


def test_vtk_reads_every_step_to_the_last_bit(path, grid):
    """In any order, as a person drags the slider."""
    hdf = pytest.importorskip("vtkmodules.vtkIOHDF", reason="VTK is not installed: pip install 'organbench[view]'")
    support = pytest.importorskip("vtkmodules.util.numpy_support")
    reader = hdf.vtkHDFReader()
    reader.SetFileName(str(path))
    for step in (0, 1, 0):
        reader.UpdateTimeStep(grid.times[step])
        read = reader.GetOutputDataObject(0)
        exact(support.vtk_to_numpy(read.GetPoints().GetData()), grid.points[step])
        exact(support.vtk_to_numpy(read.GetCells().GetConnectivityArray()), grid.connectivity)
        exact(support.vtk_to_numpy(read.GetCells().GetOffsetsArray()), grid.offsets)
        assert [read.GetCellType(k) for k in range(len(grid.types))] == grid.types.tolist()
        fields = (grid.point_data, read.GetPointData()), (grid.cell_data, read.GetCellData())
        for data, shown in (*fields, (grid.field_data, read.GetFieldData())):
            for name, item in data.items():
                array, values = shown.GetAbstractArray(name), item.values[step] if item.moves else item.values
                if values.dtype.kind == "U":
                    assert [array.GetValue(k) for k in range(array.GetNumberOfValues())] == values.tolist()
                else:
                    exact(support.vtk_to_numpy(array).reshape(values.shape), values)


def exact(read, written):
    assert read.dtype == written.dtype
    np.testing.assert_array_equal(read, written)
