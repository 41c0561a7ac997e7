"""What a trial simulates: bodies that no mesher would make, what holds them and what comes at them."""

import math
from collections.abc import Mapping
from dataclasses import replace

import numpy as np
from scipy.spatial import Delaunay

import massspring as ms
from massspring.body.points import PAIRS
from studies.base.errors import StudyError
from studies.geometry import organ
from studies.geometry.mesh.organ_mesh import boundary_triangles, surface_first, tetrahedron_volumes
from studies.runs.limits import check_size
from studies.scene.start import InitialConditions
from studies.tools.fuzz.trial import FRAMES, ORGANS, QUADRATIC, SURFACE, Trial, method_of

RADIUS, DENSITY = 0.05, 1000.0
FLATTEST = 1e-12
"""Volume of a tetrahedron over the cube of the radius below which it is none: Delaunay leaves such at the hull."""
STRETCH = {"needle": (20.0, 1.0, 1.0), "sheet": (1.0, 1.0, 0.03)}
ORGAN_NODES = 150, 230
REGIONS = 4
HELD = 0.25
"""Share of the height that is held."""
STARTS: Mapping[str, InitialConditions] = {
    "rest": InitialConditions(),
    "flattened": InitialConditions(((1, 0, 0), (0, 1, 0), (0, 0, 0.01))),
    "mirrored": InitialConditions(((-1, 0, 0), (0, 1, 0), (0, 0, 1))),
    "scrambled": InitialConditions(scatter=0.5),
    "shrunk": InitialConditions(((0.2, 0, 0), (0, 0.2, 0), (0, 0, 0.2))),
    "collapsed": InitialConditions(((0, 0, 0), (0, 0, 0), (0, 0, 0))),
}
Mesh = tuple[np.ndarray, np.ndarray]


def mesh_of(trial: Trial) -> Mesh:
    """Points (n, 3) [m] and tetrahedra (k, 4), positive."""
    rng = np.random.default_rng((trial.seed, trial.number, 1))
    if trial.shape in ORGANS:
        mesh = organ(trial.shape, ORGAN_NODES[trial.nodes % len(ORGAN_NODES)])
        return mesh.points, mesh.tetrahedra
    if trial.shape == "cell":
        return upright(RADIUS * rng.standard_normal((4, 3)), np.array([[0, 1, 2, 3]]))
    points, cells = cloud(rng, trial.nodes, trial.shape == "sliver")
    if trial.shape == "two":
        other, more = cloud(rng, trial.nodes)
        return np.vstack([points, other + 3 * RADIUS * np.eye(3)[2]]), np.vstack([cells, more + len(points)])
    return upright(points * STRETCH.get(trial.shape, (1.0, 1.0, 1.0)), cells)


def cloud(rng: np.random.Generator, nodes: int, slivers: bool = False) -> Mesh:
    """Random points in a ball and what Delaunay makes of them; `slivers`: a third of them nearly in one plane."""
    directions = rng.standard_normal((nodes, 3))
    points = RADIUS * rng.random((nodes, 1)) ** (1 / 3) * directions / np.linalg.norm(directions, axis=1, keepdims=True)
    points[: len(points) // 3, 2] *= 1e-3 if slivers else 1.0
    return upright(points, Delaunay(points).simplices.astype(np.int64))


def upright(points: np.ndarray, cells: np.ndarray) -> Mesh:
    """With positive volumes, without cells that have none, and without points that no cell uses."""
    volume = tetrahedron_volumes(points, cells)
    cells = np.where(volume[:, None] < 0, cells[:, [0, 2, 1, 3]], cells)[np.abs(volume) > FLATTEST * RADIUS**3]
    used, cells = np.unique(cells, return_inverse=True)
    return points[used], cells.reshape(-1, 4)


def body_of(trial: Trial) -> ms.Body:
    """Raises MassSpringError or StudyError for one that cannot be."""
    points, cells = mesh_of(trial)
    points = points + trial.far * np.array([1.0, -1.0, 1.0]) / np.sqrt(3.0)
    body = _built(trial, points, cells, ms.Material(trial.modulus, DENSITY))
    if trial.heaviest > 1.0:
        rng = np.random.default_rng((trial.seed, trial.number, 2))
        body = replace(body, mass=body.mass * trial.heaviest ** rng.random(body.node_count))
    return body


def _built(trial: Trial, points: np.ndarray, cells: np.ndarray, material: ms.Material) -> ms.Body:
    if trial.kind == QUADRATIC:
        edges, middle = np.unique(np.sort(cells[:, PAIRS].reshape(-1, 2), axis=1), axis=0, return_inverse=True)
        ten = np.hstack([cells, len(points) + middle.reshape(-1, 6)])
        return ms.quadratic_body(np.vstack([points, points[edges].mean(axis=1)]), ten, material)
    if trial.kind == SURFACE:
        points, triangles, _, count = surface_first(points, cells)
        return ms.surface_body(points[:count], triangles, material)
    body = ms.tetrahedral_body(points, boundary_triangles(cells), cells, material, trial.law)
    if trial.volumes == "regions":
        return body.keeping(ms.Volumes.regions(body, REGIONS))
    kept = {"nodal": ms.Volumes.nodal, "patches": ms.Volumes.patches}
    return body.keeping(kept[trial.volumes](body)) if trial.volumes in kept else body


def setup_of(trial: Trial) -> ms.Setup:
    """Raises MassSpringError or StudyError for a trial that is refused."""
    method, body = method_of(trial.method)(), body_of(trial)
    reason = method.why_not(body)
    if reason is not None:
        raise StudyError(f"method '{method.name}' does not apply: {reason}")
    height = body.rest[:, 2]
    low = np.flatnonzero(height <= height.min() + HELD * np.ptp(height))
    held = low if trial.held or trial.load == "jump" else low[:0]
    undamped = ms.step_limit(body, held_nodes=held if len(held) else None)
    limit = ms.StepLimit(undamped.frequency, trial.damping * undamped.frequency)
    dt = trial.dt_fraction * limit.damped
    clock = ms.Clock(trial.steps * dt / FRAMES, FRAMES, trial.steps // FRAMES)
    obstacles = _obstacles(trial, body, clock)
    check_size(clock.duration, clock.frames, clock.dt, limit, body, len(obstacles) + bool(len(held)))
    far, start = trial.depth * float(np.ptp(body.rest, axis=0).max()), STARTS[trial.start]
    jump = ms.Trajectory((0.0, 1e-9), ((0.0, 0.0, 0.0), (far, 0.0, 0.0)))  # elsewhere from the second step on
    target = ms.Ramp((0.0, 0.5 * clock.dt), (1.0, trial.target))
    return ms.Setup(
        body,
        method,
        clock,
        obstacles,
        (ms.Attachment(held, jump if trial.load == "jump" else ms.Trajectory()),) if len(held) else (),
        (0.0, 0.0, -trial.gravity),
        limit.damping,
        targets={} if trial.target == 1.0 else {body.kept.names[0]: target},
        positions=start.positions(body.rest) if start.shaped else None,
        precision="float32" if trial.precision == "float32" else "float64",
    )


def _obstacles(trial: Trial, body: ms.Body, clock: ms.Clock) -> tuple[ms.Obstacle, ...]:
    """From above, and for a pinch from below too; they begin just outside, and go no deeper than the depth."""
    low, high = body.rest.min(axis=0), body.rest.max(axis=0)
    middle, extent = 0.5 * (low + high), high - low
    depth = trial.depth * float(extent[2])
    path = ms.Trajectory((0.0, max(depth / trial.speed, clock.dt)), ((0.0, 0.0, 0.0), (0.0, 0.0, -depth)))
    friction = trial.friction if isinstance(trial.friction, float) else "no_slip"
    radius = 0.3 * float(min(extent))
    above = (middle[0], middle[1], high[2] + 1.001 * radius)
    lid = ms.Plane((middle[0], middle[1], high[2]), (0.0, 0.0, -1.0), path, friction)
    if trial.load == "plane":
        return (lid,)
    if trial.load == "pinch":
        return lid, ms.Plane((middle[0], middle[1], low[2]), (0.0, 0.0, 1.0), friction=friction)
    if trial.load == "sphere":
        return (ms.Sphere(above, radius, path, friction),)
    if trial.load == "capsule":
        reach = math.hypot(extent[0], extent[1])
        ends = (above[0] - reach, *above[1:]), (above[0] + reach, *above[1:])
        return (ms.Capsule(*ends, radius, path, friction),)
    top = body.rest[body.surface_nodes[np.argmax(body.rest[body.surface_nodes, 2])]]
    tip = (top[0], top[1], top[2] + 0.01 * float(extent[2]))
    return (ms.Probe(tip, 0.0, path),) if trial.load == "probe" else ()
