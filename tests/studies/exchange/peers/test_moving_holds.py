"""Regions that are held and move, and their forces: a cube between two plates, and a ball between two caps."""

import json
import os
import subprocess
from pathlib import Path

import meshio
import numpy as np
import pytest

from studies.exchange.entry import entries_beside
from studies.exchange.export import export
from studies.exchange.peers.contest import PEERS, Attempt, contest
from studies.exchange.peers.scene_folder import SceneFolder, gap, moved
from studies.metrics.table import study_table
from studies.reference.load import reference_for
from studies.scene.library import BALL_CLAMPED, LIVER_PROBE
from studies.store.record import Status
from tests.studies.exchange.peers.test_contest import ENVIRONMENTS

SIDE, MU, POISSON, PRESSED = 0.1, 1800.0, 0.4, 1e-3
"""[m], [Pa], [1], and how far the top plate goes down [m]."""
CORNERS = SIDE * np.array([[x, y, z] for z in (0, 1) for y in (0, 1) for x in (0, 1)], float)
SIX = np.array([[0, 1, 3, 7], [0, 3, 2, 7], [0, 2, 6, 7], [0, 6, 4, 7], [0, 4, 5, 7], [0, 5, 1, 7]])
LAME = 2.0 * MU * POISSON / (1.0 - 2.0 * POISSON)
SETTINGS = {
    "mujoco": {"poisson": POISSON},
    "drake": {"poisson": POISSON},
    "newton": {"lame": LAME / MU},
    "bullet": {"lame": LAME / MU},
}


def cube(folder: Path) -> Path:
    """An exported scene of six tetrahedra whose eight nodes are all held: the upper four move down."""
    folder.mkdir()
    marks = {"outer": np.ones(8, int), "held_low": (CORNERS[:, 2] == 0) * 1, "held_high": (CORNERS[:, 2] > 0) * 1}
    meshio.write(folder / "straight.vtu", meshio.Mesh(CORNERS, {"tetra": SIX}, point_data=marks))
    ways = {"held_low": [[0.0, 0.0, 0.0]] * 2, "held_high": [[0.0, 0.0, 0.0], [0.0, 0.0, -PRESSED]]}
    data = {
        "meshes": {"straight": {"file": "straight.vtu"}},
        "material": {"shear_modulus": MU, "bulk_modulus": 1e3 * MU, "density": 1060.0},
        "checkpoints": [0.25, 0.5],
        "duration": 0.5,
        "gravity": [0.0, 0.0, 0.0],
        "damping": {"rate": 15.0},
        "obstacles": [],
        "held": [{"point_data": n, "path": {"times": [0.0, 0.4], "displacements": w}} for n, w in ways.items()],
        "lumen": None,
        "start": {"speed": None},
        "cut": None,
        "force": {"of": "held", "number": 1, "direction": [0.0, 0.0, -1.0]},
    }
    (folder / "scene.json").write_text(json.dumps(data))
    return folder


def python_with(name: str) -> tuple[str, dict[str, str]]:
    """Interpreter and environment of an installed program; the test is skipped where there is none."""
    home = (ENVIRONMENTS / name).resolve()
    if not (home / "packages.txt").is_file():
        pytest.skip(f"{name} is not installed here: `make study-peers`")
    return str(home / "bin" / "python"), os.environ | {"PYTHONPATH": str(Path.cwd()), "OMP_NUM_THREADS": "1"}


@pytest.mark.slow
@pytest.mark.parametrize("name", SETTINGS)
def test_a_cube_between_two_plates_answers_with_its_modulus(tmp_path, name):
    """No node is free: the strain e is the same everywhere, and the force (lambda + 2 mu) e A, up to e² of the laws."""
    python, environment = python_with(name)
    (peer,) = [peer for peer in PEERS if peer.name == name]
    words = [peer.module, str(cube(tmp_path / "cube")), str(tmp_path / "out.npz"), "straight", "1.0"]
    command = [python, "-m", "studies.exchange.peers.run", *words, json.dumps(SETTINGS[name])]
    ended = subprocess.run(command, env=environment, capture_output=True, text=True, cwd=tmp_path)
    assert ended.returncode == 0, ended.stderr[-500:]
    entry, strain = np.load(tmp_path / "out.npz"), PRESSED / SIDE
    assert entry["positions"][-1] == pytest.approx(CORNERS - [0, 0, PRESSED] * (CORNERS[:, 2:] > 0), abs=2e-6)
    assert entry["force"][-1] == pytest.approx((LAME + 2.0 * MU) * strain * SIDE**2, rel=0.03)
    assert entry["force"][0] == 0.0


@pytest.mark.slow
@pytest.mark.parametrize("name", ["sfepy", "felupe"])
def test_programs_with_quadratic_elements_press_the_clamped_ball_as_the_reference(tmp_path, mesh_cache, name):
    python_with(name)
    (peer,) = [peer for peer in PEERS if peer.name == name]
    (record,) = contest(tmp_path / "r", [Attempt(peer, BALL_CLAMPED, 150)], tmp_path / "g", environments=ENVIRONMENTS)
    assert record.status == Status.OK, record.message
    runs, _ = entries_beside(tmp_path / "r", [BALL_CLAMPED], lambda scene: reference_for(Path(), scene))
    assert study_table(runs, ("force_end",))["force_end [%]"].abs().max() < 8.0


def test_held_nodes_go_their_way(tmp_path, mesh_cache):
    export(BALL_CLAMPED, tmp_path / "scene", 150)
    given = SceneFolder(tmp_path / "scene")
    parts = [given.marked(f"held_{region.name}") for region in BALL_CLAMPED.held]
    assert given.probed_obstacle is None and list(given.probed_nodes) == list(parts[BALL_CLAMPED.probed.number])
    for t in (0.0, 1.1, 3.0, 4.0):
        places = [given.points[nodes] + one.path(t) for nodes, one in zip(parts, BALL_CLAMPED.held, strict=True)]
        assert given.held_at(t) == pytest.approx(np.concatenate(places), abs=1e-15)
    assert list(given.held) == list(np.concatenate(parts))
    assert given.along(np.array([1.0, 2.0, -3.0])) == pytest.approx(3.0)


@pytest.mark.campaign
def test_the_probe_of_the_liver_starts_between_the_nodes_of_a_coarse_mesh(tmp_path, mesh_cache):
    """docs/league.md: on liver_probe a program whose nodes alone touch feels nothing for the first third of the way."""
    export(LIVER_PROBE, tmp_path / "scene", 150)
    given = SceneFolder(tmp_path / "scene")
    (sphere,) = given.obstacles("sphere")
    way = np.linalg.norm(moved(sphere["path"], given.times[-1]))
    nearest = gap(sphere, given.points[given.outer], 0.0)[0].min()
    assert (1e3 * way, 1e3 * nearest) == pytest.approx((10.5, 3.9), abs=0.05)
