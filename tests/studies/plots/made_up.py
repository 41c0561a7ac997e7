"""Runs of a few nodes and frames whose numbers are known, for every scene, body, method and way to end."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np

from massspring import Free, ImplicitVolume
from massspring.body.quadratic import boundary_facets, parts_of_facets
from studies.metrics.run import Run
from studies.metrics.timing.protocol import FrameTiming
from studies.reference.solution import Boundary
from studies.runs.case import Case
from studies.runs.recipes import BODIES
from studies.scene.library.ball_clamped import BALL_CLAMPED
from studies.scene.library.ball_squeeze import BALL_SQUEEZE
from studies.scene.library.liver_press import LIVER_PRESS
from studies.store.record import Field, Status, new_record
from tests.massspring.quadratic import second_order

FRAMES = 40
"""So many that every scene has a frame at each of its checkpoints."""
RADIUS = 0.05
POINTS = RADIUS * np.array(
    [[1, 0, 0], [-1, 0, 0], [0, 1, 0], [0, -1, 0], [0, 0, 1], [0, 0, -1], [0, 0, 0]], dtype=float
)
TRIANGLES = np.array([[0, 2, 4], [2, 1, 4], [1, 3, 4], [3, 0, 4], [2, 0, 5], [1, 2, 5], [3, 1, 5], [0, 3, 5]])
CELLS = np.column_stack([TRIANGLES, np.full(len(TRIANGLES), 6)])[:, [3, 0, 1, 2]]
FINE, TEN_NODES = second_order(POINTS, CELLS)
"""The same of quadratic tetrahedra with straight sides."""
SURFACES = {"quadratic": (FINE, parts_of_facets(boundary_facets(TEN_NODES)).astype(int))}
"""Nodes and surface triangles of a kind of body; POINTS and TRIANGLES of the others."""
VOLUME = 4 / 3 * RADIUS**3
STRETCH = np.array([1.2, 1.2, 0.7])
UNCERTAINTY = {
    "force": 0.02,
    "force_end": 0.02,
    "surface": 0.015,
    "interior": 0.012,
    "silhouette": 0.01,
    "volume": 1e-5,
}
SCENES = (BALL_SQUEEZE, BALL_CLAMPED, LIVER_PRESS)


def truth(points):
    """Displacement of the made-up reference [m]."""
    return points * (STRETCH - 1)


def reference(scene):
    """What Reference promises, from formulas: force 4 N at the last checkpoint, growing with time."""
    t = np.array(scene.checkpoints)
    return SimpleNamespace(
        displacement=truth,
        boundary=Boundary(POINTS, TRIANGLES, truth(POINTS)),
        surface=lambda: (POINTS[:6] * STRETCH, TRIANGLES),
        force=4.0 * t / t[-1],
        source="made up",
        shape_error=float("nan"),
        total_uncertainty=UNCERTAINTY | {"pressure": 0.05, "surface_mean": 0.01},
        scene=scene,
        displacements=lambda points: (t / t[-1])[:, None, None] * truth(points),
        triangles=TRIANGLES,
        outside=lambda triangles: triangles,
        field=lambda name: {
            "t": t,
            "volume": 1 - 3e-5 * t / t[-1],
            "nodes": POINTS,
            "displacement": (t / t[-1])[:, None, None] * truth(POINTS),
        }[name],
    )


def fields(scene, kind, error, volume_end, good):
    """Frames of a run that ends `error` (relative) away from the reference; NaN from frame `good` on."""
    t = scene.duration * np.arange(1, FRAMES + 1) / FRAMES
    force = 4.0 * np.minimum(t / scene.checkpoints[-1], 1.0) * (1 - error)
    force[good:] = np.nan
    volume = VOLUME * (1 + volume_end * t / t[-1])
    volume[good:] = np.nan
    direction = np.asarray(scene.probed.direction)
    felt = {"obstacle": np.zeros((FRAMES, len(scene.obstacles), 3)), "held": np.zeros((FRAMES, len(scene.held), 3))}
    felt[scene.probed.what][:, scene.probed.number] = force[:, None] * direction
    points, triangles = SURFACES.get(kind, (POINTS, TRIANGLES))
    final = points + (1 + error) * truth(points)
    values = {
        "t": t,
        "volume": volume[:, None],
        "volume_target": np.full((FRAMES, 1), VOLUME),
        "contact_force": felt["obstacle"],
        "held_force": felt["held"],
        "min_j": np.where(np.arange(FRAMES) < good, np.linspace(1.0, 0.5 if error < 0.3 else -0.4, FRAMES), np.nan),
        "snapshots": np.stack([final] * len(scene.checkpoints)) if good == FRAMES else np.zeros((0, *points.shape)),
        "rest": points,
        "mass": np.ones(len(points)),
        "triangles": triangles,
        "tetrahedra": CELLS if kind == "tetrahedral" else np.zeros((0, 4), int),
    }
    return {name: Field(value, "1", "") for name, value in values.items()}


def run(scene=BALL_SQUEEZE, kind="tetrahedral", method=None, status=Status.OK, error=0.2, **options) -> Run:
    """One run. Options: volume_end [1], with_reference, frame_ms, cpu (processor over wall time), nodes, stiffness,
    dt [s], dt_limit [s], fraction."""
    good = {Status.DIVERGED: 5, Status.TIMED_OUT: 9}.get(status, FRAMES)
    dt, fixed_step = options.get("dt", 1e-3), "dt" in options
    case = Case(
        scene,
        BODIES[kind](options.get("nodes", 550), stiffness=options.get("stiffness", 1.0), **options.get("recipe", {})),
        method or ImplicitVolume(),
        dt=dt if fixed_step else "auto",
        dt_fraction=options.get("fraction", 0.5),
        timed="frame_ms" in options,
    )
    volume_end = options.get("volume_end", -0.08 if case.method.name == "free" else 1e-8)
    attributes = {
        "rest_volume": VOLUME,
        "dt": dt,
        "dt_limit": options.get("dt_limit", 2e-3),
        "steps": 5,
        "frame": scene.duration / FRAMES,
        "good_frames": good,
        "nodes": len(POINTS),
        "springs": 18,
        "law": case.body.law,
    }
    failed = status in (Status.FAILED, Status.SKIPPED)
    record = new_record(
        kind="run",
        key=case.key,
        name=case.name,
        status=status,
        message="" if status == Status.OK else f"made up to be {status}",
        fingerprint="f",
        attributes={} if failed else attributes,
        fields={} if failed else fields(scene, kind, error, volume_end, good),
    )
    reference_record = reference(scene) if options.get("with_reference", True) else None
    timing = FrameTiming(frame_ns(options["frame_ms"]), 0) if "frame_ms" in options else None
    if timing is not None and "cpu" in options:
        timing = replace(timing, cpu_ns=options["cpu"] * timing.frame_ns, processor="Z80")
    return Run(case, record, reference_record, timing)  # type: ignore[arg-type]


def frame_ns(milliseconds, repeats=5):
    """Frame times [ns], (repeats, F): the same for all but for a slow frame and a slower repeat."""
    times = np.full((repeats, FRAMES), 1e6 * milliseconds)
    times[:, 7] *= 3
    return times * (1 + 0.01 * np.arange(repeats)[:, None])


def grid(**options):
    """Every scene, body and method."""
    return [
        run(scene, kind, method, error=error, **options)
        for scene in SCENES
        for kind, error in (("tetrahedral", 0.2), ("surface", 0.5))
        for method in (Free(), ImplicitVolume())
    ]


def timed_grid():
    """Bodies with frame times: the constraint costs a quarter more."""
    return [
        run(scene, "tetrahedral", method, nodes=nodes, fraction=fraction, frame_ms=cost * nodes / 1000)
        for scene in (BALL_CLAMPED, LIVER_PRESS)
        for nodes in (150, 550)
        for fraction in (0.9, 0.3)
        for method, cost in ((Free(), 1.0), (ImplicitVolume(), 1.25))
    ]


def stability_grid():
    """dt × stiffness with every status at least once; the limit falls as the stiffness grows."""
    statuses = iter([*Status, *[Status.OK] * 9])
    return [
        run(dt=dt, stiffness=factor, method=method, status=next(statuses), dt_limit=3e-3 / np.sqrt(factor))
        for method in (Free(), ImplicitVolume())
        for factor in (0.25, 4.0)
        for dt in (5e-4, 1e-3, 2e-3, 4e-3)
    ]


def laws_grid():
    """Two laws with either kind of volumes on two meshes."""
    return [
        run(nodes=nodes, error=error, dt_limit=1.0 / nodes, law=law, volumes=volumes)
        for law, error in (("van_gelder", 0.1), ("cotangent", -0.02))
        for volumes in ("scene", "nodal")
        for nodes in (150, 550)
    ]


def without_reference(runs):
    """The same runs, their reference missing."""
    return [replace(each, reference=None) for each in runs]
