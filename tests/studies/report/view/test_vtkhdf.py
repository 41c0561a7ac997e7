"""The file for ParaView against the VTKHDF specification, and read back by VTK itself."""

import h5py
import numpy as np
import pytest

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


def test_numbers_agree_with_one_another(path, grid):
    with h5py.File(path) as file:
        root = file["VTKHDF"]
        assert (root.attrs["Version"].tolist(), root.attrs["Type"]) == ([2, 0], b"UnstructuredGrid")
        assert root["Steps"].attrs["NSteps"] == 2 and root["PointData/error"].attrs["unit"] == "m"
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
