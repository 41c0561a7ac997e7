"""The mass-spring lines of `make bench`: what a step costs, how that grows, and what memory it takes."""

from collections.abc import Mapping
from concurrent.futures import ThreadPoolExecutor
from dataclasses import fields, is_dataclass, replace
from time import perf_counter_ns

import numpy as np
from scipy.spatial import ConvexHull

from massspring import (
    Attachment,
    Body,
    Clock,
    Free,
    ImplicitVolume,
    Material,
    Method,
    Plane,
    Setup,
    Sphere,
    Trajectory,
    Volumes,
    simulate,
    step_limit,
    surface_body,
    tetrahedral_body,
)
from massspring.layout.threads import cores
from studies.bench.line import BenchLine
from studies.geometry import ball
from studies.metrics.timing.protocol import interleave, pinned
from studies.metrics.timing.statistics import kernel_ns, percentiles, ratio_with_spread
from studies.scene.library.ball_squeeze import RADIUS

FRAMES, STEPS, REPEATS = 200, 20, 15
LARGE_FRAMES, LARGE_STEPS, LARGE_REPEATS = 12, 20, 5
TISSUE = Material(1800.0, 1060.0)
LARGE, SMALL, HUGE = 19_500, 2_000, 200_000
"""Surface nodes: the paper's refined stomach, and the two between which growth is asked for."""


def squeezed_setup(method: Method, nodes: int = 550, frames: int = FRAMES) -> Setup:
    """The paper's surface body, held below and pressed by one plane from above; frames of 20 steps."""
    body = _surface(nodes)
    clock = Clock(STEPS * 0.5 * step_limit(body).undamped, frames, STEPS)
    press = Trajectory((0.0, 0.5 * clock.duration), ((0.0, 0.0, 0.0), (0.0, 0.0, -0.3 * RADIUS)))
    plane = Plane((0.0, 0.0, RADIUS), (0.0, 0.0, -1.0), press)
    return Setup(body, method, clock, (plane,), (_bottom(body),), damping=40.0)


def probed_setup(nodes: int, method: Method | None = None) -> Setup:
    """A surface body into which a sphere goes by 6 % of the radius while it slides sideways by 10 %."""
    body = _surface(nodes)
    clock = Clock(LARGE_STEPS * 0.5 * step_limit(body).undamped, LARGE_FRAMES, LARGE_STEPS)
    size = 0.15 * RADIUS
    slide = Trajectory((0.0, clock.duration), ((0.0, 0.0, 0.0), (0.1 * RADIUS, 0.0, -0.06 * RADIUS)))
    sphere = Sphere((0.0, 0.0, RADIUS + size), size, slide)
    return Setup(body, method or ImplicitVolume(), clock, (sphere,), (_bottom(body),), damping=40.0)


def volumes_setup(volumes: int | None) -> Setup:
    """A filled ball of 550 surface nodes that keeps so many regions, or one volume per node, under one plane."""
    mesh = ball(550)
    body = tetrahedral_body(mesh.points, mesh.triangles, mesh.tetrahedra, TISSUE)
    body = body.keeping(Volumes.nodal(body) if volumes is None else Volumes.regions(body, volumes))
    clock = Clock(STEPS * 0.5 * step_limit(body).undamped, 40, STEPS)
    press = Trajectory((0.0, clock.duration), ((0.0, 0.0, 0.0), (0.0, 0.0, -0.1 * RADIUS)))
    plane = Plane((0.0, 0.0, RADIUS), (0.0, 0.0, -1.0), press)
    return Setup(body, ImplicitVolume(), clock, (plane,), (_bottom(body),), damping=40.0)


def _surface(nodes: int) -> Body:
    mesh = ball(nodes, fill=False)
    return surface_body(mesh.points, mesh.triangles, TISSUE)


def _bottom(body: Body) -> Attachment:
    return Attachment(body.surface_nodes[body.rest[body.surface_nodes, 2] < -0.8 * RADIUS].astype(np.int64))


def _timed(setups: Mapping[str, Setup], repeats: int) -> dict[str, np.ndarray]:
    """Frame times of the second three quarters of each run [ns], (repeats, F), by turns on one pinned core."""
    with pinned():
        times = interleave({name: (lambda s=s: simulate(s).frame_ns) for name, s in setups.items()}, repeats)
    return {name: ns[:, ns.shape[1] // 4 :] for name, ns in times.items()}


def _step_us(frame_ns: np.ndarray, setup: Setup) -> float:
    return 1e-3 * kernel_ns(frame_ns) / setup.clock.steps


def without_ns(setup: Setup, method: Method) -> np.ndarray:
    """Frame times of a run, and of the same frames by another method [ns], (2, F).

    Both begin every frame in the state that the run has reached: they meet the same contacts.
    """
    state, times = setup.start(), np.zeros((2, setup.clock.frames))
    for frame in range(setup.clock.frames):
        boundary, before = setup.boundary(frame), state
        for which in (0, 1) if frame % 2 else (1, 0):
            advance = (setup.method, method)[which].advance
            begin = perf_counter_ns()
            after = advance(before, boundary)
            times[which, frame] = perf_counter_ns() - begin
            if which == 0:
                state = after
    return times


def step_lines() -> list[BenchLine]:
    """Cost of a step of the 550-node surface body in both precisions, and of its volume constraint."""
    kept = squeezed_setup(ImplicitVolume())
    setups = {"kept": kept, "free": squeezed_setup(Free()), "single": replace(kept, precision="float32")}
    times = _timed(setups, REPEATS)
    with pinned():
        both = interleave({"both": lambda: without_ns(kept, Free()).reshape(-1)}, REPEATS)["both"]
    on, off = both.reshape(REPEATS, 2, FRAMES)[:, :, FRAMES // 4 :].transpose(1, 0, 2)
    ratio = ratio_with_spread(on, off)
    springs = f"{kept.body.springs.count} springs"
    cost = {name: _step_us(ns, setups[name]) for name, ns in times.items()}
    apart = f"in runs of their own, where less is touched without it, {cost['kept'] / cost['free']:.3g}"
    rounds = f"from the same states; rounds {ratio.median:.3g} ({ratio.low:.3g} to {ratio.high:.3g}); {apart}"
    return [
        BenchLine("step, 550 surface nodes, m = 1, one plane", cost["kept"], "µs", 20.0, note=springs),
        BenchLine("the same in float32", cost["single"], "µs", 14.0),
        BenchLine("the same without the constraint", cost["free"], "µs", 20.0),
        BenchLine("constraint on / off", kernel_ns(on) / kernel_ns(off), "1", 1.18, note=rounds),
    ]


def large_lines() -> list[BenchLine]:
    """19,500 surface nodes with a probe that slides: a step in both precisions, and frames at p99."""
    double = probed_setup(LARGE)
    setups = {"double": double, "single": replace(double, precision="float32")}
    times = _timed(setups, LARGE_REPEATS)
    note = f"{double.body.springs.count} springs; a sphere slides on it"
    lines = [
        BenchLine(
            f"step, {LARGE} surface nodes, m = 1", 1e-3 * _step_us(times["double"], double), "ms", 0.75, note=note
        ),
        BenchLine("the same in float32", 1e-3 * _step_us(times["single"], double), "ms", 0.5),
    ]
    late = percentiles(times["double"])["p99"] * 1e-9 / double.clock.frame
    needs = f"p99 of computing over simulated time, dt = {double.clock.dt:.3g} s; at most 1 to keep up"
    return [*lines, BenchLine("its frames: wall over simulated time", late, "1", 1.0, note=needs)]


def threads_lines() -> list[BenchLine]:
    """The same step on two cores, where there are two: the paper's refined stomach again, both precisions."""
    if cores() < 2:
        return []
    lines = []
    for precision in ("float64", "float32"):
        one = replace(probed_setup(LARGE), precision=precision)
        two = replace(one, threads=2)
        runs = {
            "one": lambda s=one: simulate(s).frame_ns,
            "two": lambda s=two: simulate(s).frame_ns,
            "at once": lambda s=one: _beside_another(s),
        }
        with pinned(threads=2):
            times = {name: ns[:, LARGE_FRAMES // 4 :] for name, ns in interleave(runs, LARGE_REPEATS).items()}
        for name, cores_used, target, what in (
            ("two", 1.0, 1.6, f"how much faster on two threads, {LARGE} nodes"),
            ("at once", 2.0, None, "the same of two runs that share nothing: the limit of the machine"),
        ):
            ratio = ratio_with_spread(times["one"], times[name])
            note = f"{precision}; interval {cores_used * ratio.low:.3g} to {cores_used * ratio.high:.3g}"
            lines.append(BenchLine(what, cores_used * ratio.median, "1", target, at_most=False, note=note))
    return lines


def _beside_another(setup: Setup) -> np.ndarray:
    """Frame times of a run while another like it runs on the other core [ns], (F,), mean of both."""
    with ThreadPoolExecutor(2) as pool:
        return np.mean(list(pool.map(lambda _: simulate(setup).frame_ns, range(2))), axis=0)


def spiral_setup(nodes: int) -> Setup:
    """A surface body of nodes on a Fibonacci spiral over a sphere, more than the mesher offers; a plane comes near."""
    k = np.arange(nodes) + 0.5
    height, turn = 1.0 - 2.0 * k / nodes, np.pi * (1.0 + 5.0**0.5) * k
    level = np.sqrt(1.0 - height**2)
    points = RADIUS * np.column_stack([level * np.cos(turn), level * np.sin(turn), height])
    triangles = ConvexHull(points).simplices
    p, q, r = points[triangles].transpose(1, 0, 2)
    inward = np.einsum("ij,ij->i", np.cross(q - p, r - p), p) < 0
    triangles[inward] = triangles[inward][:, ::-1]
    body = surface_body(points, triangles, TISSUE)
    # A step that is stable at either size; what it costs does not depend on it.
    clock = Clock(4 * 1e-6, 8, 4)
    return Setup(body, ImplicitVolume(), clock, (Plane((0.0, 0.0, RADIUS), (0.0, 0.0, -1.0)),), (_bottom(body),))


def growth_lines() -> list[BenchLine]:
    """Time per spring and step at 200,000 surface nodes over that at 2,000; and memory per spring."""
    setups = {"small": spiral_setup(SMALL), "huge": spiral_setup(HUGE)}
    times = _timed(setups, 9)
    cost = {name: 1e3 * _step_us(ns, setups[name]) / setups[name].body.springs.count for name, ns in times.items()}
    huge = setups["huge"]
    seen: set[int] = set()
    memory = (held_bytes(huge.body, seen) + held_bytes(huge.start(), seen)) / huge.body.springs.count
    note = f"{cost['small']:.3g} and {cost['huge']:.3g} ns"
    return [
        BenchLine(
            f"time per spring-step, {HUGE} over {SMALL} nodes", cost["huge"] / cost["small"], "1", 1.6, note=note
        ),
        BenchLine("memory of body and state per spring", memory, "bytes", 400.0, note=f"{HUGE} surface nodes"),
    ]


def volumes_lines() -> list[BenchLine]:
    """Cost of a step with 128 regions and with one volume per node."""
    setups = {"regions": volumes_setup(128), "nodal": volumes_setup(None)}
    times = _timed(setups, 5)
    count = setups["nodal"].body.kept.count
    return [
        BenchLine("step, m = 128, filled ball", _step_us(times["regions"], setups["regions"]), "µs", 150.0),
        BenchLine(
            "step, one volume per node", _step_us(times["nodal"], setups["nodal"]), "µs", 300.0, note=f"m = {count}"
        ),
    ]


def held_bytes(what: object, seen: set[int]) -> int:
    """Bytes of all arrays in a dataclass or tuple, and in those inside; shared ones count once."""
    if isinstance(what, np.ndarray):
        owner = what if what.base is None else what.base
        if id(owner) in seen:
            return 0
        seen.add(id(owner))
        return what.nbytes
    if is_dataclass(what):
        return sum(held_bytes(getattr(what, field.name), seen) for field in fields(what))
    return sum(held_bytes(part, seen) for part in what) if isinstance(what, tuple) else 0
