"""A member of a population: an organ of its own under a load of its own: palpated, filled, hanging, or squeezed."""

import zlib
from collections.abc import Iterable
from dataclasses import dataclass, replace
from functools import cache

import numpy as np

from massspring import Plane, Ramp, Sphere, Trajectory
from studies import SHAPES, ForceOutput, Lumen, Organ, Scene, StudyError
from studies.geometry import vary
from studies.geometry.organs.millimetres import probe_near
from studies.geometry.shape.levelset import PalpationPoint, Shape, normals, project
from studies.lab.population.ranges import RANGES, SQUEEZE, SQUEEZED, Filling, Palpation, Sagging
from studies.scene.placing import Vector, along, press_times, probe_of, scaled

NAME, SQUEEZED_NAME = "{organ}_{seed}_{number:03d}", "{organ}_squeezed_{seed}_{number:03d}"
"""Of a member's scene."""
GAP = 0.0005
"""Between probe and surface at the start [m]."""
PRESSED = 0.6
"""Share of the duration in which the probe moves; then all comes to rest."""
CHECKPOINTS = 2
"""At half the depth and at rest: a member has a quarter of the time that a scene of the catalogue has."""
FRAMES = 80
TRIES = 100
FLAT = 0.9
"""Least length of the mean normal round the patch that a probe touches: 1 is a plane, 0.9 a cone of 26 degrees."""
BEHIND = 0.0009
"""Between a filled organ and the wall behind it [m], as in the scenes of the catalogue."""
BESIDE = 0.0015
"""Between a squeezed organ and each plane at the start [m]: curved facets of coarse meshes bulge that far."""
CLEAR = 0.002
"""Between each plane at the end and what is held [m]."""
DIRECTIONS = 1000
"""In which a squeeze is tried: a stomach that is squeezed by 45 % has one in fifty."""
LIGHT = 4.0
"""Damping of a squeezed organ [1/s]: its slow swing between the planes dies away, yet energy that a method adds shows
(with 2/s the force of a kidney still varies by 1 % at the end)."""
ALL = Scene.quantities
"""A squeezed organ is held and pressed: every quantity is compared."""
COLUMNS = 24
"""Of the grid that finds how far an organ reaches back, along each side."""


@dataclass(frozen=True)
class Population:
    """So many members of an entry of RANGES; a larger population of the same seed begins with the smaller one."""

    organ: str
    count: int
    seed: int = 0
    squeezed: bool = False
    """Whether the same organs are squeezed between two planes, in place of the load of their kind."""

    def scenes(self) -> tuple[Scene, ...]:
        """The scenes of all members. Raises StudyError for a member that cannot be palpated or squeezed anywhere."""
        return tuple(member(self.organ, self.seed, number, self.squeezed) for number in range(self.count))


def member(organ: str, seed: int, number: int, squeezed: bool = False) -> Scene:
    """The scene of member `number` of a population: the same for the same four, however many members are drawn.

    Raises StudyError for a member on which no place for the probe, or for two planes, is found.
    """
    ranges = RANGES[organ]
    kind = ranges.scene.organ.shape
    rng = np.random.default_rng([seed, number, zlib.crc32(organ.encode())])
    parameters = vary(kind, int(rng.integers(2**32)), ranges.spread)
    for name, ends in ranges.own.items():
        parameters[name] = 1e3 * float(rng.uniform(*ends))  # shapes take millimetres
    modulus = float(rng.uniform(*ranges.shear_modulus))
    shape = SHAPES[kind](**parameters)
    base = ranges.scene
    scene = replace(
        base,
        name=NAME.format(organ=organ, seed=seed, number=number),
        organ=Organ(kind, parameters),
        tissue=replace(base.tissue, shear_modulus=modulus, source=ranges.sources[-1]),
        frames=FRAMES,
        held=tuple(replace(held, region=shape.regions[held.name]) for held in base.held),
        reference=ranges.plan,
    )
    if squeezed:
        name, plan = (
            SQUEEZED_NAME.format(organ=organ, seed=seed, number=number),
            replace(SQUEEZED, base=ranges.plan.base),
        )
        return _squeezed(replace(scene, name=name, reference=plan), shape, rng)
    match ranges.load:
        case Palpation() as palpation:
            return _pressed(scene, shape, palpation, rng)
        case Filling(share):
            return _filled(scene, float(rng.uniform(*share)))
        case Sagging(acceleration):
            return _hanging(scene, float(rng.uniform(*acceleration)))


def _pressed(scene: Scene, shape: Shape, palpation: Palpation, rng: np.random.Generator) -> Scene:
    """A member with a probe. Raises StudyError where no place is found for it."""
    radius, depth = (float(rng.uniform(*ends)) for ends in (palpation.radius, palpation.depth))
    point = _palpated(shape, palpation.shift, rng, radius, depth)
    if point is None:
        raise StudyError(f"member {scene.name}: no place for a probe of {1e3 * radius:.1f} mm in {TRIES} tries")
    inward = scaled(point.normal, -1.0)
    end = PRESSED * scene.duration
    path = Trajectory((0.0, end), ((0.0, 0.0, 0.0), scaled(inward, depth + GAP)))
    probe = Sphere(along(point.point, point.normal, radius + GAP), radius, path)
    what = f"a probe of {1e3 * radius:.1f} mm radius pushed in by {1e3 * depth:.1f} mm"
    return replace(
        scene,
        title=f"A {scene.organ.shape} of a population, {what}",
        checkpoints=press_times(0.0, end, CHECKPOINTS, scene.duration),
        obstacles=(probe, *(_wall_behind(shape) for obstacle in scene.obstacles if isinstance(obstacle, Plane))),
        probed=replace(scene.probed, direction=inward),
    )


def _filled(scene: Scene, share: float) -> Scene:
    """A member whose lumen grows to `share` of its volume at rest."""
    end = PRESSED * scene.duration
    return replace(
        scene,
        title=f"A {scene.organ.shape} of a population, its content grows by {100 * (share - 1):.0f} %",
        checkpoints=press_times(0.0, end, CHECKPOINTS, scene.duration),
        lumen=Lumen(filling=Ramp((0.0, end), (1.0, share))),
    )


def _hanging(scene: Scene, acceleration: float) -> Scene:
    """A member that hangs under `acceleration` [m/s²], in the direction of the gravity of its scene."""
    pull = scaled(scene.gravity, acceleration / float(np.linalg.norm(scene.gravity)))
    return replace(
        scene,
        title=f"A {scene.organ.shape} of a population, hanging under {acceleration:.1f} m/s²",
        gravity=pull,
    )


def _squeezed(scene: Scene, shape: Shape, rng: np.random.Generator) -> Scene:
    """A member between two planes that take a share of its thickness, each one half, along a direction in which they
    stay clear of what is held. Raises StudyError where none is found."""
    share, surface, end = float(rng.uniform(*SQUEEZE)), _surface(shape), PRESSED * scene.duration
    held = surface[np.any([held.region.level(surface) <= 0.0 for held in scene.held], axis=0)]
    planes = closing(surface, held, share, rng, end)
    if not planes:
        raise StudyError(f"member {scene.name}: no direction in which planes clear of what is held take {share:.0%}")
    return replace(
        scene,
        title=f"A {scene.organ.shape} of a population, squeezed by {100 * share:.0f} % between two planes",
        checkpoints=press_times(0.0, end, CHECKPOINTS, scene.duration),
        obstacles=planes,
        probed=ForceOutput("obstacle", 0, planes[0].normal),
        lumen=None if scene.lumen is None else Lumen(),
        gravity=(0.0, 0.0, 0.0),
        damping=LIGHT,
        quantities=ALL,
        not_for=(),
    )


def closing(
    surface: np.ndarray, held: np.ndarray, share: float, rng: np.random.Generator, end: float, count: int = 2
) -> tuple[Plane, ...]:
    """`count` planes that together take a share of the thickness of `surface` (n, 3) [m] until `end` [s], in the first
    random direction in which they stay clear of the points `held` (m, 3) [m]; none where there is no such."""
    ways = rng.normal(size=(DIRECTIONS, 3))
    axes = np.round(ways / np.linalg.norm(ways, axis=1, keepdims=True), 9)  # as rounded
    reach, taken = surface @ axes.T, held @ axes.T
    lowest, highest = reach.min(axis=0).round(5), reach.max(axis=0).round(5)
    travel = (share / count * (highest - lowest)).round(5)
    room = np.stack([taken.min(axis=0) - lowest, highest - taken.max(axis=0)])[:count]
    clear = np.flatnonzero(room.min(axis=0) - travel >= CLEAR)
    if not len(clear):
        return ()
    axis, low, high, deep = (some[clear[0]] for some in (axes, lowest, highest, travel))
    ends = ((rounded(axis), float(low)), (rounded(-axis), -float(high)))
    way = float(deep) + BESIDE
    return tuple(
        Plane(scaled(inward, start - BESIDE), inward, Trajectory((0.0, end), ((0.0, 0.0, 0.0), scaled(inward, way))))
        for inward, start in ends[:count]
    )


def _surface(shape: Shape) -> np.ndarray:
    """Points of the surface [m], (n, 3), about a cell of the shape apart."""
    axes = [np.arange(low, high, shape.cell) for low, high in zip(shape.low, shape.high, strict=True)]
    grid = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, 3)
    return project(shape, grid[np.abs(shape.level(grid)) < 0.5 * shape.cell], within=1e-6)


def _palpated(
    shape: Shape, shift: float, rng: np.random.Generator, radius: float, depth: float
) -> PalpationPoint | None:
    """A place within `shift` of the default one that is flat under the probe, freely reachable, and not held."""
    middle = probe_of(shape)
    across = np.linalg.svd(np.asarray(middle.normal)[None])[2][1:]
    for _ in range(TRIES):
        angle, far = rng.uniform(0.0, 2.0 * np.pi), shift * np.sqrt(rng.uniform())
        beside = np.asarray(middle.point) + far * (np.cos(angle) * across[0] + np.sin(angle) * across[1])
        try:
            point = probe_near(shape, (float(beside[0]), float(beside[1]), float(beside[2])))
        except StudyError:  # too far from the surface to be brought onto it
            continue
        if _able(shape, point, radius, depth):
            return PalpationPoint(rounded(point.point), rounded(point.normal))
    return None


def rounded(vector: Iterable[float]) -> Vector:
    """To a nanometre: the last bits of Newton's method are another on another machine, and a scene is its numbers."""
    x, y, z = (round(value, 9) for value in vector)
    return (x, y, z)


def _able(shape: Shape, point: PalpationPoint, radius: float, depth: float) -> bool:
    """Whether a probe of `radius` can be pushed in by `depth` there: it starts clear of the organ, touches a patch
    that is nearly flat, far from what is held, with three times the depth of organ behind it, and nothing is held
    where it ends."""
    at, outward = np.asarray(point.point), np.asarray(point.normal)
    ball = at + (radius + GAP) * outward + radius * _directions()
    if (shape.level(ball) <= 0.0).any():
        return False
    if shape.level((at - 3.0 * depth * outward)[None])[0] >= 0.0:
        return False
    across = np.linalg.svd(outward[None])[2][1:]
    turns = np.linspace(0.0, 2.0 * np.pi, 12, endpoint=False)
    circle = np.cos(turns)[:, None] * across[0] + np.sin(turns)[:, None] * across[1]
    if any((region.level(at + radius * circle) <= 0.0).any() for region in shape.regions.values()):
        return False
    touched = np.sqrt(radius * depth)  # on a soft half space (Hertz)
    if np.linalg.norm(normals(shape, at + touched * circle).mean(axis=0)) <= FLAT:
        return False
    end = at + (radius - depth) * outward + radius * _directions(4000)
    beyond = end[(end - at) @ outward < -depth / 2.0]  # not the air from which the probe comes
    return not any(
        ((region.level(beyond) <= 0.0) & (shape.level(beyond) > 0.0)).any() for region in shape.regions.values()
    )


@cache
def _directions(count: int = 400) -> np.ndarray:
    """Unit vectors spread over the sphere, (count, 3) (Fibonacci lattice)."""
    heights = 1.0 - (2.0 * np.arange(count) + 1.0) / count
    turns = np.pi * (1.0 + 5.0**0.5) * np.arange(count)
    widths = np.sqrt(1.0 - heights**2)
    return np.stack([widths * np.cos(turns), widths * np.sin(turns), heights], axis=1)


def _wall_behind(shape: Shape) -> Plane:
    """The plane behind a filled organ, clear of it by BEHIND; towards the back is y."""
    return Plane((0.0, round(_back_of(shape) + BEHIND, 5), 0.0), (0.0, -1.0, 0.0))


def _back_of(shape: Shape) -> float:
    """The largest y of the organ [m], to a hundredth of a millimetre."""
    (x0, y0, z0), (x1, y1, z1) = shape.low, shape.high
    low, high = np.array([x0, z0]), np.array([x1, z1])
    back = y0
    while (high - low).max() > 1e-4:
        x, z = (np.linspace(low[axis], high[axis], COLUMNS) for axis in (0, 1))
        y = np.linspace(max(back, y0), y1, COLUMNS)
        points = np.stack(np.meshgrid(x, y, z, indexing="ij"), axis=-1)
        inside = shape.level(points.reshape(-1, 3)).reshape(points.shape[:3]) <= 0.0
        farthest = np.where(inside.any(axis=1), y[COLUMNS - 1 - inside[:, ::-1].argmax(axis=1)], -np.inf)
        best = np.unravel_index(int(farthest.argmax()), farthest.shape)
        back = float(farthest[best])
        around, cell = np.array([x[best[0]], z[best[1]]]), (high - low) / (COLUMNS - 1)
        low, high = around - 3.0 * cell, around + 3.0 * cell
    return back
