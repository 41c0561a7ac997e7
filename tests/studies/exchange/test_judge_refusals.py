"""An entry that does not fit is refused with the reason, and nothing is written."""

import numpy as np
import pytest

from tests.studies.exchange.handed_in import NODES


def wrong(ours, which):
    x = ours.positions.copy()
    if which == "nan":
        x[7, 5, 1] = np.nan
    elif which == "permuted":
        x[:, [3, 9]] = x[:, [9, 3]]
    elif which == "both":
        x = 1e3 * x[:, ::-1]
    elif which == "steps in mm":
        x[1:] *= 1e3
    elif which == "burst":
        x[9, 5, 1] = 1e300
    return {
        "mm": 1e3 * x,
        "inch": x / 0.0254,
        "moved": x + 0.002,
        "few": x[:, :-1],
        "displacements": x - x[0],
        "flat": x[..., :2],
        "complex": x + 0.0j,
    }.get(which, x)


POSITIONS = {
    "mm": "the rest positions are those of straight.vtu in millimetres; hand them in in metres",
    "inch": "those of straight.vtu in inches",
    "both": "those of straight.vtu in millimetres",
    "permuted": "the nodes are those of straight.vtu in another order (number 3 is its number 9)",
    "moved": "the positions at t = 0 are up to 0.00346 m from those of straight.vtu",
    "displacements": "are all zero, so these are displacements; add the rest positions of straight.vtu",
    "few": "positions of 187 nodes, but straight.vtu 188 and curved.vtu 1112 at this number of vertices",
    "nan": "positions of node 5 at t = 0.7 s is not a finite number",
    "steps in mm": "times the size of the body; hand in all steps in metres",
    "burst": "a node at t = 0.9 s is 1e+300 m from its place at rest",
    "complex": "positions holds complex numbers",
    "flat": "positions have shape (41, 188, 2); they must be (steps, nodes, 3)",
}


@pytest.mark.parametrize("which", POSITIONS)
def test_positions_that_do_not_fit_are_refused_with_the_reason(refused, ours, scene_file, tmp_path, which):
    path = ours.with_positions(tmp_path / "a.npz", wrong(ours, which))
    sentence = refused("judge", scene_file, path, "--nodes", NODES, "--results", tmp_path / "none")
    assert POSITIONS[which] in sentence
    assert not (tmp_path / "none").exists()


HISTORIES = {
    "missing steps": (lambda o: {"t": o.t[:30], "positions": o.positions[:30]}, "steps are missing at t = 4 s"),
    "no rest": (lambda o: {"t": o.t[1:], "positions": o.positions[1:]}, "missing at t = 0 s (t = 0 is the rest shape)"),
    "milliseconds": (lambda o: {"t": 1e3 * o.t}, "the times go to 4000, the scene to 4 s: give seconds, not ms"),
    "descending": (lambda o: {"t": o.t[::-1]}, "must be increasing numbers"),
    "no times": (lambda o: {"t": None}, "a.npz lacks 't'"),
    "other names": (
        lambda o: {"t": None, "time": o.t, "x": o.positions},
        "a.npz lacks 't'; it needs t (F) and positions (F, n, 3), and holds positions, force, pressure, time, x",
    ),
    "short force": (lambda o: {"force": o.force[:-1]}, "force has shape (40,) for 41 steps"),
    "force nan": (lambda o: {"force": np.where(o.t == 2.0, np.nan, o.force)}, "force at t = 2 s is not a finite"),
    "no steps": (lambda o: {"t": o.t[:0], "positions": o.positions[:0]}, "a.npz holds no steps; hand in rest and"),
    "other times": (lambda o: {"t": o.t[:5]}, "41 steps for 5 times"),
}


@pytest.mark.parametrize("what", HISTORIES)
def test_times_and_forces_that_do_not_fit_are_refused(refused, ours, scene_file, tmp_path, what):
    change, message = HISTORIES[what]
    short = {"force": None, "pressure": None} if "positions" in change(ours) else {}
    path = ours.npz(tmp_path / "a.npz", **short | change(ours))
    assert message in refused("judge", scene_file, path, "--nodes", NODES, "--results", tmp_path / "none")


FILES = {
    "a.txt": ("", "entries are read from .npz, .csv, .vtkhdf, .hdf, .pvd or a folder of .vtu files"),
    "a.npz": ("no zip", "a.npz is not an npz file; numpy.savez writes one"),
    "a.vtkhdf": ("no HDF5", "a.vtkhdf cannot be read"),
    "a.pvd": ("<VTKFile>", "a.pvd cannot be read"),
    "a.csv": ("t,node,x,y\n0,0,0,0\n", "a.csv lacks the column 'z'"),
    "b.csv": ("t,node,x,y,z\n0,1,0,0,0\n0,2,0,0,0\n", "nodes are numbered 1 to 2; number them from 0 on"),
    "c.csv": ("t,node,x,y,z\n0,0,0,0,0\n0,1,0,0,0\n1,0,0,0,0\n", "step t = 1 s has 1 nodes, others have 2"),
    "e.csv": ("t;node;x;y;z\n0;0;0,5;0;0\n", "e.csv has semicolons between its columns and commas in its numbers"),
    "f.csv": ("t;node;x;y;z\n0;0;0.5;0;0\n", "semicolons between its columns: write commas between columns and points"),
    "g.csv": ("t,node,x,y,z\n0,0,0,5,0,1,0,0\n", "g.csv has commas in its numbers"),
    "d.csv": ("t,node,x,y,z\n0,0,zero,0,0\n", "d.csv cannot be read as a table"),
}


@pytest.mark.parametrize("name", FILES)
def test_a_file_that_is_none_is_refused(refused, scene_file, tmp_path, name):
    content, message = FILES[name]
    (tmp_path / name).write_text(content)
    assert message in refused("judge", scene_file, tmp_path / name, "--nodes", NODES)
    assert "there is no file" in refused("judge", scene_file, tmp_path / "none.npz")


def test_a_file_with_a_flipped_byte_is_refused(refused, ours, scene_file, tmp_path):
    path = ours.npz(tmp_path / "a.npz")
    data = bytearray(path.read_bytes())
    data[len(data) // 2] ^= 0xFF
    path.write_bytes(data)
    assert "a.npz cannot be read" in refused("judge", scene_file, path, "--nodes", NODES)


def test_names_and_times_that_are_none_are_refused(refused, ours, scene_file, tmp_path):
    path = ours.npz(tmp_path / "a.npz")
    options = ("judge", scene_file, path, "--nodes", NODES, "--results", tmp_path / "none")
    assert "'free' is a method of this program" in refused(*options, "--name", "free")
    assert "'a/b' cannot name an entry" in refused(*options, "--name", "a/b")
    assert "give a positive number" in refused(*options, "--seconds", -1)
    force = tmp_path / "force.csv"
    force.write_text("t,force\n0,0\n")
    assert "a.npz already has the force; leave out force.csv" in refused(*options, "--force", force)
    path = ours.npz(tmp_path / "a.npz", force=None)
    assert "force.csv has no force at t = 0.1, 0.2" in refused(*options, "--force", force)
