"""Programs that finish, refuse, crash, hang or are missing: each has its row, and the others run."""

import shutil
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from massspring import Plane, Sphere
from studies.exchange.description import obstacle_entry
from studies.exchange.entry import entries_beside
from studies.exchange.export import export
from studies.exchange.peers import contest as peers
from studies.exchange.peers.contest import OURS, PEERS, Attempt, Peer, contest, fingerprint_of, fingerprints
from studies.exchange.peers.scene_folder import CannotDo, SceneFolder, gap, moved, turn_to
from studies.metrics.table import study_table
from studies.plots.campaigns.league import SPARE
from studies.scene.library import LIVER_PROBE, STOMACH_PRESS
from studies.scene.library.ball_squeeze import BALL_SQUEEZE
from studies.store.record import Status
from tests.campaigns import campaigns_but
from tests.studies.octant import SCENE

NODES = 100
ENDS = {
    "squeezed": (Status.OK, ""),
    "unable": (Status.SKIPPED, "unable: it knows no frictionless planes"),
    "missing": (Status.SKIPPED, "missing: a_program_that_is_not_installed is not installed"),
    "crashed": (Status.FAILED, "crashed ended with exit code 1: ZeroDivisionError: in its solver"),
    "hung": (Status.FAILED, "hung took longer than 3 s"),
    "shifted": (Status.FAILED, "the positions at t = 0 are up to 1.73 m from those of straight.vtu"),
}


def dummy(name) -> Peer:
    return Peer(name, f"tests.studies.exchange.peers.dummy_{name}")


@pytest.fixture(scope="module")
def ended(solved, tmp_path_factory, mesh_cache):
    """(results, records by name) of all of them."""
    root = shutil.copytree(solved, tmp_path_factory.mktemp("contest") / "results")
    attempts = {name: Attempt(dummy(name), SCENE, NODES) for name in ENDS}
    limits = {"hung": 3.0}
    return root, {
        name: next(contest(root, [attempt], root / "given", limits.get(name, 120.0)))
        for name, attempt in attempts.items()
    }


@pytest.mark.parametrize("name", ENDS)
def test_each_end_is_a_row_that_says_so(ended, name):
    record = ended[1][name]
    status, message = ENDS[name]
    assert record.status == status and message in record.message


def test_tables_show_them_all(ended, reference):
    root, _ = ended
    runs, problems = entries_beside(root, [SCENE], lambda scene: reference)
    assert not problems and {run.case.method.name for run in runs} == {*ENDS}
    table = study_table(runs, ("force_end", "volume_worst", "real_time")).set_index("method")
    row = table.loc["squeezed"]
    assert row["volume_worst [%]"] == pytest.approx(10.0) and row["real_time [s/s]"] == pytest.approx(0.2)
    assert row["force_end [%]"] == pytest.approx(100 * (40.0 / reference.force[-1] - 1))
    assert table.loc["crashed", "status"] == "failed" and np.isnan(table.loc["crashed", "volume_worst [%]"])


@pytest.mark.parametrize("absent", [peer for peer in PEERS if peer.absent], ids=lambda peer: peer.name)
def test_a_program_without_an_adapter_is_a_row_with_its_reason(tmp_path, mesh_cache, absent):
    (record,) = contest(tmp_path / "r", [Attempt(absent, replace(SCENE, reference=None), NODES)], tmp_path / "g")
    assert record.status == Status.SKIPPED and record.message == f"{absent.name}: {absent.absent}"
    assert all(bool(peer.absent) != bool(peer.module) for peer in PEERS)


def test_no_two_engines_of_the_league_have_one_colour_or_marker():
    colours, markers = zip(*SPARE, strict=True)
    assert len({*colours}) == len({*markers}) == len(SPARE) >= len([p for p in (*PEERS, *OURS) if not p.absent])


@pytest.mark.parametrize("normal", [(0, 0, 1), (0, 0, -1), (1, 0, 0), (0.6, 0, -0.8), (0.48, 0.6, 0.64)])
def test_a_quaternion_turns_the_z_axis_to_the_normal(normal):
    x, y, z, w = turn_to(list(normal))
    assert (2 * (x * z + w * y), 2 * (y * z - w * x), 1 - 2 * (x * x + y * y)) == pytest.approx(normal, abs=1e-12)


REFUSED = {
    "a sphere": (
        replace(BALL_SQUEEZE, obstacles=(Sphere((0.0, 0.0, 0.075), 0.025),)),
        "knows frictionless planes, not: Rigid sphere",
    ),
    "friction": (replace(BALL_SQUEEZE, obstacles=(Plane((0, 0, 0.05), (0, 0, -1), friction=0.3),)), "coefficient 0.3"),
    "a lumen": (STOMACH_PRESS, "knows solid organs"),
}


@pytest.mark.parametrize("what", campaigns_but(REFUSED, lambda what: what != "a lumen"))
def test_a_scene_beyond_the_adapters_is_refused_with_its_reason(tmp_path, mesh_cache, what):
    scene, message = REFUSED[what]
    nodes = 400 if scene.lumen else NODES + 50
    export(scene, tmp_path / "scene", nodes)
    given = SceneFolder(tmp_path / "scene")
    with pytest.raises(CannotDo, match=message):
        given.check_simple()
        given.obstacles("plane")


def test_a_path_is_read_as_the_scene_means_it(tmp_path, mesh_cache):
    export(SCENE, tmp_path / "scene", NODES)
    given = SceneFolder(tmp_path / "scene")
    for t in (0.0, 1.3, 3.0, 4.0):
        for plane, obstacle in zip(given.obstacles("plane"), SCENE.obstacles, strict=True):
            assert moved(plane["path"], t) == pytest.approx(obstacle.path(t), abs=1e-15)


@pytest.mark.parametrize("scene", [SCENE, LIVER_PROBE], ids=lambda scene: scene.name)
def test_adapters_see_the_gap_that_judges_see(scene):
    """Distances to planes and spheres are those of our own obstacles, and their directions the slopes of these."""
    x = np.random.default_rng(5).normal(scale=0.1, size=(40, 3))
    for obstacle in scene.obstacles:
        for t in (0.0, 2.5, scene.duration):
            distance, away = gap(obstacle_entry(obstacle), x, t)
            assert distance == pytest.approx(obstacle.gap(x, t), abs=1e-15)
            slopes = [(obstacle.gap(x + h, t) - obstacle.gap(x - h, t)) / 2e-6 for h in 1e-6 * np.eye(3)]
            assert away == pytest.approx(np.stack(slopes, axis=1), abs=1e-6)


ENVIRONMENTS = Path("results/cache/environments")
"""Where `make study-league` keeps the environments of the programs."""
LIMITS = {
    "mujoco": (60.0, 15.0, 0.5),
    "felupe": (10.0, 0.2, 0.1),
    "newton": (60.0, 10.0, 0.5),
    "bullet": (60.0, 10.0, 0.5),
    "drake": (50.0, 15.0, 0.5),
    "sfepy": (15.0, 1.5, 0.5),
    "ours-quadratic": (10.0, 0.1, 0.5),
    "ours-corotated": (60.0, 5.0, 0.5),
    "ours-xpbd": (60.0, 5.0, 0.5),
}
"""Most [%] that its force, volume and penetration are off on a ball of 100 vertices."""


@pytest.mark.slow
@pytest.mark.parametrize(
    "peer",
    campaigns_but(
        [peer for peer in (*PEERS, *OURS) if not peer.absent], lambda peer: peer in PEERS or peer.name == "ours-xpbd"
    ),
    ids=lambda peer: peer.name,
)
def test_each_program_squeezes_the_ball(reference, tmp_path, mesh_cache, peer):
    """The entry of each installed program is a squeezed ball."""
    if peer.packages and not (ENVIRONMENTS / peer.name / "packages.txt").is_file():
        pytest.skip(f"{peer.name} is not installed here: `make study-league`")
    scene = replace(BALL_SQUEEZE, checkpoints=SCENE.checkpoints)
    attempts = [Attempt(peer, scene, NODES)]
    (record,) = contest(tmp_path / "r", attempts, tmp_path / "g", environments=ENVIRONMENTS)
    assert record.status == Status.OK, record.message
    runs, _ = entries_beside(tmp_path / "r", [scene], lambda scene: None)
    judged = [replace(run, reference=reference) for run in runs]
    table = study_table(judged, ("force_end", "volume_worst", "penetration"))
    force, volume, depth = LIMITS[peer.name]
    assert (table["force_end [%]"].abs() < force).all() and (table["volume_worst [%]"] < volume).all()
    assert (table["penetration [%]"] < depth).all()


@pytest.mark.campaign
def test_an_environment_that_cannot_be_made_is_a_reason(tmp_path, mesh_cache):
    """pip gets a package that no index can have; the row says so, and the rest would go on."""
    peer = Peer("nowhere", "tests.studies.exchange.peers.dummy_unable", packages=("./not-a-folder-of-any-package",))
    attempt = Attempt(peer, replace(SCENE, reference=None), NODES)
    (record,) = contest(tmp_path / "r", [attempt], tmp_path / "g", environments=tmp_path / "e")
    assert record.status == Status.SKIPPED
    assert record.message.startswith("nowhere: pip cannot install ./not-a-folder-of-any-package (")


def test_what_is_current_is_kept_and_what_was_skipped_is_tried_again(ended, monkeypatch):
    root, records = ended
    calls = []
    monkeypatch.setattr(peers, "hand_over", lambda attempt, *_: calls.append(attempt.name) or (Status.SKIPPED, "later"))
    attempts = [Attempt(dummy(name), SCENE, NODES) for name in ("squeezed", "crashed", "unable")]
    kept, crashed, skipped = contest(root, attempts, root / "given")
    assert calls == ["unable"] and skipped.message == "later"
    assert (kept.status, crashed.message) == (Status.OK, records["crashed"].message)
    # Other settings, and other code of the adapter, run again.
    other = replace(dummy("squeezed"), settings={"step": 1})
    assert next(contest(root, [Attempt(other, SCENE, NODES)], root / "given")).message == "later"
    monkeypatch.setattr(peers, "fingerprint_of", lambda peer: "other code")
    next(contest(root, [Attempt(dummy("crashed"), SCENE, NODES)], root / "given"))
    assert calls == ["unable", "squeezed", "crashed"]


def test_entries_of_the_present_code_carry_its_fingerprint(ended):
    assert fingerprint_of(PEERS[0]) in fingerprints() and len(fingerprints()) > len(OURS)
    assert ended[1]["squeezed"].fingerprint == fingerprint_of(dummy("squeezed"))
