"""Files of a stranger, sealed or not: nothing outside of them is read, and nothing hangs, crashes or unpacks."""

import os

import h5py
import numpy as np
import pytest

from studies.base.errors import StudyError
from studies.exchange.handed import read_handed
from studies.exchange.league import read_entry_file
from studies.geometry.files.checked_reading import read_mesh
from studies.store.opening import VIEWS, sealed
from studies.store.record import read_record, write_record
from tests.studies import made_up_run

SECRET = 1234.5


def elsewhere(file, name, shape):
    file.create_dataset(name, shape, "f8", external=[("secret.bin", 0, h5py.h5f.UNLIMITED)])


def view(file, name, shape, source="secret.h5", seen="x"):
    layout = h5py.VirtualLayout(shape, "f8")
    layout[...] = h5py.VirtualSource(source, seen, shape)
    file.create_virtual_dataset(name, layout)


def view_under_two_names(file, name, shape):
    view(file, "VTKHDF/PointData/a", shape, ".", name)
    file[name] = file["VTKHDF/PointData/a"]


def link_to_view(file, name, shape):
    view(file, "VTKHDF/PointData/a", shape, ".", name)
    file[name] = h5py.SoftLink("/VTKHDF/PointData/a")


def packed(file, name, shape):
    file.create_dataset(name, (10**12, 3), "f8", chunks=(10**4, 3), compression="gzip")


def texts(file, name, shape):
    file.create_dataset(name, data=np.array(["a" * 10**6, *[""] * 1000], object), dtype=h5py.string_dtype())


def many(file, name, shape):
    for number in range(10_001):
        file.create_group(f"g{number}")


HOSTILE = {
    "external storage": elsewhere,
    "an external link": lambda file, name, shape: file.__setitem__(name, h5py.ExternalLink("secret.h5", "/x")),
    "a soft link": lambda file, name, shape: file.__setitem__(name, h5py.SoftLink("/VTKHDF/Points")),
    "a view of another file": view,
    "a view of itself": lambda file, name, shape: view(file, name, shape, ".", name),
    "a view under two names": view_under_two_names,
    "a link to a view": link_to_view,
    "more numbers than the file": lambda file, name, shape: file.create_dataset(name, (10**12, 3), "f8"),
    "packed numbers": packed,
    "too many groups": many,
}
"""What is put in the place of an array."""


def spoil(path, name, kind):
    with h5py.File(path, "r+") as file:
        item = file[name]
        shape, attributes = item.shape, dict(item.attrs)
        del file[name]
        HOSTILE[kind](file, name, shape)
        if isinstance(file.get(name, getlink=True), h5py.HardLink):
            file[name].attrs.update({key: attributes[key] for key in ("unit", "description") if key in attributes})


@pytest.fixture
def beside(tmp_path, monkeypatch):
    """A folder with the files that a stranger would like to read."""
    monkeypatch.chdir(tmp_path)
    (tmp_path / "secret.bin").write_bytes(np.full(10**6, SECRET).tobytes())
    with h5py.File(tmp_path / "secret.h5", "w") as file:
        file["x"] = np.full(10**6, SECRET)
    return tmp_path


@pytest.mark.parametrize("kind", HOSTILE)
def test_a_record_reads_nothing_outside(beside, kind):
    path = beside / "a.h5"
    write_record(path, made_up_run.run().record)
    spoil(path, "volume", kind)
    path.write_bytes(sealed(path.read_bytes()))
    with pytest.raises(StudyError) as problem:
        read_record(path)
    assert "\n" not in str(problem.value) and "a.h5" in str(problem.value)


def test_texts_do_not_grow_in_memory(beside):
    path = beside / "a.h5"
    write_record(path, made_up_run.run().record)
    with h5py.File(path, "r+") as file:
        texts(file, "more", ())
    path.write_bytes(sealed(path.read_bytes()))
    with pytest.raises(StudyError, match="1001 texts of up to 1000000 letters"):
        read_record(path)


@pytest.mark.parametrize("kind", HOSTILE)
def test_neither_does_an_entry(beside, kind):
    path = beside / "a.vtkhdf"
    with h5py.File(path, "w") as file:
        root = file.create_group(VIEWS)
        root.attrs.update({"Version": (2, 0), "Type": np.bytes_("UnstructuredGrid")})
        root["Points"], root["NumberOfPoints"] = np.zeros((8, 3)), np.array([4])
        root["Steps/Values"], root["Steps/PointOffsets"] = np.array([0.5, 1.0]), np.array([0, 4])
        root.create_group("PointData")
    assert read_handed(path).positions.shape == (2, 4, 3)
    spoil(path, "VTKHDF/Points", kind)
    with pytest.raises(StudyError) as problem:
        read_handed(path)
    assert "\n" not in str(problem.value) and "a.vtkhdf" in str(problem.value)


@pytest.mark.parametrize(
    ("name", "change"),
    [
        ("triangles", lambda nodes: nodes + 10**6),
        ("tetrahedra", lambda nodes: nodes - 5000),
        ("rest", lambda x: x * np.inf),
        ("snapshots", lambda x: x * np.nan),
    ],
)
def test_a_record_numbers_what_it_has(tmp_path, name, change):
    path = tmp_path / "a.h5"
    write_record(path, made_up_run.run().record)
    with h5py.File(path, "r+") as file:
        file[name][...] = change(file[name][()])
    path.write_bytes(sealed(path.read_bytes()))
    with pytest.raises(StudyError, match=f"a.h5 holds '{name}'"):
        read_record(path)


@pytest.mark.parametrize("key", ["[1]", "{", '{"a":' * 5000 + "1" + "}" * 5000])
def test_a_case_is_an_object(tmp_path, key):
    path = tmp_path / "a.h5"
    write_record(path, made_up_run.run().record)
    with h5py.File(path, "r+") as file:
        file.attrs["key"] = key
    path.write_bytes(sealed(path.read_bytes()))
    with pytest.raises(StudyError, match=r"the case in .*a.h5 is no JSON"):
        read_record(path)


@pytest.mark.parametrize("read", [read_record, read_handed, read_entry_file, read_mesh])
def test_a_pipe_is_no_file(tmp_path, read):
    for suffix in (".h5", ".vtkhdf", ".npz", ".json", ".stl"):
        os.mkfifo(tmp_path / f"a{suffix}")
        with pytest.raises(StudyError):
            read(tmp_path / f"a{suffix}")


GLTF = """{"asset": {"version": "2.0"}, "buffers": [{"uri": "NAME", "byteLength": 36}],
"bufferViews": [{"buffer": 0, "byteLength": 36}], "scenes": [{"nodes": [0]}], "nodes": [{"mesh": 0}],
"accessors": [{"bufferView": 0, "componentType": 5126, "count": 3, "type": "VEC3"}],
"meshes": [{"primitives": [{"attributes": {"POSITION": 0}}]}]}"""
XDMF = '<Xdmf><Domain><Grid><Geometry><DataItem Format="&#72;DF">NAME:/x</DataItem></Geometry></Grid></Domain></Xdmf>'
PVD = '<VTKFile><Collection><DataSet timestep="0" file="NAME"/></Collection></VTKFile>'
NAMING = {"a.gltf": (read_mesh, GLTF), "a.xdmf": (read_mesh, XDMF), "a.pvd": (read_handed, PVD)}


@pytest.mark.parametrize("named", ["/etc/passwd", "../secret.bin", "link/secret.bin", "pipe"])
@pytest.mark.parametrize("file", NAMING)
def test_a_file_names_files_of_its_folder_alone(beside, file, named):
    folder, (read, text) = beside / "given", NAMING[file]
    folder.mkdir()
    (folder / "link").symlink_to(beside)
    os.mkfifo(folder / "pipe")
    (folder / file).write_text(text.replace("NAME", named))
    with pytest.raises(StudyError, match=r"in the folder of|no reader knows its ending"):
        read(folder / file)


def test_an_hdf5_file_behind_other_bytes_is_no_mesh(tmp_path):
    with h5py.File(tmp_path / "a.h5m", "w", userblock_size=512) as file:
        file["x"] = 1
    with pytest.raises(StudyError, match="it is an HDF5 file"):
        read_mesh(tmp_path / "a.h5m")


def test_deep_text_of_an_entry_is_one_sentence(tmp_path):
    (tmp_path / "a.json").write_text('{"a":' * 5000 + "1" + "}" * 5000)
    with pytest.raises(StudyError, match="cannot be read as an entry"):
        read_entry_file(tmp_path / "a.json")
