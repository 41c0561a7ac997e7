"""Metrics of a made-up run whose numbers are exact, and signs of too coarse a contact."""

from dataclasses import replace

import numpy as np
import pytest

from massspring import Plane, Sphere
from studies.metrics.contact import contact_facets, few_facets
from studies.metrics.judged import judged
from studies.metrics.metrics import contact_turn, lumen_pressure_error
from studies.metrics.table import DISTURBED, PROCESSOR, frame_of, marked, metric, row_of
from studies.metrics.timing.protocol import FrameTiming
from studies.runs.recipes import TetrahedralBody
from studies.scene.scene import ForceOutput
from tests.studies import made_up_run
from tests.studies.made_up_run import CELLS, EDGE, POINTS, SHIFT, TRIANGLES, bend, of, reference, run


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


def test_rest_distance_counts_a_node_by_its_mass():
    """A node without mass may be anywhere; with mass it cannot."""
    mass, final = np.ones(len(POINTS)), POINTS.copy()
    final[0] += SHIFT
    assert of("rest_distance", final=final, values={"mass": mass}) > 1
    mass[0] = 0
    assert of("rest_distance", final=final, values={"mass": mass}) == pytest.approx(0.0, abs=1e-10)


@pytest.mark.parametrize("factor", [1.0, 1.1])
def test_a_tenth_too_much_is_ten_per_cent_and_the_truth_has_no_error(factor):
    made = {"final": POINTS + factor * bend(POINTS), "force": factor * np.array([0.5, 1.0, 1.5, 2.0])}
    for name in ("force_error", "force_end", "surface_error", "interior_error"):
        # Differences of numbers near 0.1 m and 2 N: rounding alone.
        assert of(name, **made) == pytest.approx(100 * (factor - 1), rel=1e-9, abs=1e-10), name


def test_a_rigid_shift_is_its_length():
    """The reference moves by 30 mm, the body by 3 mm more: errors are a tenth, or 3 mm over the body's diagonal."""
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


@pytest.mark.parametrize("corner", [0, 4])
def test_mean_error_counts_a_node_by_its_share_of_the_area(corner):
    """One node off by a tenth of the largest displacement: 1 % times a third of its triangles over all of them."""
    even = reference(lambda x: np.tile(SHIFT, (len(x), 1)))
    final = POINTS + SHIFT
    final[corner] += 0.1 * SHIFT
    share = (corner == TRIANGLES).sum() / (3 * len(TRIANGLES))  # all triangles of the cube have the same area
    error = of("mean_error", final=final, reference=even)
    assert error == pytest.approx(10 * share, rel=1e-9, abs=1e-10)
    assert error != pytest.approx(10 / len(POINTS), rel=0.05)  # what the plain mean would be


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


def stretched_cells(volumes, ratios):
    """Separate tetrahedra of these rest volumes, stretched so that J of each is its ratio: the spread of J [%]."""
    corner = np.vstack([np.zeros(3), np.eye(3)])
    rest = np.concatenate([np.cbrt(6 * volume) * corner for volume in volumes])
    final = np.concatenate([np.cbrt(6 * v) * corner * [1, 1, j] for v, j in zip(volumes, ratios, strict=True)])
    cells = np.arange(len(rest)).reshape(-1, 4)
    return of("j_spread", values={"rest": rest, "snapshots": final[None], "tetrahedra": cells})


def test_the_spread_of_j_leaves_out_a_twentieth_of_the_volume_at_either_end():
    """50 tetrahedra of 2 % of the volume, J = 1.00, 1.01, …: the third is reached at 5 %, the 48th at 95 %."""
    rising = 1 + 0.01 * np.arange(50)
    assert stretched_cells(np.full(50, 1e-6), rising) == pytest.approx(45.0, rel=1e-9)
    # The first holds a tenth of the volume, the last a twenty-fifth: 5 % lie in the first, 95 % in the one before it.
    volumes = np.array([0.10, *np.full(43, 0.02), 0.04]) * 1e-4
    assert stretched_cells(volumes, rising[:45]) == pytest.approx(43.0, rel=1e-9)


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
    own = replace(timing, cpu_ns=timing.frame_ns / 2)
    assert of("frame_cpu", timing=own) == pytest.approx(25.25, rel=1e-12) and np.isnan(of("frame_cpu", timing=timing))
    assert of("real_time_cpu", timing=own) == pytest.approx(2 / 0.0505, rel=1e-12)
    assert np.isnan([of(name) for name in ("frame_time", "step_time", "frame_time_p99", "real_time")]).all()


def test_of_several_volumes_the_farthest_off_counts():
    """Of three frames the second volume is the one that is off, in the last frame the first is, the other way."""
    ratios = np.array([[1.0, 1.0], [1.0, 0.98], [1.01, 0.95], [1.03, 0.99]])
    target = EDGE**3 * np.array([[1.0, 3.0]] * 4)
    values = {"volume": ratios * target, "volume_target": target}
    assert of("volume_worst", values=values) == pytest.approx(5.0, rel=1e-12)
    assert of("volume_end", values=values) == pytest.approx(3.0, rel=1e-12)


def test_pressure_of_the_tissue_is_weighted_by_volume_and_leaves_the_lumen_out():
    """Volumes 1 and 3 at 40 and 20 Pa: 25 Pa, where the truth is 20 Pa. A lumen of any size between them is none."""
    target, pressure = EDGE**3 * np.array([[1.0, 3.0]] * 4), np.array([[40.0, 20.0]] * 4)
    tissue = {"volume_target": target, "pressure": pressure}
    assert of("pressure_error", values=tissue) == pytest.approx(25.0, rel=1e-12)
    values = {"volume_target": np.insert(target, 1, EDGE**3, axis=1), "pressure": np.insert(pressure, 1, 30.0, axis=1)}
    assert of("pressure_error", values=values, attributes={"lumen_column": 1}) == pytest.approx(25.0, rel=1e-12)


def test_the_spread_of_a_time_is_half_its_range_over_the_repeats():
    times = 1e6 * np.array([[4.0, 4.0, 4.0, 4.0], [5.0, 5.0, 5.0, 5.0], [7.0, 7.0, 7.0, 7.0]])
    spread = metric("frame_time").spread
    assert spread is not None
    assert spread(run(timing=FrameTiming(times))) == pytest.approx(1.5, rel=1e-12)
    assert np.isnan(spread(run(timing=FrameTiming(times[:1]))))
    own = metric("frame_cpu").spread
    assert own is not None
    assert own(run(timing=FrameTiming(times, cpu_ns=0.98 * times))) == pytest.approx(0.98 * 1.5, rel=1e-12)


def test_a_disturbed_time_has_no_spread_and_is_marked():
    """It waited a fifth of the second repeat."""
    times = np.full((2, 4), 5e6)
    disturbed = run(timing=FrameTiming(times, cpu_ns=times * [[0.95], [0.8]], processor="Z80"))
    quiet = run(timing=FrameTiming(times, cpu_ns=0.95 * times, processor="Z80"))
    row, other = (row_of(one, [metric("frame_time")]) for one in (disturbed, quiet))
    assert np.isnan(row["frame_time floor [ms]"]) and other["frame_time floor [ms]"] == 0.0
    assert "waited 20 %" in row[DISTURBED] and marked(row).endswith("¶") and "¶" not in marked(other)
    assert list(frame_of([row, other])[PROCESSOR]) == ["Z80", "Z80"] and DISTURBED not in frame_of([other])
    assert row_of(disturbed, [metric("min_j")])[DISTURBED] == ""
    costs = [judged(one) for one in (disturbed, quiet)]
    assert np.isnan(costs[0].cost.uncertainty) and costs[0].disturbed == row[DISTURBED]
    assert costs[1].cost.uncertainty == 0.0 and costs[1].processor_cost.value == pytest.approx(0.95 * 5e-3)


def test_the_pressure_of_a_lumen_is_that_of_its_own_column():
    """The tissue, column 0, has another one. The reference ends at 20 Pa."""
    volume = np.full((4, 2), EDGE**3 / 2)
    values = {"volume": volume, "volume_target": volume, "pressure": np.tile([50.0, 22.0], (4, 1))}
    attributes = {"volumes": 2, "lumen_column": 1}
    assert lumen_pressure_error.of(run(values=values, attributes=attributes)) == pytest.approx(10.0, rel=1e-12)
    assert np.isnan(lumen_pressure_error(run()))


PUSH = (0.0, 0.0, -1.0)


def pressed(height, force=(0.0, 0.0, -2.0)):
    """The cube below a plane at `height` [m]; the body is where it is at rest."""
    made = made_up_run.run(
        values={"contact_force": np.tile(force, (4, 1, 1)), "snapshots": np.tile(made_up_run.POINTS, (2, 1, 1))}
    )
    scene = replace(
        made.case.scene,
        obstacles=(Plane((0.0, 0.0, height), PUSH),),
        probed=ForceOutput("obstacle", 0, PUSH),
    )
    return replace(made, case=replace(made.case, scene=scene, body=TetrahedralBody()))


def test_facets_are_counted_that_reach_the_plane():
    top = made_up_run.POINTS[:, 2].max()
    on_top = (made_up_run.POINTS[made_up_run.TRIANGLES][:, :, 2] == top).any(axis=1).sum()
    assert contact_facets(pressed(top)) == on_top > 0
    assert contact_facets(pressed(top + 0.01)) == 0
    assert contact_facets(pressed(top - 2 * made_up_run.EDGE)) == len(made_up_run.TRIANGLES)


@pytest.mark.parametrize("degrees", [0.0, 30.0])
def test_the_force_is_turned_by_the_angle(degrees):
    angle = np.radians(degrees)
    assert contact_turn(pressed(0.1, (2 * np.sin(angle), 0.0, -2 * np.cos(angle)))) == pytest.approx(degrees, abs=1e-6)


def test_without_an_obstacle_there_is_neither():
    held = made_up_run.run()
    assert np.isnan(contact_facets(held)) and np.isnan(contact_turn(held))
    assert np.isnan(contact_turn(pressed(0.1, (0.0, 0.0, 0.0))))


@pytest.mark.parametrize(("radius", "few"), [(0.1, False), (5.0, False), (0.004, True)])
def test_few_facets_are_marked(radius, few):
    """A ball that only just touches the top of the cube in the middle of a facet, one that is off it, and a wide one
    that reaches all facets."""
    made = pressed(0.1)
    top = made_up_run.POINTS[made_up_run.TRIANGLES].mean(axis=1)[
        np.argmax(made_up_run.POINTS[made_up_run.TRIANGLES].mean(axis=1)[:, 2])
    ]
    off = {0.1: 0.05, 5.0: -1.0, 0.004: 0.0}[radius]
    tool = Sphere((top[0], top[1], top[2] + radius + off), radius)
    scene = replace(made.case.scene, obstacles=(tool,))
    assert few_facets(replace(made, case=replace(made.case, scene=scene))) == few
