"""Our own run, handed in as another program would, is judged as our own run is."""

import shutil
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from massspring import Sphere
from studies.exchange import judge as module
from studies.exchange.description import OURS, judged_metrics
from studies.exchange.entry import entries_beside, entry_files, run_of_entry
from studies.exchange.judge import entry_record
from studies.exchange.meshes import CURVED, given_mesh
from studies.metrics.metrics import METRICS
from studies.metrics.run import Run
from studies.runs.run import measure
from studies.store.record import Status, read_record
from tests.studies.exchange.handed_in import CASE, NODES
from tests.studies.octant import SCENE

NEAR = 1e-12


@pytest.fixture
def results(solved, tmp_path):
    return shutil.copytree(solved, tmp_path / "results")


def judged(path, **options) -> Run:
    return run_of_entry(entry_record(SCENE, path, "theirs", NODES, **options), None)


def test_our_own_run_gets_the_same_metrics(ours, reference, tmp_path):
    own = Run(CASE, measure(CASE), reference)
    entry = run_of_entry(entry_record(SCENE, ours.npz(tmp_path / "a.npz"), "theirs", NODES), reference)
    compared = [metric for metric in METRICS if metric.name not in OURS and metric(own) == metric(own)]
    assert {"force_end", "force_error", "silhouette_error", "volume_worst", "min_j", "pressure_error", "sway"} <= {
        metric.name for metric in compared
    }
    for metric in compared:
        assert metric(entry) == pytest.approx(metric(own), rel=NEAR, abs=0), metric.name
        assert metric.uncertainty(entry) == pytest.approx(metric.uncertainty(own), rel=NEAR, nan_ok=True)


def test_tables_and_charts_show_an_entry_and_ours(organbench, refused, ours, reference, results, scene_file, tmp_path):
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
    expected = metric(run_of_entry(read_record(stored), reference))
    assert float(row.split()[1].replace("−", "-")) == pytest.approx(expected, abs=0.6)
    study = tmp_path / "mine.py"
    study.write_text(
        "from studies import Case, Chart, Free, Study\nfrom tests.studies.exchange.handed_in import CASE\n"
        "CHARTS = (Chart('front.png', 'studies.plots.work_precision:draw'),)\n"
        "STUDY = Study('mine', '?', (CASE,), CHARTS, ('force_end', 'real_time'))\n"
    )
    code, out, err = organbench("table", study, "--results", results)
    (row,) = [line for line in out.splitlines() if "theirs" in line]
    assert "force" in out and row.split()[-1] == "4"  # simulated seconds per second
    organbench("report", study, "--results", results)
    assert "theirs" in (results / "mine" / "mine.csv").read_text()
    front = (results / "mine" / "front.png").read_bytes()
    organbench("judge", scene_file, path, *options[:-1], 2.5)
    organbench("report", study, "--results", results)
    assert (results / "mine" / "front.png").read_bytes() != front  # drawn again: it has become slower
    runs, problems = entries_beside(results, [SCENE], lambda scene: None)
    assert [run.case.method.name for run in runs] == ["theirs"] and not problems
    assert "is a result of another program: only that program" in refused("replay", stored)


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


@pytest.mark.parametrize(("height", "status"), [(0.0, Status.TUNNELLED), (0.07, Status.OK)])
def test_an_entry_with_a_sphere_inside_says_so(ours, tmp_path, height, status):
    """A sphere of 20 mm in the middle of the ball and above it, in positions that follow no force."""
    scene = replace(SCENE, obstacles=(Sphere((0.0, 0.0, height), 0.02),))
    record = entry_record(scene, ours.npz(tmp_path / "a.npz"), "theirs", NODES)
    assert record.status == status
    depth = record.fields["penetration"].values[0, 0]
    assert depth == pytest.approx(0.02 + 0.05 if height == 0.0 else 0.0, abs=3e-3)


@pytest.mark.parametrize(("share", "status"), [(0.003, Status.OK), (0.02, Status.TUNNELLED)])
def test_an_entry_that_passes_through_itself_says_so(ours, tmp_path, monkeypatch, share, status):
    monkeypatch.setattr(module, "crossed", lambda *where: share)
    record = entry_record(SCENE, ours.npz(tmp_path / "a.npz"), "theirs", NODES)
    said = record.message or record.attributes["warnings"]
    assert record.status == status and f"up to {100 * share:g} % of the surface lies inside the body" in said


@pytest.mark.parametrize(("height", "status"), [(0.05, Status.FOLDED), (-1.0, Status.INVERTED)])
def test_an_entry_that_folds_on_its_way_says_so(ours, tmp_path, height, status):
    x = ours.positions.copy()
    x[1] = ours.positions[0] * [1.0, 1.0, height]
    record = judged(ours.npz(tmp_path / "a.npz", positions=x)).record
    assert record.status == status and f"in 1 of {len(x) - 1} frames (least J {height:g};" in record.message


def test_without_its_reference_nothing_but_errors_is_left_out(organbench, ours, scene_file, tmp_path):
    path = ours.npz(tmp_path / "a.npz")
    code, out, err = organbench("judge", scene_file, path, "--nodes", NODES, "--results", tmp_path / "none")
    assert code == 0 and "errors are not judged, because the reference is missing" in err
    assert "volume_worst" in out and "force_end" not in out and "report.html: next to our methods" in out


def test_a_force_of_the_other_sign_or_unit_is_named_and_ours_is_not(organbench, ours, scene_file, results, tmp_path):
    for factor, named in ((-1, "wrong sign"), (1e3, "force in mN? "), (1e-3, "force in kN? "), (1, "")):
        path = ours.npz(tmp_path / "a.npz", force=factor * ours.force)
        code, out, err = organbench("judge", scene_file, path, "--nodes", NODES, "--results", results)
        hints = [hint for hint in ("wrong sign", "force in mN? ", "force in kN? ") if hint in err]
        assert code == 0 and hints == [named] * bool(named), err
    own = next(line.split()[1] for line in out.splitlines() if "force_end" in line)
    assert f"is {own}" not in err


def test_the_starter_of_an_export_runs_and_is_accepted_as_a_body_that_did_not_move(
    organbench, scene_file, results, tmp_path
):
    folder = tmp_path / "exported"
    code, _, err = organbench("export", scene_file, "-o", folder, "--nodes", NODES, "--results", results)
    assert code == 0, err
    subprocess.run([sys.executable, folder / "solve.py"], check=True, cwd=tmp_path)
    words = ("judge", scene_file, folder / "mine.npz", "--nodes", NODES, "--results", results)
    code, out, err = organbench(*words)
    assert code == 0 and out.startswith("mine: ok, 188 nodes of the straight mesh, 2 steps")
    assert err.splitlines() == ["warning: the body did not move"]
    assert len([line for line in (folder / "solve.py").read_text().splitlines() if line]) <= 25


OPTIONS = {
    "'free' is a method of this program": (True, "--name", "free"),
    "'a/b' cannot name an entry": (True, "--name", "a/b"),
    "give a positive number": (True, "--seconds", -1),
    "a.npz already has the force; leave out force.csv": (True, "--force", "force.csv"),
    "force.csv has no force at t = 0.1, 0.2": (False, "--force", "force.csv"),
    "there is no file": (False, "--force", "none.csv"),
}


@pytest.mark.parametrize("message", OPTIONS)
def test_names_times_and_forces_that_are_none_are_refused(refused, ours, scene_file, tmp_path, monkeypatch, message):
    monkeypatch.chdir(tmp_path)
    Path("force.csv").write_text("t,force\n0,0\n")
    has_force, *options = OPTIONS[message]
    path = ours.npz(tmp_path / "a.npz", **({} if has_force else {"force": None}))
    assert message in refused("judge", scene_file, path, "--nodes", NODES, *options)
