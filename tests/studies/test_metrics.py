"""Metrics on made-up runs whose numbers are known beforehand, and the contract that every metric keeps."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from studies.case import BodyRecipe, Case
from studies.catalog import STUDIES
from studies.metrics import METRICS, Metric, Run
from studies.records import new_record
from studies.scenes import SCENES
from studies.scenes.ball_clamped import BALL_CLAMPED
from studies.scenes.ball_squeeze import BALL_SQUEEZE
from studies.store import Field, Status
from studies.table import DOUBTFUL, metric, study_table
from studies.timing import FrameTiming
from tests.studies.tiny import cube

EDGE = 0.1
POINTS, TRIANGLES, CELLS = cube(2, EDGE)
T = np.array([1.0, 2.0, 3.0, 4.0])
SCENE = replace(BALL_CLAMPED, checkpoints=(2.0, 4.0), duration=4.0)
SHIFT = np.array([0.03, 0.0, 0.0])
FLOORS = ("force", "force_end", "surface", "interior", "silhouette", "volume", "pressure", "lumen", "frequency")


def bend(x, checkpoint=-1):
    """A displacement that varies: a rigid shift and a tenth of stretch along z, whenever asked."""
    return SHIFT + np.column_stack([0 * x[:, 0], 0 * x[:, 1], 0.1 * x[:, 2]])


def reference(motion=bend, force=(1.0, 2.0), pressure=(10.0, 20.0)):
    """What Reference promises, with a displacement that is a formula."""
    return SimpleNamespace(
        displacement=motion,
        force=np.array(force),
        surface=lambda: (POINTS + motion(POINTS), TRIANGLES),
        field=lambda name: {"pressure": np.array(pressure), "lumen_pressure": np.array(pressure)}[name],
        floor={name: 0.01 * (k + 1) for k, name in enumerate(FLOORS)},
    )


def run(final=None, volume=(1.0, 1.0, 1.0, 1.0), force=(0.5, 1.0, 1.5, 2.0), **changes) -> Run:
    """A run of four frames on a cube that ends at `final` [m]; the force is felt by the upper cap, against z."""
    final = POINTS + bend(POINTS) if final is None else final
    held = np.zeros((4, 2, 3))
    held[:, 1, 2] = -np.array(force)
    values = {
        "t": T,
        "volume": EDGE**3 * np.array(volume)[:, None],
        "volume_target": np.full((len(volume), 1), EDGE**3),
        "pressure": np.full((4, 1), 5.0),
        "contact_force": np.zeros((4, 0, 3)),
        "held_force": held,
        "penetration": np.zeros((4, 1)),
        "min_j": np.array([1.0, 0.8, 0.6, 0.7]),
        "snapshots": np.stack([POINTS, final]),
        "rest": POINTS,
        "mass": np.full(len(POINTS), 1.0),
        "triangles": TRIANGLES,
        "tetrahedra": CELLS,
    } | changes.pop("values", {})
    record = new_record(
        kind="run",
        key="{}",
        name="made up",
        status=changes.pop("status", Status.OK),
        message="",
        fingerprint="",
        attributes={"rest_volume": EDGE**3, "steps": 20, "frame": 1.0, "dt": 0.05, "dt_limit": 0.1}
        | changes.pop("attributes", {}),
        fields={name: Field(np.asarray(v), "1", "made up") for name, v in values.items()},
    )
    case = Case(changes.pop("scene", SCENE), BodyRecipe())
    return Run(case, record, changes.pop("reference", reference()), changes.pop("timing", None))


def of(name: str, **changes) -> float:
    return metric(name)(run(**changes))


@pytest.mark.parametrize("entry", METRICS, ids=lambda entry: entry.name)
def test_every_metric_explains_itself(entry):
    assert entry.name.isidentifier()
    assert entry.unit
    assert entry.better in ("lower", "higher", "-")
    assert f"[{entry.unit}]" in entry.description or (entry.unit == "s/s" and "[1]" in entry.description)
    assert isinstance(entry(run()), float)


@pytest.mark.parametrize("entry", METRICS, ids=lambda entry: entry.name)
@pytest.mark.parametrize("status", [Status.DIVERGED, Status.TIMED_OUT, Status.FAILED, Status.NOT_CONVERGED])
def test_a_run_that_ended_early_has_no_numbers(entry, status):
    timing = FrameTiming(np.full((2, 4), 1e6))
    assert np.isnan(entry(run(status=status, timing=timing)))


def test_names_are_unique_and_studies_use_known_ones():
    assert len({m.name for m in METRICS}) == len(METRICS)
    for study in STUDIES:
        assert all(isinstance(metric(name), Metric) for name in study.columns)


def test_every_metric_is_a_number_somewhere():
    """A metric that no scene allows would be an empty column for ever."""
    timing = FrameTiming(np.full((2, 4), 1e6))
    for entry in METRICS:
        kept = {"attributes": {"lumen_column": 0}} if entry.quantity == "lumen" else {}
        values = [
            entry(run(scene=replace(scene, checkpoints=(2.0, 4.0), probed=SCENE.probed), timing=timing, **kept))
            for scene in SCENES
            if entry.quantity != "frequency"  # of many checkpoints: tests/studies/test_motion.py
        ]
        assert entry.quantity == "frequency" or np.isfinite(values).any(), entry.name


@pytest.mark.parametrize("entry", METRICS, ids=lambda entry: entry.name)
def test_what_a_scene_does_not_allow_is_nan(entry):
    mute = replace(SCENE, quantities=())
    needs = entry.quantity not in (None, "volume", "pressure") or "time" in entry.name
    assert np.isnan(entry(run(scene=mute))) == needs


def test_a_free_turn_forbids_displacement_but_not_silhouette():
    free = replace(BALL_SQUEEZE, checkpoints=(2.0, 4.0), probed=SCENE.probed)
    for name in ("surface_error", "interior_error", "mean_error"):
        assert np.isnan(of(name, scene=free))
        assert np.isnan(metric(name).floor(run(scene=free)))
    assert of("silhouette_error", scene=free) == pytest.approx(0.0, abs=1e-12)


def test_without_a_reference_only_the_own_volume_is_judged():
    alone = run(volume=(1.0, 0.97, 1.01, 0.98), reference=None)
    assert metric("volume_worst")(alone) == pytest.approx(3.0, rel=1e-12)
    assert metric("volume_end")(alone) == pytest.approx(-2.0, rel=1e-12)
    assert np.isnan([metric(name)(alone) for name in ("force_error", "surface_error", "silhouette_error")]).all()
    assert np.isnan(metric("volume_worst").floor(alone))


def test_penetration_is_the_deepest_of_all_frames_and_obstacles_over_the_size():
    depth = np.array([[0.0, 0.001], [0.003, 0.0], [0.0, 0.002], [0.0, 0.0]])
    assert of("penetration", values={"penetration": depth}) == pytest.approx(100 * 0.003 / (EDGE * np.sqrt(3)))
    assert np.isnan(of("penetration", values={"penetration": np.zeros((4, 0))}))


def test_rest_distance_sees_no_rigid_motion_but_a_mirror_image():
    turn = np.linalg.qr(np.random.default_rng(1).normal(size=(3, 3)))[0]
    turn *= np.linalg.det(turn)
    assert of("rest_distance", final=POINTS @ turn + [0.1, 0.2, 0.3]) == pytest.approx(0.0, abs=1e-12)
    # Two thirds of the 27 coordinates of each axis are ± edge/2, the others 0: that is how far doubling moves them.
    doubled = of("rest_distance", final=2 * POINTS)
    assert doubled == pytest.approx(100 * np.sqrt(2 / 3 * 3 * (EDGE / 2) ** 2) / (EDGE * np.sqrt(3)), rel=1e-12)
    skew = POINTS * [1.0, 2.0, 3.0]
    assert of("rest_distance", final=skew * [1, 1, -1], values={"rest": skew}) > 10


def test_the_truth_has_no_error():
    for name in ("force_error", "force_end", "surface_error", "interior_error", "mean_error", "silhouette_error"):
        # Differences of numbers near 0.1 m and 2 N: rounding alone.
        assert of(name) == pytest.approx(0.0, abs=1e-10), name


@pytest.mark.parametrize("factor", [0.9, 1.1])
def test_a_tenth_too_much_is_ten_per_cent(factor):
    final = POINTS + factor * bend(POINTS)
    assert of("surface_error", final=final) == pytest.approx(10.0, rel=1e-12)
    assert of("interior_error", final=final) == pytest.approx(10.0, rel=1e-12)


def test_a_rigid_shift_is_its_length():
    """Everything moves by 30 mm and the model by 3 mm more: a tenth everywhere, 3 mm over the diagonal of the body."""
    even = reference(lambda x: np.tile(SHIFT, (len(x), 1)))
    shifted = {"final": POINTS + 1.1 * SHIFT, "reference": even}
    for name in ("surface_error", "interior_error", "mean_error"):
        assert of(name, **shifted) == pytest.approx(10.0, rel=1e-12), name
    assert of("silhouette_error", **shifted) == pytest.approx(100 * 0.003 / (EDGE * 3**0.5), rel=1e-12)


def test_mean_error_is_over_the_largest_displacement():
    """Truth 0.1 z, error 0.01 z: a tenth of the area-weighted mean of |z| over the largest."""
    stretch = reference(lambda x: np.column_stack([0 * x[:, 0], 0 * x[:, 1], 0.1 * x[:, 2]]))
    final = POINTS + 1.1 * stretch.displacement(POINTS)
    weights = run().surface_weights
    assert weights.sum() == pytest.approx(6 * EDGE**2, rel=1e-12)
    share = float(weights @ np.abs(POINTS[:, 2])) / weights.sum() / (EDGE / 2)
    assert of("mean_error", final=final, reference=stretch) == pytest.approx(10 * share, rel=1e-12)


def test_weights_are_the_masses_inside_and_the_areas_outside():
    """The error sits on the one inner node: no surface metric sees it, and its mass decides what the interior sees."""
    inner = int(np.flatnonzero(np.abs(POINTS).max(axis=1) == 0.0)[0])
    final = POINTS + bend(POINTS)
    final[inner] += SHIFT
    assert of("surface_error", final=final) == pytest.approx(0.0, abs=1e-10)
    light = of("interior_error", final=final)
    mass = np.full(len(POINTS), 1.0)
    mass[inner] = 4.0
    assert of("interior_error", final=final, values={"mass": mass}) > 1.8 * light > 0


def test_virtual_nodes_are_no_material_points():
    """Of a surface body: two nodes on an axis that no triangle uses may be anywhere."""
    outer = np.unique(TRIANGLES)
    points = np.vstack([POINTS[outer], np.full((2, 3), 9.0)])
    triangles = np.searchsorted(outer, TRIANGLES)
    final = points + np.vstack([bend(POINTS[outer]), np.full((2, 3), 9.0)])
    values = {"rest": points, "snapshots": final[None], "triangles": triangles, "tetrahedra": np.empty((0, 4), int)}
    assert of("surface_error", values=values) == pytest.approx(0.0, abs=1e-10)
    assert np.isnan(of("interior_error", values=values))
    assert np.isnan(of("inverted_share", values=values))


def test_force_is_read_at_the_checkpoints():
    """Checkpoints at 2 and 4 s; the truth there is 1 and 2 N."""
    assert of("force_error", force=(9.0, 1.1, 9.0, 2.2)) == pytest.approx(10.0, rel=1e-12)
    assert of("force_end", force=(9.0, 1.1, 9.0, 2.2)) == pytest.approx(10.0, rel=1e-12)
    assert of("force_end", force=(9.0, 9.0, 9.0, 1.0)) == pytest.approx(-50.0, rel=1e-12)
    assert of("force_error", force=(0.0, 0.0, 0.0, 0.0)) == pytest.approx(100.0, rel=1e-12)
    one_way = of("force_error", force=(0.0, 1.3, 0.0, 2.4))
    assert one_way == pytest.approx(100 * 0.5 / 5**0.5, rel=1e-12)


def test_pressure_against_the_mean_of_the_reference():
    pressure = np.array([[1.0], [2.0], [3.0], [15.0]])
    assert of("pressure_error", values={"pressure": pressure}) == pytest.approx(-25.0, rel=1e-12)
    assert np.isnan(of("pressure_error", values={"pressure": 0 * pressure}))


def test_the_spread_of_j_is_that_of_the_bulk_of_the_volume():
    """Half of an octahedron twice as long: J is 2 there and 1 in the other half. Even growth spreads nothing."""
    assert of("j_spread", final=1.1 * POINTS) == pytest.approx(0.0, abs=1e-10)
    stretched = np.where(POINTS > 0, [[2, 1, 1]], 1.0) * POINTS
    assert of("j_spread", final=stretched) == pytest.approx(100.0, rel=1e-12)


def test_local_volume():
    assert of("min_j") == 0.6
    assert of("inverted_share") == 0.0
    assert of("inverted_share", final=POINTS * [1, 1, -1]) == 100.0
    assert of("inverted_share", final=POINTS * [1, 1, 0]) == 100.0
    turned = CELLS.copy()
    turned[5, :2] = turned[5, 1::-1]
    assert of("inverted_share", values={"tetrahedra": turned}) == pytest.approx(100 / len(CELLS), rel=1e-12)


def test_times():
    """Repeats of 1, 2, …, 100 ms; 20 steps a frame of one second."""
    timing = FrameTiming(1e6 * np.arange(1.0, 101.0).reshape(5, 20))
    assert of("frame_time", timing=timing) == pytest.approx(50.5, rel=1e-12)
    assert of("step_time", timing=timing) == pytest.approx(1e3 * 50.5 / 20, rel=1e-12)
    assert of("frame_time_p99", timing=timing) == pytest.approx(99.01, rel=1e-12)
    assert of("real_time", timing=timing) == pytest.approx(1 / 0.0505, rel=1e-12)
    assert np.isnan([of(name) for name in ("frame_time", "step_time", "frame_time_p99", "real_time")]).all()


def test_floor_stands_beside_the_number_in_the_table():
    table = study_table([run(), run(reference=None, status=Status.DIVERGED)], ["force_error", "min_j"])
    assert table["force_error floor [%]"].tolist()[0] == pytest.approx(1.0, rel=1e-12)
    assert np.isnan(table["force_error floor [%]"].tolist()[1])
    assert table["status"].tolist() == ["ok", "diverged"]
    assert table["dt [ms]"].tolist() == [50.0, 50.0]
    assert table["dt/dt_c"].tolist() == [0.5, 0.5]
    assert "min_j floor [1]" not in table


def test_doubtful_is_what_the_reference_knows_less_than_ten_times_better():
    """The floor of the force error is 1 %, of the last force 2 %: 10 and 20 % are just good enough."""
    force = metric("force_error")
    assert force.floor(run()) == pytest.approx(1.0, rel=1e-12)
    assert not force.doubtful(run(force=(9.0, 1.11, 9.0, 2.22)))
    assert force.doubtful(run(force=(9.0, 0.91, 9.0, 1.82)))
    assert metric("force_end").doubtful(run(force=(9.0, 9.0, 9.0, 1.62)))
    assert not metric("force_end").doubtful(run(force=(9.0, 9.0, 9.0, 1.58)))
    # A volume has a truth of its own, and without a reference there is nothing to doubt.
    assert not metric("volume_worst").doubtful(run())
    assert not force.doubtful(run(reference=None))
    table = study_table([run(force=(9.0, 0.91, 9.0, 1.82)), run(reference=None)], ["force_error", "min_j"])
    assert table[DOUBTFUL].tolist() == ["force_error", ""]


def test_a_floor_stands_behind_its_metric_whichever_run_has_it():
    names = list(study_table([run(reference=None), run()], ["force_error", "min_j"]))
    assert names.index("force_error floor [%]") == names.index("force_error [%]") + 1
