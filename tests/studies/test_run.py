"""Whatever happens in a run is a record: how it ended, why, NaN after that; and a replay comes out the same."""

import re
from dataclasses import replace

import numpy as np
import pytest

from massspring import Free, Path, simulate
from studies import run as module
from studies.adapt import mesh_for, prepare
from studies.case import BodyRecipe
from studies.errors import StudyError
from studies.geometry import HalfSpace
from studies.run import case_is_current, case_path, checkpoint_frames, judge, measure, replay, run_case
from studies.scenes import Held
from studies.store import Field, Status, read_record, write_record
from tests.studies.tiny import FRAMES, NODES, SQUEEZE, cube, diverging_case, file_scene, tiny_case, write_obj

SERIES = ("volume", "pressure", "kinetic", "elastic", "contact_force", "min_j")


@pytest.fixture(scope="module")
def ran(mesh_cache, tmp_path_factory):
    """A finished run and where it lies."""
    root = tmp_path_factory.mktemp("ran")
    return root, run_case(root, "tiny", tiny_case())


@pytest.fixture(scope="module")
def ended(mesh_cache):
    """A case with what was simulated, to be judged again."""
    case = tiny_case()
    prepared = prepare(case)
    return case, prepared, simulate(prepared.setup, checkpoint_frames(case, prepared))


def test_a_good_run_is_complete(ran):
    record = read_record(ran[1])
    assert (record.kind, record.status, record.message) == ("run", Status.OK, "")
    assert record.key == tiny_case().key
    assert all(np.isfinite(record.fields[name].values).all() for name in SERIES)
    assert record.fields["t"].values.tolist() == pytest.approx([0.8 * k for k in range(1, FRAMES + 1)], rel=1e-12)
    assert record.fields["contact_force"].values.shape == (FRAMES, 2, 3)
    assert record.fields["snapshots"].values.shape[1:] == record.fields["rest"].values.shape
    assert record.attributes["good_frames"] == record.attributes["frames"] == FRAMES
    assert record.attributes["dt"] <= 0.5 * record.attributes["dt_limit"]
    assert all(field.unit and field.description for field in record.fields.values())


def test_newton_s_third_law_between_the_planes(ran):
    """At rest under pressure both planes press alike, or the ball would fly off: to the accuracy of settling, 1 %."""
    upper, lower = read_record(ran[1]).fields["contact_force"].values[-1]
    assert -upper[2] == pytest.approx(lower[2], rel=0.01)
    assert upper[2] < 0


def test_it_is_current_until_case_or_code_change(ran, monkeypatch):
    root, path = ran
    assert path == case_path(root, "tiny", tiny_case())
    assert case_is_current(root, "tiny", tiny_case())
    assert not case_is_current(root, "tiny", tiny_case(dt_fraction=0.4))
    monkeypatch.setattr(module, "run_fingerprint", lambda: "edited")
    assert not case_is_current(root, "tiny", tiny_case())


def test_progress_is_told_frame_by_frame():
    told = []
    measure(tiny_case(), told.append)
    assert told == list(range(1, FRAMES + 1))


def test_a_step_beyond_the_limit_diverges_and_says_so():
    record = measure(diverging_case().replaced(frames=200))
    assert re.search("above the stability limit of .* s; expect the run to diverge", record.attributes["warnings"])
    good = record.attributes["good_frames"]
    assert record.status == Status.DIVERGED
    assert f"diverged in frame {good + 1}" in record.message
    assert 0 < good < 200
    for name in SERIES:
        values = record.fields[name].values
        assert np.isfinite(values[:good]).all()
        assert np.isnan(values[good:]).all()
    # Time goes on: the axis of a chart does not end with the run.
    assert np.isfinite(record.fields["t"].values).all()


def test_out_of_time(monkeypatch):
    monkeypatch.setattr(module, "TIME_LIMIT", 0.0)
    record = measure(tiny_case())
    assert record.status == Status.TIMED_OUT
    assert "time limit of 0 s" in record.message
    assert record.attributes["good_frames"] == 1
    assert np.isnan(record.fields["volume"].values[1:]).all()


@pytest.mark.parametrize(("smallest", "status"), [(0.1, Status.OK), (0.0, Status.INVERTED), (-0.3, Status.INVERTED)])
def test_ending_inside_out(ended, smallest, status):
    case, prepared, history = ended
    verdict, message = judge(case, prepared, replace(history, min_j=np.append(history.min_j[:-1], smallest)))
    assert verdict == status
    assert ("inside out" in message) == (status == Status.INVERTED)


@pytest.mark.parametrize(("off", "status"), [(0.009, Status.OK), (-0.011, Status.DRIFTED), (0.05, Status.DRIFTED)])
def test_a_kept_volume_that_was_not_kept(ended, off, status):
    case, prepared, history = ended
    volume = history.volume.copy()
    volume[2] = (1 + off) * prepared.setup.body.volume
    verdict, message = judge(case, prepared, replace(history, volume=volume))
    assert verdict == status
    assert (f"off by {100 * abs(off):.3g} %" in message) == (status == Status.DRIFTED)
    # A method that claims no volume cannot break the claim.
    assert judge(case.replaced(method=Free()), prepared, replace(history, volume=volume))[0] == Status.OK


def failure(case) -> str:
    """The message of the failed record that a case must leave, one sentence."""
    record = measure(case)
    assert record.status == Status.FAILED
    assert record.fields == {}
    assert record.message
    assert "\n" not in record.message
    return record.message


def box() -> tuple[np.ndarray, np.ndarray]:
    """A closed surface without inner points."""
    points, triangles, _ = cube(2)
    outer = np.unique(triangles)
    return points[outer].copy(), np.searchsorted(outer, triangles)


TETRAHEDRON = np.array([[0, 2, 1], [0, 1, 3], [1, 2, 3], [0, 3, 2]])


def surfaces():
    """Faults of a surface -> (points, triangles, a word of the sentence)."""
    points, triangles = box()
    moved = points.copy()
    moved[3, 1] = np.nan
    i, j, p, q = *triangles[0, :2], len(points), len(points) + 1
    fin = np.vstack([triangles, [[i, j, p], [j, i, q], [i, p, q], [j, q, p]]])
    return {
        "open": (points, triangles[1:], "open"),
        "inside out": (points, triangles[:, ::-1], "inside out"),
        "not manifold": (np.vstack([points, [[1.0, 1.0, 1.0], [1.0, 1.0, 2.0]]]), fin, "not manifold"),
        "duplicated": (points, np.vstack([triangles, triangles[:1]]), "duplicated"),
        "no volume": (np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [1, 1, 0.0]]), TETRAHEDRON, "enclosed volume is zero"),
        "NaN": (moved, triangles, "not finite"),
    }


@pytest.mark.parametrize("fault", surfaces())
@pytest.mark.parametrize("kind", ["tetrahedral", "surface"])
def test_a_bad_surface_fails_in_one_sentence(tmp_path, fault, kind):
    points, triangles, word = surfaces()[fault]
    scene = file_scene(write_obj(tmp_path / "bad.obj", points, triangles))
    message = failure(tiny_case(scene=scene, body=BodyRecipe(kind)))
    assert message.startswith("bad.obj: ")
    assert word in message


def test_a_good_surface_runs(tmp_path):
    scene = file_scene(write_obj(tmp_path / "good.obj", *box()))
    for kind in ("tetrahedral", "surface"):
        record = measure(tiny_case(scene=scene, body=BodyRecipe(kind)))
        assert record.status == Status.OK
        fall = (record.fields["snapshots"].values[-1] - record.fields["rest"].values)[:, 2]
        # Symplectic Euler falls ½ g t (t + dt), every node alike.
        expected = -0.5 * 9.81 * 0.01 * (0.01 + record.attributes["dt"])
        np.testing.assert_allclose(fall, expected, rtol=1e-9)


def test_negative_tetrahedra_fail_in_one_sentence(tmp_path):
    meshio = pytest.importorskip("meshio")
    points, _, cells = cube(1)
    cells[2, :2] = cells[2, 1::-1]
    meshio.Mesh(points, [("tetra", cells)]).write(tmp_path / "bad.vtu")
    assert "negative volume" in failure(tiny_case(scene=file_scene(tmp_path / "bad.vtu")))


def test_millimetres_read_as_metres_warn_with_the_box(tmp_path):
    points, triangles = box()
    path = write_obj(tmp_path / "organ.obj", 1000 * points, triangles)
    case = tiny_case(scene=file_scene(path), body=BodyRecipe("surface"))
    said = measure(case).attributes["warnings"]
    assert re.search(r"organ\.obj: the bounding box is 100 x 100 x 100 m; .* unit='mm'", said)
    right = tiny_case(scene=file_scene(path, unit="mm"), body=BodyRecipe("surface"))
    record = measure(right)
    assert (record.status, record.attributes["warnings"]) == (Status.OK, "")


@pytest.mark.parametrize(
    ("changes", "word"),
    [
        ({"scene": file_scene("/nowhere/organ.stl")}, "no mesh file"),
        (
            {"scene": replace(file_scene("organ.stl"), organ=replace(SQUEEZE.organ, shape="file"))},
            "needs a path and a unit",
        ),
        ({"scene": file_scene("organ.stl", unit="inch")}, "'inch' is not known"),
        ({"scene": replace(SQUEEZE, organ=replace(SQUEEZE.organ, shape="bal"))}, "did you mean 'ball'"),
        ({"scene": replace(SQUEEZE, not_for=(("implicit_volume", "no volume"),))}, "does not apply"),
        ({"scene": replace(SQUEEZE, damping=-1.0)}, "damping is -1"),
        ({"scene": replace(SQUEEZE, duration=0.0)}, "positive duration"),
        ({"body": BodyRecipe(nodes=0)}, "nodes"),
        ({"body": BodyRecipe(nodes=NODES, stiffness=0.0)}, "stiffness factor is 0"),
        (
            {"scene": replace(SQUEEZE, obstacles=(replace(SQUEEZE.obstacles[0], point=(0.0, 0.0, 0.0)),))},
            "inside the body",
        ),
    ],
)
def test_bad_settings_fail_in_one_sentence(changes, word):
    assert word in failure(tiny_case(**changes))


def test_attachments_that_overlap_or_miss_fail_in_one_sentence(tmp_path):
    """A mesh from a file has no outlines: the region is looked for among its nodes."""
    path = write_obj(tmp_path / "box.obj", *box())
    top = Held("top", HalfSpace((0.0, 0.0, 0.04), (0.0, 0.0, -1.0)), Path())
    far = Held("far", HalfSpace((0.0, 0.0, 9.0), (0.0, 0.0, -1.0)))
    body = BodyRecipe("surface")
    assert measure(tiny_case(scene=file_scene(path, held=(top,)), body=body)).status == Status.OK
    assert "same node" in failure(tiny_case(scene=file_scene(path, held=(top, replace(top, name="again"))), body=body))
    assert "holds no node" in failure(tiny_case(scene=file_scene(path, held=(far,)), body=body))


def test_a_mesh_file_comes_as_it_is(tmp_path):
    points, triangles = box()
    mesh = mesh_for(file_scene(write_obj(tmp_path / "box.obj", points, triangles)), 999, filled=False)
    assert len(mesh.points) == len(points)


def test_failures_are_stored_like_successes(tmp_path):
    case = tiny_case(body=BodyRecipe(nodes=NODES, stiffness=-1.0))
    record = read_record(run_case(tmp_path, "tiny", case))
    assert record.status == Status.FAILED
    assert case_is_current(tmp_path, "tiny", case)


def test_replay_is_equal_bit_for_bit(ran):
    stored, new, difference = replay(ran[1])
    assert difference is None
    assert stored.key == new.key
    np.testing.assert_array_equal(stored.fields["snapshots"].values, new.fields["snapshots"].values)


def test_replay_of_a_diverged_run_is_equal_too(tmp_path):
    assert replay(run_case(tmp_path, "tiny", diverging_case()))[2] is None


def spoil(path, name, change):
    record = read_record(path)
    field = record.fields[name]
    fields = record.fields | {name: Field(change(field.values), field.unit, field.description)}
    write_record(path, replace(record, fields=fields))


@pytest.mark.parametrize("name", ["volume", "snapshots", "triangles"])
def test_replay_tells_a_changed_value(ran, tmp_path, name):
    path = tmp_path / "copy.h5"
    path.write_bytes(ran[1].read_bytes())
    # The last bit of one number, or the next index.
    spoil(
        path,
        name,
        lambda v: (
            np.where(np.arange(v.size).reshape(v.shape) == 0, v + np.spacing(v), v) if v.dtype.kind == "f" else v + 1
        ),
    )
    assert f"'{name}' differs by up to" in replay(path)[2]


def test_replay_tells_another_shape_a_lost_field_and_another_end(ran, tmp_path):
    path = tmp_path / "copy.h5"
    path.write_bytes(ran[1].read_bytes())
    spoil(path, "t", lambda v: v[:-1])
    assert "'t' has another shape" in replay(path)[2]
    record = read_record(ran[1])
    write_record(path, replace(record, fields={k: v for k, v in record.fields.items() if k != "t"}))
    assert "'t' is not stored" in replay(path)[2]
    write_record(path, replace(record, status=Status.DIVERGED, message="gone"))
    assert "it was diverged, now it is ok" in replay(path)[2]


def test_only_runs_are_replayed(ran, tmp_path):
    record = read_record(ran[1])
    write_record(tmp_path / "a.h5", replace(record, kind="timing"))
    with pytest.raises(StudyError, match="only a run can be replayed"):
        replay(tmp_path / "a.h5")
