"""Every run leaves a record: how it ended, why, NaN after its end, one sentence for bad input; a replay gives the
same numbers."""

from dataclasses import replace

import numpy as np
import pytest

from massspring import Capsule, Element, Free, Sphere, Trajectory, Xpbd, simulate
from studies.base.errors import StudyError
from studies.geometry import HalfSpace
from studies.runs import run as module
from studies.runs.case import Case
from studies.runs.indicators import CROSSED
from studies.runs.prepare import prepare
from studies.runs.recipes import BODIES, MembraneBody, SurfaceBody, TetrahedralBody
from studies.runs.run import checkpoint_frames, measure, record_of, replay, run_case
from studies.runs.status import FOLDED, status_of
from studies.scene.checks import check_scene
from studies.scene.library.stress import STRESS_SCENES
from studies.scene.scene import Held, Organ
from studies.scene.start import InitialConditions
from studies.store.record import Field, Status, read_record, write_record
from tests.studies.tiny import FRAMES, NODES, SQUEEZE, cube, diverging_case, file_scene, tiny_case, write_obj

SERIES = ("volume", "pressure", "contact_force", "penetration", "min_j")


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


def test_a_squeezed_ball_stores_most_of_the_work_and_gains_nothing(ran):
    fields = read_record(ran[1]).fields
    kinetic, elastic, work = (fields[name].values for name in ("kinetic", "elastic", "work"))
    assert np.all(kinetic > 0) and np.all(np.diff(elastic[: FRAMES // 2]) > 0) and elastic[-1] > kinetic[-1]
    assert 0.9 < elastic[-1] / work[-1] < 1.0


def test_penetration_is_how_far_the_last_positions_lie_beyond_the_planes(ran):
    record = read_record(ran[1])
    z, planes = record.fields["snapshots"].values[-1][:, 2], (0.7 * 0.05, -0.7 * 0.05)
    upper, lower = record.fields["penetration"].values[-1]
    # Distances of 35 mm, rounded to 1e-17 m.
    assert upper == pytest.approx(max(0.0, z.max() - planes[0]), abs=1e-15)
    assert lower == pytest.approx(max(0.0, planes[1] - z.min()), abs=1e-15)


def test_what_the_guards_did_is_stored():
    """A ball that starts at a thousandth of its size comes back in parts, one on a line has nothing to push on."""
    counts = {}
    for name in ("shrunk", "line"):
        scene = next(scene for scene in STRESS_SCENES if scene.name == f"stress_{name}")
        attributes = measure(Case(scene, TetrahedralBody(nodes=NODES), dt_fraction=0.2)).attributes
        counts[name] = attributes["capped_steps"], attributes["skipped_steps"]
    steps = attributes["steps"] * attributes["frames"]
    assert counts["shrunk"][0] > 0 and counts["shrunk"][1] == 0
    assert counts["line"][1] == steps
    calm = measure(tiny_case()).attributes
    assert calm["capped_steps"] == calm["skipped_steps"] == 0


def test_iterations_of_an_iterative_solve_are_stored(ran):
    assert not read_record(ran[1]).fields["iterations"].values.any()
    most_and_sum = measure(tiny_case(body=TetrahedralBody(nodes=60, volumes="nodal"))).fields["iterations"].values
    assert (most_and_sum[:, 0] >= most_and_sum[:, 1]).all()
    assert (most_and_sum[:, 1] > 0).all()


def test_progress_counts_frame_by_frame():
    frames = []
    measure(tiny_case(), frames.append)
    assert frames == list(range(1, FRAMES + 1))


def test_a_step_beyond_the_limit_diverges_and_says_so():
    record = measure(diverging_case().replaced(frames=200))
    assert record.attributes["dt"] > record.attributes["dt_limit"]
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


FOLDS = [(FOLDED, Status.OK), (0.999 * FOLDED, Status.FOLDED), (0.0, Status.INVERTED), (-0.3, Status.INVERTED)]
SHAPED, MOVING = InitialConditions(scatter=0.1), InitialConditions(speed=((0.0, 1.0, 0.0), (0.0,) * 3, (0.0,) * 3))


def at_frames(ended, frames, start=None):
    """Status and message of the run with least J of these frames, from a start."""
    case, _, history = ended
    min_j = history.min_j.copy()
    for frame, least in frames.items():
        min_j[frame] = least
    return status_of(case.replaced(scene=replace(case.scene, start=start)), replace(history, min_j=min_j))


@pytest.mark.parametrize(("least", "status"), FOLDS)
@pytest.mark.parametrize("start", [None, MOVING], ids=["at rest", "moving"])
def test_an_element_that_folds_in_any_frame_counts(ended, start, least, status):
    for frame in (0, 2, FRAMES - 1):
        verdict, message = at_frames(ended, {frame: least}, start)
        assert verdict == status
        assert (f"is {status} in 1 of {FRAMES} frames (least J {least:.3g};" in message) == (status != Status.OK)


def test_of_folded_and_inverted_frames_the_inverted_count(ended):
    verdict, message = at_frames(ended, {0: 0.05, 1: -0.2, 3: -0.4})
    assert verdict == Status.INVERTED and f"in 2 of {FRAMES} frames (least J -0.4;" in message


@pytest.mark.parametrize(("least", "status"), FOLDS)
def test_a_body_that_starts_out_of_shape_may_fold_on_its_way_back(ended, least, status):
    assert at_frames(ended, {0: least, FRAMES - 2: least}, SHAPED) == (Status.OK, "")
    verdict, message = at_frames(ended, {FRAMES - 1: least}, SHAPED)
    assert verdict == status and (f"is {status} at the end" in message) == (status != Status.OK)


@pytest.mark.parametrize(("off", "status"), [(0.009, Status.OK), (-0.011, Status.DRIFTED), (0.05, Status.DRIFTED)])
def test_a_kept_volume_that_was_not_kept(ended, off, status):
    case, prepared, history = ended
    volume = history.volume.copy()
    volume[2] = (1 + off) * prepared.setup.body.volume
    verdict, message = status_of(case, replace(history, volume=volume))
    assert verdict == status
    assert (f"volume error {100 * abs(off):.3g} %" in message) == (status == Status.DRIFTED)
    # A method that claims no volume cannot break the claim.
    assert status_of(case.replaced(method=Free()), replace(history, volume=volume))[0] == Status.OK


def test_replay_is_equal_bit_for_bit(ran):
    stored, new, difference = replay(ran[1])
    assert difference is None
    assert stored.key == new.key
    np.testing.assert_array_equal(stored.fields["snapshots"].values, new.fields["snapshots"].values)


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
    spoil(path, "tetrahedra", lambda v: v[:-1])
    assert "'tetrahedra' has another shape" in replay(path)[2]
    record = read_record(ran[1])
    one = replace(record.fields["snapshot_frame"], values=np.zeros(1, dtype=np.int64))
    write_record(path, replace(record, fields=record.fields | {"cut_parts": one}))
    assert "'cut_parts' is no longer computed" in replay(path)[2]
    write_record(path, replace(record, status=Status.DIVERGED, message="gone"))
    assert "it was diverged, now it is ok" in replay(path)[2]


def test_only_runs_are_replayed(ran, tmp_path):
    record = read_record(ran[1])
    write_record(tmp_path / "a.h5", replace(record, kind="made up"))
    with pytest.raises(StudyError, match="only a run can be replayed"):
        replay(tmp_path / "a.h5")


@pytest.mark.parametrize("method", [Element(), Xpbd()], ids=lambda method: method.name)
def test_a_method_that_does_not_apply_is_skipped_with_its_reason(mesh_cache, method):
    """No failure: a study may hold such cases, and they do not run again."""
    record = measure(Case(tiny_case().scene, SurfaceBody(nodes=NODES), method))
    assert record.status == Status.SKIPPED
    assert f"method '{method.name}' does not apply to the surface body" in record.message
    assert "fill its mesh" in record.message


def failure(case) -> str:
    """The message of the failed record that a case must leave, one sentence."""
    record = record_of(case)
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


def test_a_good_surface_runs(tmp_path):
    scene = file_scene(write_obj(tmp_path / "good.obj", *box()))
    for kind in ("tetrahedral", "surface"):
        record = measure(tiny_case(scene=scene, body=BODIES[kind]()))
        assert record.status == Status.OK
        fall = (record.fields["snapshots"].values[-1] - record.fields["rest"].values)[:, 2]
        # Symplectic Euler falls ½ g t (t + dt), every node alike.
        expected = -0.5 * 9.81 * 0.01 * (0.01 + record.attributes["dt"])
        np.testing.assert_allclose(fall, expected, rtol=1e-9)


@pytest.mark.parametrize(
    ("changes", "word"),
    [
        ({"scene": file_scene("/nowhere/organ.stl")}, "no mesh file"),
        (
            {"scene": replace(file_scene("organ.stl"), organ=replace(SQUEEZE.organ, shape="file"))},
            "unknown parameter of an organ from a file 'radius'",
        ),
        (
            {"scene": replace(file_scene("organ.stl"), organ=Organ("file"))},
            "a path and a unit",
        ),
        ({"scene": file_scene("organ.stl", unit="inch")}, "'inch' is not known"),
        ({"scene": replace(SQUEEZE, organ=replace(SQUEEZE.organ, shape="bal"))}, "did you mean 'ball'"),
        ({"scene": replace(SQUEEZE, damping=-1.0)}, "damping is -1"),
        ({"scene": replace(SQUEEZE, duration=0.0)}, "positive duration"),
        ({"scene": replace(SQUEEZE, gravity=(0.0, 0.0, float("nan")))}, "gravity is (0.0, 0.0, nan)"),
        ({"scene": replace(SQUEEZE, obstacles=(Sphere((0.0, 0.0, 0.0), 1e-3),))}, "0.001 m inside the body"),
        (
            {"scene": replace(SQUEEZE, obstacles=(Capsule((0.0, 0.0, 0.02), (0.0, 0.0, 0.3), 1e-3),))},
            "0.001 m inside the body",
        ),
        ({"dt": 1.0}, "lies above the stability limit of"),
        ({"dt_fraction": 1.2, "frames": 100}, "set beyond_limit to see the run diverge"),
        ({"body": TetrahedralBody(nodes=NODES, volumes="regions", regions=90)}, "more volumes than nodes lock it"),
        ({"body": TetrahedralBody(nodes=0)}, "nodes"),
        ({"body": TetrahedralBody(nodes=NODES, law="cotangent")}, "keep one volume per node"),
        ({"body": MembraneBody(nodes=NODES)}, "solid organ"),
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
    top = Held("top", HalfSpace((0.0, 0.0, 0.04), (0.0, 0.0, -1.0)), Trajectory())
    far = Held("far", HalfSpace((0.0, 0.0, 9.0), (0.0, 0.0, -1.0)))
    body = SurfaceBody()
    assert record_of(tiny_case(scene=file_scene(path, held=(top,)), body=body)).status == Status.OK
    assert "same node" in failure(tiny_case(scene=file_scene(path, held=(top, replace(top, name="again"))), body=body))
    assert "holds no node" in failure(tiny_case(scene=file_scene(path, held=(far,)), body=body))


@pytest.mark.parametrize("frame", [0, 2, FRAMES - 1])
def test_an_obstacle_that_was_inside_in_any_frame_tunnelled(ended, frame):
    """Before all else: what folds then is a sequel."""
    case, _, history = ended
    inside = np.zeros((FRAMES, 2), dtype=bool)
    inside[frame, 1] = True
    verdict, message = status_of(case, replace(history, inside=inside, min_j=-np.ones(FRAMES)))
    assert verdict == Status.TUNNELLED and f"obstacle 1 is or was inside the body in 1 of {FRAMES} frames" in message
    assert status_of(case, replace(history, inside=inside & False))[0] == Status.OK


def test_a_body_that_passed_through_itself_tunnelled(ended):
    case, _, history = ended
    assert status_of(case, history, CROSSED) == (Status.OK, "")
    verdict, message = status_of(case, history, 1.01 * CROSSED)
    assert verdict == Status.TUNNELLED and "up to 1 % of the surface lies inside the body" in message


@pytest.mark.parametrize(("share", "status"), [(0.0, Status.OK), (0.003, Status.OK), (0.02, Status.TUNNELLED)])
def test_what_lies_inside_the_body_itself_is_looked_for_at_checkpoints(monkeypatch, mesh_cache, share, status):
    """And said where it is little."""
    asked = []
    monkeypatch.setattr(module, "crossed", lambda *where: asked.append(where) or share)
    case = tiny_case()
    record = record_of(case)
    ((triangles, rest, positions),) = asked
    for name, value in {"triangles": triangles, "rest": rest, "snapshots": positions}.items():
        np.testing.assert_array_equal(record.fields[name].values, value)
    assert len(positions) == len(case.scene.checkpoints)
    assert (record.status, record.attributes["crossed"]) == (status, share)
    assert ("of the surface lies inside the body" in record.attributes["warnings"]) == (share == 0.003)


def test_remarks_know_that_elements_have_one_size(monkeypatch, mesh_cache):
    asked = []
    monkeypatch.setattr(module, "remarks", lambda scene, signs, uniform: asked.append(uniform) or ["odd"])
    assert record_of(tiny_case()).attributes["warnings"].endswith("odd") and asked == [True]


def test_measure_checks_the_scene_as_the_command_does(mesh_cache):
    """The density of a stone is remarked on; a sphere inside the ball at the start stops the case."""
    case = tiny_case()
    stone = replace(case.scene, tissue=replace(case.scene.tissue, density=3e3))
    (sentence,) = check_scene(stone)
    record = measure(case.replaced(scene=stone))
    assert record.status == Status.OK and sentence in record.attributes["warnings"]
    inside = replace(case.scene, obstacles=(Sphere((0.0, 0.0, 0.0), 0.02, Trajectory()),))
    with pytest.raises(StudyError) as problem:
        check_scene(inside)
    record = measure(case.replaced(scene=inside))
    assert (record.status, record.message) == (Status.FAILED, str(problem.value))
