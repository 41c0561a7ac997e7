"""A scene with a cut for programs that cannot cut: its meshes are open, its loads the same, and what is at rest then is
what our own cut body comes to."""

import csv
import json
from dataclasses import replace
from pathlib import Path

import meshio
import numpy as np
import pytest

from massspring import Attachment, ImplicitVolume, Material, Setup, Trajectory, make_clock, simulate, step_limit
from massspring import tetrahedral_body as body_of
from studies.base.errors import StudyError
from studies.exchange.description import judged_metrics
from studies.exchange.entry import entries_beside
from studies.exchange.export import export
from studies.exchange.judge import judge
from studies.exchange.meshes import given_mesh, given_scene, reference_of
from studies.geometry.mesh.organ_mesh import boundary_triangles, tetrahedron_volumes
from studies.metrics.metrics import force_end, mean_error, opening_error
from studies.metrics.run import Run
from studies.reference.load import reference_for
from studies.runs.case import Case
from studies.runs.recipes import TetrahedralBody
from studies.runs.run import measure
from studies.scene.library import BALL_BISECTED, BALL_INCISED, BALL_SQUEEZE
from studies.scene.library.ball_cuts import RADIUS, SHELL_OPENED
from studies.scene.library.liver_incised import LIVER_CUT_LIVE

pytestmark = pytest.mark.slow
NODES = 150
SIZE = 2 * 3**0.5 * RADIUS


@pytest.fixture(scope="module")
def folder(tmp_path_factory, mesh_cache):
    folder = tmp_path_factory.mktemp("precut") / "incised"
    export(BALL_INCISED, folder, NODES)
    return folder


@pytest.fixture(scope="module")
def cut_body(mesh_cache) -> Run:
    """Our own body, cut on the way and left to rest."""
    case = Case(BALL_INCISED, TetrahedralBody(nodes=NODES), ImplicitVolume())
    run = Run(case, measure(case), reference_for(Path(), BALL_INCISED))
    assert run.record.status == "ok", run.record.message
    return run


@pytest.fixture(scope="module")
def outsider(folder):
    """Steps of a body that is made of nothing but the exported folder; times, positions and the probed force."""
    data = json.loads((folder / "scene.json").read_text())
    mesh = meshio.read(folder / "straight.vtu")
    cells = mesh.cells_dict["tetra"].astype(np.int64)
    material = Material(data["material"]["shear_modulus"], data["material"]["density"])
    body = body_of(mesh.points, boundary_triangles(cells), cells, material)
    held = tuple(
        Attachment(
            np.flatnonzero(mesh.point_data[one["point_data"]] == 1),
            Trajectory(tuple(one["path"]["times"]), tuple(map(tuple, one["path"]["displacements"]))),
        )
        for one in data["held"]
    )
    damping = data["damping"]["rate"]
    limit = step_limit(body, damping, np.concatenate([one.nodes for one in held]))
    clock = make_clock(data["duration"], data["frames"], 0.5 * limit.damped, limit)
    setup = Setup(body, ImplicitVolume(), clock, attachments=held, damping=damping)
    at = [round(t / clock.frame) for t in data["checkpoints"]]
    history = simulate(setup, at)
    assert history.outcome == "finished", history.message
    force = history.held_force[[frame - 1 for frame in at], 1, 2]
    return (
        np.array([0.0, *data["checkpoints"]]),
        np.concatenate([body.rest[None], history.snapshots]),
        np.concatenate([[0.0], force]),
    )


def test_the_exported_mesh_comes_to_the_rest_of_the_body_that_is_cut_on_the_way(cut_body, outsider):
    _, positions, force = outsider
    np.testing.assert_allclose(positions[0], cut_body.fields.rest, atol=1e-12)
    assert np.abs(positions[-1] - cut_body.fields.snapshots[-1]).max() < 1e-6 * SIZE
    assert force[-1] == pytest.approx(cut_body.force[-1], rel=1e-5)
    assert np.abs(positions[-1] - positions[0]).max() > 0.05 * SIZE  # it is pulled far


def test_a_reader_finds_both_faces_of_the_cut(folder):
    data = json.loads((folder / "scene.json").read_text())
    assert data["cut"]["plane"] == {"point": [0, 0, 0], "normal": [0, 0, 1]} and data["cut"]["contact"] is False
    assert data["cut"]["within"] == {"kind": "halfspace", "point": [0, 0, 0], "normal": [1, 0, 0]}
    for kind, corners in (("straight", 3), ("curved", 6)):
        mesh = meshio.read(folder / data["meshes"][kind]["file"])
        (cells,) = [block.data for block in mesh.cells]
        with (folder / data["cut"]["files"][kind]).open() as file:
            rows = np.array([[int(cell) for cell in row.values()] for row in csv.DictReader(file)])
        behind, front = rows[:, :corners], rows[:, corners:]
        np.testing.assert_array_equal(mesh.points[behind], mesh.points[front])
        assert np.abs(mesh.points[rows][:, :, 2]).max() < 1e-12
        # Half of the equator's disc, up to its straight front, whose nodes alone are single.
        a, b, c = mesh.points[behind[:, :3]].transpose(1, 0, 2)
        area = 0.5 * np.linalg.norm(np.cross(b - a, c - a), axis=1)
        assert area.sum() == pytest.approx(0.5 * np.pi * RADIUS**2, rel=0.03)
        single = np.unique(behind[behind == front])
        assert len(single) >= 5 and np.abs(mesh.points[single, 0]).max() < 1e-5  # m: curved sides
        # What is behind belongs to elements below the plane, what is in front to those above.
        for faces, below in ((behind, True), (front, False)):
            own_nodes = np.setdiff1d(faces, single)
            touching = cells[np.isin(cells[:, :4], own_nodes).any(axis=1)][:, :4]
            assert ((mesh.points[touching].mean(axis=1)[:, 2] < 0) == below).all()
        boundary = {frozenset(face) for face in boundary_triangles(cells[:, :4].astype(np.int64)).tolist()}
        assert all(frozenset(face[:3]) in boundary for face in (*behind.tolist(), *front.tolist()))
        # The mesh fills the ball once, as the uncut one would.
        volume = tetrahedron_volumes(mesh.points, cells[:, :4].astype(np.int64))
        assert (volume > 0).all() and volume.sum() == pytest.approx(4 / 3 * np.pi * RADIUS**3, rel=0.06)


def test_the_page_says_that_the_cut_is_there_from_the_start(folder):
    page, data = (folder / "README.md").read_text(), json.loads((folder / "scene.json").read_text())
    assert data["checkpoints"] == [2.0, 4.0] and "positions are judged at 2, 4 s" in page
    assert all(name in page for name in ("cut from the start", "cut_curved.csv", "opening_error", "piece_worst"))
    assert "cut_energy" not in page and "cut_ms" not in page  # of our own event


def test_an_entry_is_judged_by_its_opening_too(outsider, cut_body, tmp_path):
    """With the same numbers as the body that was cut on the way, which the whole reference judges."""
    t, positions, force = outsider
    np.savez(tmp_path / "theirs.npz", t=t, positions=positions, force=force)
    run = judge(BALL_INCISED, tmp_path / "theirs.npz", tmp_path, nodes=NODES)
    (stored,), problems = entries_beside(tmp_path, [BALL_INCISED], lambda scene: reference_for(tmp_path, scene))
    assert not problems and stored.record.name == run.record.name and {"overlap", "piece_worst"} <= names_of(run)
    for metric in (opening_error, mean_error, force_end):
        assert metric(run) == metric(stored) == pytest.approx(metric(cut_body), rel=1e-3)
    # Shut, it lacks the whole opening.
    positions = positions.copy()
    positions[:, run.cut_pairs[:, 1]] = positions[:, run.cut_pairs[:, 0]]
    np.savez(tmp_path / "wrong.npz", t=t, positions=positions, force=2 * force)
    wrong = judge(BALL_INCISED, tmp_path / "wrong.npz", tmp_path, nodes=NODES)
    assert opening_error(wrong) == pytest.approx(100.0, abs=0.5) and force_end(wrong) > 80.0


def names_of(run: Run) -> set[str]:
    """Metrics that are judged and have a value."""
    return {metric.name for metric in judged_metrics(run.case.scene) if metric(run) == metric(run)}


def test_a_reader_that_joins_points_is_refused(refused, outsider, tmp_path, mesh_cache):
    t, positions, _ = outsider
    pairs = given_mesh(given_scene(BALL_INCISED), NODES, "straight").pairs
    kept = np.setdiff1d(np.arange(positions.shape[1]), pairs[:, 1])
    np.savez(tmp_path / "joined.npz", t=t, positions=positions[:, kept])
    words = ("judge", "ball_incised", tmp_path / "joined.npz", "--nodes", NODES, "--results", tmp_path / "results")
    assert "the reader joined those that lie at one place, which shuts the cut" in refused(*words)


def test_the_reference_after_the_cut_is_the_end_of_the_whole_one(tmp_path):
    whole = reference_for(tmp_path, BALL_INCISED)
    late = reference_of(given_scene(BALL_INCISED), whole)
    np.testing.assert_array_equal(late.force, whole.force[-2:])
    np.testing.assert_array_equal(late.field("displacement"), whole.field("displacement")[-2:])
    assert late.total_uncertainty["opening"] == whole.total_uncertainty["opening"]
    assert reference_of(BALL_INCISED, whole) is whole and given_scene(BALL_SQUEEZE) is BALL_SQUEEZE


@pytest.mark.campaign
def test_pieces_keep_a_volume_each(mesh_cache):
    for kind in ("straight", "curved"):
        mesh = given_mesh(given_scene(BALL_BISECTED), NODES, kind)
        half = 2 / 3 * np.pi * RADIUS**3
        assert mesh.volumes.names == ("piece 0", "piece 1")
        assert mesh.volumes.measure(mesh.points) == pytest.approx([half, half], rel=0.07)


LOOSE = replace(BALL_BISECTED, held=BALL_BISECTED.held[:1], cuts=(replace(BALL_BISECTED.cut, free=True),))
LATE = replace(BALL_INCISED, reference=None, cuts=(replace(BALL_INCISED.cut, at=9.0),))
KEPT = {
    "cut 'section' lets a piece go, so its time matters": LOOSE,
    "cut 'opening' opens a lumen, whose volume is kept until then": SHELL_OPENED,
    "has no checkpoint after its cut 'incision' at 9 s; add one": LATE,
}


@pytest.mark.parametrize("message", KEPT)
def test_a_cut_whose_time_matters_is_not_given_away(tmp_path, message):
    with pytest.raises(StudyError, match=message):
        export(KEPT[message], tmp_path / "kept", NODES)
    assert not (tmp_path / "kept").exists()


def test_what_comes_while_a_cut_advances_is_left_out():
    """Without a reference nothing refuses a checkpoint between its begin and its end."""
    between = replace(LIVER_CUT_LIVE, reference=None, checkpoints=(1.5, 2.5, 4.0))
    assert given_scene(between).checkpoints == (4.0,)
