"""Metrics of a run: functions Run -> float, each with its unit, direction and quantity of the reference."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from studies.geometry.mesh.organ_mesh import tetrahedron_volumes
from studies.geometry.surface.distance import hausdorff
from studies.metrics import cutting
from studies.metrics.contact import contact_facets
from studies.metrics.interval import interval
from studies.metrics.metric import PERCENT, Metric, compared
from studies.metrics.run import Run
from studies.reference.ringing import ringing_frequency


def volume_worst(run: Run) -> float:
    """100 max |V/V0 − 1| over all frames [%]."""
    return PERCENT * float(np.max(np.abs(run.volume_ratio - 1)))


def volume_end(run: Run) -> float:
    """100 (V/V0 − 1) after the last frame [%]."""
    return PERCENT * float(run.volume_ratio[-1] - 1)


@compared("%", "lower", "force")
def force_error(run: Run) -> float:
    """100 ‖F − F_ref‖/‖F_ref‖ over the checkpoints [%]."""
    assert run.reference is not None
    truth = run.reference.force
    return PERCENT * float(np.linalg.norm(run.force[run.checkpoint_frames] - truth) / np.linalg.norm(truth))


@compared("%", "-", "force_end")
def force_end(run: Run) -> float:
    """100 (F/F_ref − 1) at the last checkpoint [%]."""
    assert run.reference is not None
    return PERCENT * float(run.force[run.checkpoint_frames[-1]] / run.reference.force[-1] - 1)


def _relative(run: Run, weights: np.ndarray) -> float:
    truth, error = run.displacement_error
    return PERCENT * float(np.sqrt((weights @ (error**2).sum(axis=1)) / (weights @ (truth**2).sum(axis=1))))


@compared("%", "lower", "surface")
def surface_error(run: Run) -> float:
    """Area-weighted relative L2 error of the displacement of the surface at the last checkpoint [%].

    Evaluated at the nodes of the body, as interior_error.
    """
    return _relative(run, run.surface_weights)


@compared("%", "lower", "interior")
def interior_error(run: Run) -> float:
    """Volume-weighted relative L2 error of the displacement at the last checkpoint [%]; NaN without an interior.

    Evaluated at the nodes of the body, so it does not include parts of the organ that the body lacks; shape_error does.
    """
    if not len(run.fields.tetrahedra):
        return float("nan")
    return _relative(run, run.fields.mass)


@compared("%", "lower", "surface_mean")
def mean_error(run: Run) -> float:
    """Area-weighted mean error over the true surface, with what the body lacks, over the largest displacement [%].

    Every boundary node of the reference is compared with the nearest point of the body at rest. If the distance exceeds
    1 % of the size, it is added to the error, so that no point is left out. Duan et al. 2016 use the mean over a
    surface.
    """
    mean, largest = run.true_surface_error
    return PERCENT * mean / largest


def force_within(run: Run) -> float:
    """What 90 of 100 errors of the force stay within, by a second mesh [%]; NaN with a reference."""
    return interval(run).force


def mean_within(run: Run) -> float:
    """What 90 of 100 mean errors of the displacement stay within, by a second mesh [%]; NaN with a reference."""
    return interval(run).displacement


def shape_error(run: Run) -> float:
    """Largest distance of the body at rest from the true surface and back, over the organ's size [%].

    Curved facets are treated as curved; for a hollow organ with a wall the lumen is included. NaN if the true shape is
    unknown.
    """
    return PERCENT * run.shape.distance


def shape_volume(run: Run) -> float:
    """100 (V/V_true − 1) of the body at rest [%]: of its tissue, or of what a surface body encloses."""
    return PERCENT * run.shape.volume


@compared("%", "lower", "silhouette")
def silhouette_error(run: Run) -> float:
    """Hausdorff distance of the deformed surface to its deformation by the reference, over the body's size [%]."""
    triangles = run.fields.triangles
    # The same polyhedron, moved by the reference: shape_error covers the difference of the body from the organ.
    truth = run.fields.rest.copy()
    truth[run.material_nodes] += run.displacement_error[0]
    return PERCENT * hausdorff(run.fields.snapshots[-1], triangles, truth, triangles) / run.size


def min_j(run: Run) -> float:
    """Least J of an element after any frame [1]; NaN for a surface body."""
    return float(np.min(run.fields.min_j))


def inverted_share(run: Run) -> float:
    """Share of tetrahedra turned inside out at the last checkpoint [%]; NaN for a surface body."""
    cells = run.fields.tetrahedra
    if not len(cells):
        return float("nan")
    return PERCENT * float((tetrahedron_volumes(run.fields.snapshots[-1], cells) <= 0).mean())


def j_spread(run: Run) -> float:
    """100 × (95th − 5th percentile of J over the rest volume) at the last checkpoint [%]; NaN for a surface body."""
    cells = run.fields.tetrahedra
    if not len(cells):
        return float("nan")
    rest = tetrahedron_volumes(run.fields.rest, cells)
    ratio = tetrahedron_volumes(run.fields.snapshots[-1], cells) / rest
    order = np.argsort(ratio)
    below = np.cumsum(rest[order]) / rest.sum()
    low, high = ratio[order][np.searchsorted(below, (0.05, 0.95))]
    return PERCENT * float(high - low)


def rest_distance(run: Run) -> float:
    """100 × RMS distance of the nodes from their rest shape, moved and turned to fit, over the body's size [%]."""
    rest, last = run.fields.rest, run.fields.snapshots[-1]
    mass = run.fields.mass / run.fields.mass.sum()
    before, after = rest - mass @ rest, last - mass @ last
    left, _, right = np.linalg.svd((mass[:, None] * before).T @ after)
    # A rotation without reflection (Kabsch 1976).
    turn = left @ np.diag([1.0, 1.0, np.linalg.det(left @ right)]) @ right
    return PERCENT * float(np.sqrt(mass @ ((after - before @ turn) ** 2).sum(axis=1)) / run.size)


def penetration(run: Run) -> float:
    """100 × the deepest any point of the surface lies inside an obstacle after a frame, over the body's size [%]; NaN
    without one."""
    depth = run.fields.penetration
    return (
        PERCENT * float(depth.max()) / float(np.linalg.norm(np.ptp(run.fields.rest, axis=0))) if depth.size else np.nan
    )


@compared("%", "-", "pressure")
def pressure_error(run: Run) -> float:
    """100 (lam/p_ref − 1) at the last checkpoint [%]; NaN for a method without a pressure."""
    assert run.reference is not None
    lam = float(run.tissue_pressure[run.checkpoint_frames[-1]])
    return PERCENT * (lam / float(run.reference.field("pressure")[-1]) - 1) if lam else float("nan")


@compared("%", "lower", "opening")
def opening_error(run: Run) -> float:
    """Area-weighted relative L2 error of the displacement across the cut at the last checkpoint [%], of several cuts
    the largest."""
    assert run.reference is not None
    truth, cut = run.reference.opening(run.fields.rest[run.cut_pairs[:, 0]]), run.cut_of_pairs
    error, size = (np.bincount(cut, run.cut_weights * (part**2).sum(axis=1)) for part in (run.opening - truth, truth))
    return PERCENT * float(np.sqrt(error / size).max())


def overlap(run: Run) -> float:
    """Deepest overlap of the faces of the cut at the last checkpoint, along its normal at rest, over the size [%]."""
    if not run.case.scene.cuts:
        return float("nan")
    return PERCENT * max(0.0, -float(run.gap(run.opening).min())) / run.size


@compared("%", "-", "frequency")
def frequency_error(run: Run) -> float:
    """100 (f/f_ref − 1) of the ringing, both read off the displacement of the same points [%]."""
    assert run.reference is not None
    rest, weights, scene = run.fields.rest[run.material_nodes], run.surface_weights, run.case.scene
    t = run.fields.t[run.checkpoint_frames]
    own = run.fields.snapshots[:, run.material_nodes] - rest
    times, truth = np.array(scene.checkpoints), run.reference.displacements(rest)
    measured, right = (ringing_frequency(scene, at, rest, u, weights) for at, u in ((t, own), (times, truth)))
    return PERCENT * (measured / right - 1)


@compared("%", "-", "lumen")
def lumen_pressure_error(run: Run) -> float:
    """100 (lam/p_ref − 1) of the lumen at the last checkpoint [%]; NaN where the lumen is no volume of its own."""
    assert run.reference is not None
    if run.lumen is None:
        return float("nan")
    lam = float(run.fields.pressure[run.checkpoint_frames[-1], run.lumen])
    return PERCENT * (lam / float(run.reference.field("lumen_pressure")[-1]) - 1) if lam else float("nan")


def alternation(run: Run) -> float:
    """100 × rms jump of the pressure between neighbouring volumes at the end, over the shear modulus [%]."""
    return PERCENT * float(run.record.attributes.get("alternation", np.nan))


def sway(run: Run) -> float:
    """100 × range of the force about its trend in the last frames at rest, over its mean [%]; NaN without a force."""
    if "force" not in run.case.scene.quantities:
        return float("nan")
    return PERCENT * float(run.record.attributes.get("sway", np.nan))


def heaviness(run: Run) -> float:
    """Inertial mass of the body over that of its tissue [1]."""
    return float(run.record.attributes.get("heaviness", np.nan))


def unbalanced(run: Run) -> float:
    """100 × largest force at a checkpoint that moves the body, over the largest probed force [%]; NaN without one."""
    if "force" not in run.case.scene.quantities:
        return float("nan")
    return PERCENT * float(run.record.attributes.get("unbalanced", np.nan))


def contact_turn(run: Run) -> float:
    """Angle between the force of the probed obstacle and its push at the last checkpoint [deg].

    With too few facets in contact the force has a wrong direction; the true force may have an angle too. NaN without an
    obstacle.
    """
    scene = run.case.scene
    forces = run.fields.contact_force
    if scene.probed.what != "obstacle" or scene.probed.number >= forces.shape[1]:
        return float("nan")
    force = forces[run.checkpoint_frames[-1], scene.probed.number]
    size = float(np.linalg.norm(force))
    return float(np.degrees(np.arccos(np.clip(force @ scene.probed.direction / size, -1, 1)))) if size else float("nan")


def _timing(run: Run, quantile: float, of: str = "frame_ns") -> float:
    times = getattr(run.timing, of, None)
    return float("nan") if times is None else float(np.quantile(times, quantile))


def step_time(run: Run) -> float:
    """Median of frame time over the steps of the frame [µs]; NaN where these are not known."""
    if run.timing is None:
        return float("nan")
    counted = run.fields.frame_steps
    steps = (run.attributes.steps or float("nan")) if counted is None else counted
    return 1e-3 * float(np.median(run.timing.frame_ns / steps))


def frame_time(run: Run) -> float:
    """Median frame time [ms]."""
    return 1e-6 * _timing(run, 0.5)


def frame_cpu(run: Run) -> float:
    """Median processor time of a frame [ms]: what other programs disturb least."""
    return 1e-6 * _timing(run, 0.5, "cpu_ns")


def frame_time_p99(run: Run) -> float:
    """99th percentile of the frame time [ms]."""
    return 1e-6 * _timing(run, 0.99)


def real_time(run: Run) -> float:
    """Simulated seconds per second of computing [1]: what explicit steps of different size are compared by."""
    return float(run.attributes.frame) / (1e-9 * _timing(run, 0.5))


def real_time_cpu(run: Run) -> float:
    """Simulated seconds per second of processor time [1]."""
    return float(run.attributes.frame) / (1e-9 * _timing(run, 0.5, "cpu_ns"))


def _time_spread(metric: Callable[[Run], float]) -> Callable[[Run], float]:
    """Half the range of a metric of frame times over the repeats, in its unit; NaN if the case was timed only once, or
    the timing is disturbed: the range is then that of the other load."""

    def spread(run: Run) -> float:
        if run.timing is None or len(run.timing.frame_ns) < 2 or run.timing.disturbed:
            return float("nan")
        return float(np.ptp([metric(replace(run, timing=one)) for one in run.timing.repeats()])) / 2

    return spread


METRICS: tuple[Metric, ...] = (
    Metric("volume_worst", "%", "lower", volume_worst, "volume"),
    Metric("volume_end", "%", "-", volume_end, "volume"),
    force_error,
    force_end,
    surface_error,
    interior_error,
    mean_error,
    silhouette_error,
    Metric("force_within", "%", "lower", force_within),
    Metric("mean_within", "%", "lower", mean_within),
    Metric("shape_error", "%", "lower", shape_error),
    Metric("shape_volume", "%", "-", shape_volume),
    opening_error,
    Metric("overlap", "%", "lower", overlap),
    Metric("piece_worst", "%", "lower", cutting.piece_worst),
    Metric("piece_sum_worst", "%", "lower", cutting.piece_sum_worst),
    Metric("cut_energy", "%", "lower", cutting.cut_energy),
    Metric("cut_momentum", "%", "lower", cutting.cut_momentum),
    Metric("cut_limit", "1", "higher", cutting.cut_limit),
    Metric("cut_ms", "ms", "lower", cutting.cut_ms),
    pressure_error,
    frequency_error,
    lumen_pressure_error,
    Metric("min_j", "1", "higher", min_j),
    Metric("j_spread", "%", "lower", j_spread),
    Metric("inverted_share", "%", "lower", inverted_share),
    Metric("rest_distance", "%", "lower", rest_distance),
    Metric("penetration", "%", "lower", penetration),
    Metric("alternation", "%", "lower", alternation),
    Metric("sway", "%", "lower", sway),
    Metric("heaviness", "1", "lower", heaviness),
    Metric("unbalanced", "%", "lower", unbalanced),
    Metric("contact_facets", "1", "higher", contact_facets),
    Metric("contact_turn", "deg", "lower", contact_turn),
    Metric("step_time", "µs", "lower", step_time, spread=_time_spread(step_time)),
    Metric("frame_time", "ms", "lower", frame_time, spread=_time_spread(frame_time)),
    Metric("frame_cpu", "ms", "lower", frame_cpu, spread=_time_spread(frame_cpu)),
    Metric("frame_time_p99", "ms", "lower", frame_time_p99, spread=_time_spread(frame_time_p99)),
    Metric("real_time", "s/s", "higher", real_time, spread=_time_spread(real_time)),
    Metric("real_time_cpu", "s/s", "higher", real_time_cpu, spread=_time_spread(real_time_cpu)),
)
