"""Our own run, handed in as another program would, is judged as our own run is; what does not fit is refused."""

import shutil

import h5py
import meshio
import numpy as np
import pytest

from massspring import ImplicitVolume, simulate
from studies.exchange.description import judged_metrics
from studies.exchange.entry import entries_beside, entry_files, run_of_entry
from studies.exchange.judge import entry_record
from studies.exchange.meshes import CURVED, given_mesh
from studies.metrics.metrics import METRICS
from studies.metrics.run import Run
from studies.runs.case import BodyRecipe, Case
from studies.runs.prepare import prepare
from studies.runs.run import measure
from studies.store.record import Status, read_record
from tests.studies.octant import SCENE

NODES, FRAMES = 150, 40
NEAR = 1e-12
CASE = Case(SCENE, BodyRecipe(nodes=NODES), ImplicitVolume(), frames=FRAMES)
TEXT = "from tests.studies.octant import SCENE\n"


class HandedIn:
    """What a program has computed: steps from t = 0 on."""

    def __init__(self, t, positions, force, pressure):
        self.t, self.positions, self.force, self.pressure = t, positions, force, pressure

    def npz(self, path, **changes):
        data = {"t": self.t, "positions": self.positions, "force": self.force, "pressure": self.pressure} | changes
        np.savez(path, **{name: values for name, values in data.items() if values is not None})
        return path

    def with_positions(self, path, positions):
        return self.npz(path, positions=positions)


@pytest.fixture(scope="module")
def ours(mesh_cache):
    """Every frame of our own run."""
    prepared = prepare(CASE)
    history = simulate(prepared.setup, range(1, FRAMES + 1))
    return HandedIn(
        np.concatenate([[0.0], history.t]),
        np.concatenate([prepared.setup.body.rest[None], history.snapshots]),
        np.concatenate([[0.0], SCENE.output_force(history.contact_force, history.held_force)]),
        np.concatenate([[0.0], history.pressure[:, 0]]),
    )


@pytest.fixture
def results(solved, tmp_path):
    return shutil.copytree(solved, tmp_path / "results")


@pytest.fixture
def scene_file(tmp_path):
    path = tmp_path / "octant_scene.py"
    path.write_text(TEXT)
    return path


def judged(path, **options) -> Run:
    return run_of_entry(entry_record(SCENE, path, "theirs", NODES, **options), None)


def test_our_own_run_gets_the_same_metrics(ours, found, tmp_path):
    own = Run(CASE, measure(CASE), found)
    entry = run_of_entry(entry_record(SCENE, ours.npz(tmp_path / "a.npz"), "theirs", NODES), found)
    compared = [metric for metric in METRICS if metric.name not in ("alternation",) and metric(own) == metric(own)]
    assert {"force_end", "force_error", "silhouette_error", "volume_worst", "min_j", "pressure_error", "sway"} <= {
        metric.name for metric in compared
    }
    for metric in compared:
        assert metric(entry) == pytest.approx(metric(own), rel=NEAR, abs=0), metric.name
        assert metric.uncertainty(entry) == pytest.approx(metric.uncertainty(own), rel=NEAR, nan_ok=True)


def as_vtu(ours, folder, moved=False):
    """A VTU file for each checkpoint, and one at rest."""
    folder.mkdir()
    wanted = [int(np.argmin(np.abs(ours.t - t))) for t in (0.0, *SCENE.checkpoints)]
    for number, step in enumerate(wanted):
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
    "CSV": (lambda ours, folder: as_csv(ours, folder / "a.csv"), 40, 0.0),
    "VTKHDF": (lambda ours, folder: as_vtkhdf(ours, folder / "a.vtkhdf"), 40, 0.0),
    "VTKHDF that stands still": (lambda ours, folder: as_vtkhdf(ours, folder / "b.vtkhdf", True), 40, 1e-16),
    "VTU": (lambda ours, folder: as_vtu(ours, folder / "a"), 2, 0.0),
    "VTU that stands still": (lambda ours, folder: as_vtu(ours, folder / "a", True), 2, 1e-16),
    "pattern": (lambda ours, folder: as_vtu(ours, folder / "a") / "step*.vtu", 2, 0.0),
    "PVD": (lambda ours, folder: as_pvd(ours, folder / "a"), 2, 0.0),
}


@pytest.mark.parametrize("form", FORMS)
def test_every_form_holds_the_same_positions(ours, tmp_path, form):
    write, steps, near = FORMS[form]
    run = judged(write(ours, tmp_path))
    assert run.record.attributes["frames"] == steps
    expected = judged(ours.npz(tmp_path / "a.npz"))
    assert np.abs(run.field("snapshots") - expected.field("snapshots")).max() <= near
    assert np.isnan(run.force).all()  # they hold none


def wrong(ours, which):
    x = ours.positions.copy()
    if which == "nan":
        x[7, 5, 1] = np.nan
    elif which == "permuted":
        x[:, [3, 9]] = x[:, [9, 3]]
    elif which == "both":
        x = 1e3 * x[:, ::-1]
    return {"mm": 1e3 * x, "inch": x / 0.0254, "moved": x + 0.002, "few": x[:, :-1], "flat": x[..., :2]}.get(which, x)


POSITIONS = {
    "mm": "the rest positions are those of straight.vtu in millimetres; hand them in in metres",
    "inch": "those of straight.vtu in inches",
    "both": "those of straight.vtu in millimetres",
    "permuted": "the nodes are those of straight.vtu in another order (number 3 is its number 9)",
    "moved": "the positions at t = 0 are up to 0.00346 m from those of straight.vtu",
    "few": "positions of 187 nodes, but straight.vtu 188 and curved.vtu 1112 at this number of vertices",
    "nan": "positions of node 5 at t = 0.7 s is not a finite number",
    "flat": "positions have shape (41, 188, 2); they must be (steps, nodes, 3)",
}


@pytest.mark.parametrize("which", POSITIONS)
def test_positions_that_do_not_fit_are_refused_with_the_reason(refused, ours, scene_file, tmp_path, which):
    path = ours.with_positions(tmp_path / "a.npz", wrong(ours, which))
    told = refused("judge", scene_file, path, "--nodes", NODES, "--results", tmp_path / "none")
    assert POSITIONS[which] in told
    assert not (tmp_path / "none").exists()


HISTORIES = {
    "missing steps": (lambda o: {"t": o.t[:30], "positions": o.positions[:30]}, "steps are missing at t = 4 s"),
    "no rest": (lambda o: {"t": o.t[1:], "positions": o.positions[1:]}, "missing at t = 0 s (t = 0 is the rest shape)"),
    "milliseconds": (lambda o: {"t": 1e3 * o.t}, "the times go to 4000, the scene to 4 s: give seconds, not ms"),
    "descending": (lambda o: {"t": o.t[::-1]}, "must be numbers that ascend"),
    "no times": (lambda o: {"t": None}, "a.npz lacks 't'"),
    "short force": (lambda o: {"force": o.force[:-1]}, "force has shape (40,) for 41 steps"),
    "force nan": (lambda o: {"force": np.where(o.t == 2.0, np.nan, o.force)}, "force at t = 2 s is not a finite"),
    "other times": (lambda o: {"t": o.t[:5]}, "41 steps for 5 times"),
}


@pytest.mark.parametrize("what", HISTORIES)
def test_times_and_forces_that_do_not_fit_are_refused(refused, ours, scene_file, tmp_path, what):
    change, told = HISTORIES[what]
    short = {"force": None, "pressure": None} if "positions" in change(ours) else {}
    path = ours.npz(tmp_path / "a.npz", **short | change(ours))
    assert told in refused("judge", scene_file, path, "--nodes", NODES, "--results", tmp_path / "none")


FILES = {
    "a.txt": ("", "entries are read from .npz, .csv, .vtkhdf, .hdf, .pvd or a folder of .vtu files"),
    "a.npz": ("no zip", "a.npz is no npz file; numpy.savez writes one"),
    "a.vtkhdf": ("no HDF5", "a.vtkhdf cannot be read"),
    "a.pvd": ("<VTKFile>", "a.pvd cannot be read"),
    "a.csv": ("t,node,x,y\n0,0,0,0\n", "a.csv lacks the column 'z'"),
    "b.csv": ("t,node,x,y,z\n0,1,0,0,0\n0,2,0,0,0\n", "nodes are numbered 1 to 2; number them from 0 on"),
    "c.csv": ("t,node,x,y,z\n0,0,0,0,0\n0,1,0,0,0\n1,0,0,0,0\n", "step t = 1 s has 1 nodes, others have 2"),
    "d.csv": ("t,node,x,y,z\n0,0,zero,0,0\n", "d.csv cannot be read as a table"),
}


@pytest.mark.parametrize("name", FILES)
def test_a_file_that_is_none_is_refused(refused, scene_file, tmp_path, name):
    content, told = FILES[name]
    (tmp_path / name).write_text(content)
    assert told in refused("judge", scene_file, tmp_path / name, "--nodes", NODES)
    assert "there is no file" in refused("judge", scene_file, tmp_path / "none.npz")


def test_names_and_times_that_are_none_are_refused(refused, ours, scene_file, tmp_path):
    path = ours.npz(tmp_path / "a.npz")
    options = ("judge", scene_file, path, "--nodes", NODES, "--results", tmp_path / "none")
    assert "'free' is a method of this program" in refused(*options, "--name", "free")
    assert "'a/b' cannot name an entry" in refused(*options, "--name", "a/b")
    assert "give a positive number" in refused(*options, "--seconds", -1)
    force = tmp_path / "force.csv"
    force.write_text("t,force\n0,0\n")
    assert "a.npz holds the force already; leave force.csv out" in refused(*options, "--force", force)
    path = ours.npz(tmp_path / "a.npz", force=None)
    assert "force.csv has no force at t = 0.1, 0.2" in refused(*options, "--force", force)


def test_an_entry_stands_in_tables_and_charts_beside_ours(organbench, ours, found, results, scene_file, tmp_path):
    force = tmp_path / "force.csv"
    force.write_text(
        "t,force\n" + "\n".join(f"{float(t)!r},{float(f)!r}" for t, f in zip(ours.t, ours.force, strict=True))
    )
    path = ours.npz(tmp_path / "a.npz", force=None)
    options = ("--nodes", NODES, "--results", results, "--name", "theirs", "--force", force, "--seconds", 0.25)
    code, out, err = organbench("judge", scene_file, path, *options)
    assert code == 0 and not err and "theirs: ok, 188 nodes of the straight mesh, 40 steps" in out
    (stored,) = entry_files(results)
    (row,) = [line for line in out.splitlines() if "force_end" in line]
    metric = next(m for m in judged_metrics(SCENE) if m.name == "force_end")
    expected = metric(run_of_entry(read_record(stored), found))
    assert float(row.split()[1].replace("−", "-")) == pytest.approx(expected, abs=0.6)
    study = tmp_path / "mine.py"
    study.write_text(
        "from studies import Case, Chart, Free, Study\nfrom tests.studies.exchange.test_judge import CASE\n"
        "CHARTS = (Chart('front.png', 'studies.plots.work_precision:draw'),)\n"
        "STUDY = Study('mine', '?', (CASE,), CHARTS, ('force_end', 'real_time'))\n"
    )
    code, out, err = organbench("table", study, "--results", results)
    (row,) = [line for line in out.splitlines() if "theirs" in line]
    assert "force" in out and row.split()[-1] == "4"  # simulated seconds per second
    organbench("plot", study, "--results", results)
    assert "theirs" in (results / "mine" / "mine.csv").read_text()
    front = (results / "mine" / "front.png").read_bytes()
    organbench("judge", scene_file, path, *options[:-1], 2.5)
    organbench("plot", study, "--results", results)
    assert (results / "mine" / "front.png").read_bytes() != front  # drawn again: it has become slower
    runs, problems = entries_beside(results, [SCENE], lambda scene: None)
    assert [run.case.method.name for run in runs] == ["theirs"] and not problems


def test_an_entry_on_the_curved_mesh_is_measured_there(ours, mesh_cache, tmp_path):
    mesh = given_mesh(SCENE, NODES, CURVED)
    squeezed = mesh.points * [1.0, 1.0, 0.9]
    t = np.array([0.0, *SCENE.checkpoints])
    np.savez(tmp_path / "a.npz", t=t, positions=np.stack([mesh.points, squeezed, squeezed]))
    run = judged(tmp_path / "a.npz")
    assert run.case.body.kind == "quadratic" and run.record.status == Status.OK
    assert run.volume_ratio == pytest.approx(0.9) and run.field("min_j") == pytest.approx(0.9)
    reach = 0.9 * np.array([mesh.points[:, 2].max(), -mesh.points[:, 2].min()])
    assert run.field("penetration")[1] == pytest.approx(reach - 0.05 * (1 - 0.3), rel=1e-6)


def test_an_entry_cannot_be_replayed(organbench, refused, ours, scene_file, tmp_path):
    path = ours.npz(tmp_path / "a.npz")
    organbench("judge", scene_file, path, "--nodes", NODES, "--results", tmp_path / "r")
    (stored,) = entry_files(tmp_path / "r")
    assert "is an entry from outside: only the program that made it" in refused("replay", stored)


def test_an_entry_inside_out_says_so(ours, tmp_path):
    x = ours.positions.copy()
    x[-1] *= [1.0, 1.0, -1.0]
    assert judged(ours.with_positions(tmp_path / "a.npz", x)).record.status == Status.INVERTED


def test_without_its_reference_nothing_but_errors_is_left_out(organbench, ours, scene_file, tmp_path):
    path = ours.npz(tmp_path / "a.npz")
    code, out, err = organbench("judge", scene_file, path, "--nodes", NODES, "--results", tmp_path / "none")
    assert code == 0 and "no errors are judged, the reference is not there" in err
    assert "volume_worst" in out and "force_end" not in out
