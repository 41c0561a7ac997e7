"""Every form in which positions are handed in holds the same ones; a file of another kind is refused."""

import h5py
import meshio
import numpy as np
import pytest

from studies.base.errors import StudyError
from studies.exchange.handed import read_handed
from tests.studies.octant import SCENE


def as_vtu(ours, folder, moved=False):
    """A VTU file for each checkpoint, and one at rest."""
    folder.mkdir()
    steps = [int(np.argmin(np.abs(ours.t - t))) for t in (0.0, *SCENE.checkpoints)]
    for number, step in enumerate(steps):
        x = ours.positions[step]
        data = {"displacement": x - ours.positions[0]} if moved else {}
        points = ours.positions[0] if moved else x
        meshio.write(folder / f"step{number:02d}.vtu", meshio.Mesh(points, [("vertex", [[0]])], data))
    return folder


def as_pvd(ours, folder):
    as_vtu(ours, folder)
    steps = reversed(list(enumerate((0.0, *SCENE.checkpoints))))
    sets = [f'<DataSet timestep="{t}" file="step{k:02d}.vtu"/>' for k, t in steps]
    path = folder / "all.pvd"
    path.write_text(f'<VTKFile type="Collection"><Collection>{"".join(sets)}</Collection></VTKFile>')
    return path


def as_csv(ours, path):
    rows = [
        f"{float(t)!r},{i},{','.join(repr(float(c)) for c in p)}"
        for t, x in zip(ours.t, ours.positions, strict=True)
        for i, p in enumerate(x)
    ]
    path.write_text("\n".join(["t,node,x,y,z", *reversed(rows)]))
    return path


def as_vtkhdf(ours, path, moved=False):
    steps, n, _ = ours.positions.shape
    with h5py.File(path, "w") as file:
        root = file.create_group("VTKHDF")
        root["NumberOfPoints"] = np.array([n])
        root["Points"] = ours.positions[0] if moved else ours.positions.reshape(-1, 3)
        root["Steps/Values"] = ours.t
        root["Steps/PointOffsets"] = np.zeros(steps, int) if moved else n * np.arange(steps)
        if moved:
            root["PointData/displacement"] = (ours.positions - ours.positions[0]).reshape(-1, 3)
            root["Steps/PointDataOffsets/displacement"] = n * np.arange(steps)
    return path


FORMS = {
    "CSV": (lambda ours, folder: as_csv(ours, folder / "a.csv"), 41, 0.0),
    "VTKHDF": (lambda ours, folder: as_vtkhdf(ours, folder / "a.vtkhdf"), 41, 0.0),
    "VTKHDF that stands still": (lambda ours, folder: as_vtkhdf(ours, folder / "b.vtkhdf", True), 41, 1e-16),
    "VTU": (lambda ours, folder: as_vtu(ours, folder / "a"), 3, 0.0),
    "VTU that stands still": (lambda ours, folder: as_vtu(ours, folder / "a", True), 3, 1e-16),
    "pattern": (lambda ours, folder: as_vtu(ours, folder / "a") / "step*.vtu", 3, 0.0),
    "PVD": (lambda ours, folder: as_pvd(ours, folder / "a"), 3, 0.0),
}


@pytest.mark.parametrize("form", FORMS)
def test_every_form_holds_the_same_positions(ours, tmp_path, form):
    write, steps, near = FORMS[form]
    found, expected = (read_handed(path) for path in (write(ours, tmp_path), ours.npz(tmp_path / "z.npz")))
    assert len(found.positions) == steps and not found.histories and {*expected.histories} == {"force", "pressure"}
    times = expected.t if steps == len(ours.t) else np.array([0.0, *SCENE.checkpoints])
    assert found.t is None or np.array_equal(found.t, times)
    rows = [int(np.argmin(np.abs(expected.t - t))) for t in times]
    assert np.abs(found.positions - expected.positions[rows]).max() <= near


MANY = "t,node,x,y,z\n0,0,0,0,0\n1,0,0,0,0\n1,1,0,0,0\n2,0,0,0,0\n"
FILES = {
    "a.txt": ("", "entries are read from .npz, .csv, .vtkhdf, .hdf, .pvd or a folder of .vtu files"),
    "a.npz": ("no zip", "a.npz is no npz file, or was cut off; numpy.savez writes one"),
    "a.vtkhdf": ("no HDF5", "a.vtkhdf cannot be read"),
    "a.pvd": ("<VTKFile>", "a.pvd cannot be read"),
    "a.csv": ("t,node,x,y\n0,0,0,0\n", "a.csv lacks the column 'z'"),
    "b.csv": ("t,node,x,y,z\n0,1,0,0,0\n0,2,0,0,0\n", "nodes are numbered 1 to 2; number them from 0 on"),
    "c.csv": ("t,node,x,y,z\n0,0,0,0,0\n0,1,0,0,0\n1,0,0,0,0\n", "step t = 1 s has 1 nodes, others have 2"),
    "h.csv": ("t,node,x,y,z\n0,0,0,0,0\n0,0,0,0,0\n1,0,0,0,0\n", "h.csv: node 0 has several rows at t = 0 s; give one"),
    "i.csv": ("t,node,x,y,z\n", "i.csv holds no rows; it needs one for each node and step"),
    "j.csv": (MANY, "step t = 1 s has 2 nodes, others have 1"),
    "e.csv": ("t;node;x;y;z\n0;0;0,5;0;0\n", "e.csv has semicolons between its columns and commas in its numbers"),
    "f.csv": ("t;node;x;y;z\n0;0;0.5;0;0\n", "semicolons between its columns: write commas between columns and points"),
    "g.csv": ("t,node,x,y,z\n0,0,0,5,0,1,0,0\n", "g.csv has commas in its numbers"),
    "d.csv": ("t,node,x,y,z\n0,0,zero,0,0\n", "d.csv cannot be read as a table"),
}


@pytest.mark.parametrize("name", FILES)
def test_a_file_that_is_none_is_refused(tmp_path, name):
    content, message = FILES[name]
    (tmp_path / name).write_text(content)
    with pytest.raises(StudyError) as refused:
        read_handed(tmp_path / name)
    assert message in str(refused.value)


def test_files_whose_order_is_not_that_of_their_numbers_are_refused(ours, tmp_path):
    folder = as_vtu(ours, tmp_path / "a")
    files = sorted(folder.glob("*.vtu"))
    for number, file in zip((2, 9, 10), files, strict=True):
        file.rename(folder / f"step_{number}.vtu")
    with pytest.raises(StudyError, match=r"a: is step_2\.vtu before or after step_10\.vtu\? Write their numbers"):
        read_handed(folder)
    (folder / "step_10.vtu").rename(folder / "step_11a.vtu")
    (folder / "step_11a.vtu").rename(folder / "step_91.vtu")
    assert len(read_handed(folder).positions) == 3


def test_a_missing_file_and_one_with_a_flipped_byte_are_refused(ours, tmp_path):
    path = ours.npz(tmp_path / "a.npz")
    data = bytearray(path.read_bytes())
    data[len(data) // 2] ^= 0xFF
    path.write_bytes(data)
    with pytest.raises(StudyError, match=r"a\.npz cannot be read"):
        read_handed(path)
    with pytest.raises(StudyError, match="there is no file"):
        read_handed(tmp_path / "none.npz")


def test_an_npz_that_promises_too_much_is_not_unpacked(tmp_path):
    """2.4 GB of zeros pack to 2.4 MB; here the directory of the zip alone says so."""
    path = tmp_path / "a.npz"
    np.savez(path, t=np.zeros(1), positions=np.zeros((1, 1, 3)))
    content = path.read_bytes()
    entry = content.rindex(b"PK\x01\x02")
    path.write_bytes(content[: entry + 24] + (2_400_000_000).to_bytes(4, "little") + content[entry + 28 :])
    with pytest.raises(
        StudyError, match=r"a\.npz holds 2\.4 GB unpacked; at most 2 GB are read: hand in the checkpoints"
    ):
        read_handed(path)
