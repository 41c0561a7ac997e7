"""A random scene: an organ of a random shape or a scan, held somewhere, under a load from somewhere."""

from collections.abc import Iterable, Sequence
from dataclasses import replace
from pathlib import Path
from typing import NamedTuple

import numpy as np

from massspring import Capsule, Obstacle, Ramp, Sphere, Trajectory
from studies import SHAPES, ForceOutput, Held, Lumen, Organ, ReferencePlan, Scene, StudyError
from studies.geometry import BallRegion, HalfSpace, vary
from studies.lab.population.draw import CHECKPOINTS, CLEAR, FRAMES, GAP, PRESSED, TRIES, closing, rounded
from studies.lab.population.ranges import MEMBER, SQUEEZE
from studies.scene.checks import surface_of
from studies.scene.kind import has_wall
from studies.scene.placing import press_times, scaled
from studies.scene.tissues import LIVER, TISSUES, Tissue

DURATION, DAMPING = 5.0, 6.0
"""[s], [1/s]: loads are slow, and a swing dies away in the rest of the time."""
END = PRESSED * DURATION
LOADS = "sphere", "capsule", "plane", "squeeze", "pull", "gravity", "fill"
SCANS = 2
"""Chances of a scan; each synthetic organ has one."""
SPREAD, SOFTER = 0.3, (0.7, 1.4)
"""Of lengths (studies.geometry.vary), and range of the factor on the shear modulus."""
HELD, PULLED = (0.03, 0.2), (0.01, 0.05)
"""Shares of the surface that are held, and pulled."""
RADIUS, DEPTH, ROD = (0.002, 0.03), (0.001, 0.015), (0.01, 0.08)
"""Of spheres and capsules, how deep they go, and length of a capsule's axis [m]."""
TILT, OVER, BEHIND = 30.0, 1.5, 1.0 / 3.0
"""Largest angle between their way and the normal [degrees]; largest depth over the radius, and over the thickness."""
PRESS, PULL = (0.05, 0.25), (0.03, 0.15)
"""Shares of the thickness by which a plane presses, and of the diagonal by which a patch is pulled."""
GRAVITY, ALSO = (1.0, 9.81), 1.0 / 6.0
"""[m/s²], and share of the scenes with another load that have gravity, too."""
FILLED, OPEN = (1.05, 1.3), 0.25
"""Final volume of a filled lumen over that at rest, and share of the other lumens that are open."""
MOST = 80e3
SOLID = replace(MEMBER, tolerance=0.008, most=MOST, base=600)
HOLLOW, SCAN = replace(SOLID, tolerance=0.02), 1000
"""Plans of references with bars below a third of the targets that keep the shape within .5 % of the size, and the
surface nodes that this takes on a scan; a few minutes of a core."""
WITHOUT_FORCE = "surface", "interior", "silhouette", "volume"
"""What is compared where the force is the weight, or inside."""


class Place(NamedTuple):
    """Where a load can act: points of the surface (n, 3) [m], which of them are held (n,) bool, and a generator."""

    rng: np.random.Generator
    points: np.ndarray
    normals: np.ndarray
    areas: np.ndarray
    held: np.ndarray


def member(seed: int, number: int, scans: Sequence[Path] = ()) -> Scene:
    """The scene of member `number` of the campaign of `seed`, with the plan of its reference; the same for the same
    scans, whatever was drawn before. Raises StudyError where a scan is drawn and there is none."""
    rng = np.random.default_rng([seed, number])
    organ, tissue = _organ(rng, scans)
    points, triangles = surface_of(organ, f"member_{seed}_{number:04d}")
    corners = points[triangles]
    across = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    twice = np.linalg.norm(across, axis=1)
    scene = Scene(
        name=f"member_{seed}_{number:04d}",
        title=Path(str(organ.parameters.get("path", organ.shape))).stem,
        organ=organ,
        tissue=replace(tissue, shear_modulus=round(float(rng.uniform(*SOFTER)) * tissue.shear_modulus, 1)),
        duration=DURATION,
        frames=FRAMES,
        checkpoints=press_times(0.0, END, CHECKPOINTS, DURATION),
        probed=ForceOutput("held", 0, (0.0, 0.0, 1.0)),
        reference=None,
        damping=DAMPING,
    )
    hollow = has_wall(scene)
    load = LOADS[int(rng.integers(len(LOADS) if hollow else LOADS.index("fill")))]
    lumen = Lumen("open" if load != "fill" and rng.random() < OPEN else "closed") if hollow else None
    for _ in range(TRIES):
        place = Place(rng, corners.mean(axis=1), across / twice[:, None], 0.5 * twice, np.zeros(len(triangles), bool))
        region, held = _region(place, HELD, rng.random() < 0.5)
        scene = replace(scene, held=(Held("hold", region),), lumen=lumen)
        loaded = _loaded(scene, place._replace(held=held), load)
        if loaded is None:
            continue
        if load != "gravity" and rng.random() < ALSO:
            loaded = replace(loaded, gravity=_gravity(rng), title=f"{loaded.title}, under gravity")
        return replace(loaded, reference=_plan(loaded, hollow))
    raise StudyError(f"{scene.name}: no place for its load ({load}) in {TRIES} tries")


def _plan(scene: Scene, hollow: bool) -> ReferencePlan:
    """Of the reference: only under spheres and capsules its coarsest mesh is halved."""
    plan = HOLLOW if hollow else SOLID
    plan = replace(plan, base=SCAN) if "path" in scene.organ.parameters else plan
    return plan if any(isinstance(one, Sphere | Capsule) for one in scene.obstacles) else replace(plan, at_contact=0)


def _organ(rng: np.random.Generator, scans: Sequence[Path]) -> tuple[Organ, Tissue]:
    number, which = int(rng.integers(len(SHAPES) + SCANS)), int(rng.integers(2**32))
    if number < len(SHAPES):
        shape = list(SHAPES)[number]
        return Organ(shape, vary(shape, which, SPREAD)), TISSUES.get(shape, LIVER)
    if not scans:
        raise StudyError("its organ is a scan, and none is given: --scans FOLDER")
    path = scans[which % len(scans)]
    tissue = next((tissue for name, tissue in TISSUES.items() if name in path.name), LIVER)
    return Organ("file", {"path": str(path.absolute()), "unit": "mm", "remesh": True}), tissue


def _region(place: Place, share: tuple[float, float], ball: bool) -> tuple[BallRegion | HalfSpace, np.ndarray]:
    """A ball round a point, or what lies beyond a plane, with a share of the surface; the points that it holds."""
    rng, points, _, areas, _ = place
    way, at = _direction(rng), points[rng.choice(len(points), p=areas / areas.sum())]
    away = np.linalg.norm(points - at, axis=1) if ball else -points @ way
    order = np.argsort(away)
    last = int(np.searchsorted(np.cumsum(areas[order]) / areas.sum(), rng.uniform(*share)))
    far = round(float(away[order[last]]), 6)
    region = BallRegion(rounded(at), far) if ball else HalfSpace(rounded(-far * way), rounded(-way))
    return region, np.asarray(region.level(points) <= 0.0)


def _loaded(scene: Scene, place: Place, load: str) -> Scene | None:
    """The scene with its load; None where that finds no place."""
    if load in ("sphere", "capsule"):
        return _touched(scene, place, load)
    if load in ("plane", "squeeze"):
        return _flattened(scene, place, load)
    if load == "pull":
        return _pulled(scene, place)
    if load == "gravity":
        return replace(scene, title=f"{scene.title}, hanging", gravity=_gravity(place.rng), quantities=WITHOUT_FORCE)
    share = round(float(place.rng.uniform(*FILLED)), 3)
    lumen, title = Lumen(filling=Ramp((0.0, END), (1.0, share))), f"{scene.title}, filled to {share:.2f}"
    return replace(scene, title=title, lumen=lumen, quantities=WITHOUT_FORCE)


def _touched(scene: Scene, place: Place, load: str) -> Scene | None:
    """Pressed by a sphere or a capsule, end on or across its way."""
    rng, points, normals, areas, held = place
    one = int(rng.choice(len(points), p=areas / areas.sum()))
    aside = np.tan(np.radians(rng.uniform(0.0, TILT))) * _unit(np.cross(normals[one], _direction(rng)))
    way = np.asarray(rounded(_unit(aside - normals[one])))
    radius, wished = (round(float(np.exp(rng.uniform(*np.log(ends)))), 4) for ends in (RADIUS, DEPTH))
    ahead = (points - points[one]) @ way
    beside = np.linalg.norm(points - points[one] - np.outer(ahead, way), axis=1)
    under = float(ahead[(beside < radius) & (normals @ way > 0.0) & (ahead > 0.0)].min(initial=1.0))
    depth = round(min(wished, OVER * radius, BEHIND * under), 5)
    rod, end_on = float(rng.uniform(*ROD)), rng.random() < 1.0 / 3.0
    back = way if end_on else 0.5 * _unit(np.cross(way, _direction(rng)))
    for gap in np.arange(GAP, 2.0 * radius, GAP):
        path, tip = _path(way, gap + depth), points[one] - (radius + gap) * way
        ends = rounded(tip + (0.0 if end_on else rod) * back), rounded(tip - rod * back)
        obstacle = Sphere(rounded(tip), radius, path) if load == "sphere" else Capsule(*ends, radius, path)
        if obstacle.gap(points, 0.0).min() < 0.5 * GAP:
            continue
        last = obstacle.gap(points, END)
        if -last.min() > OVER * depth or last[held].min() < CLEAR:
            break
        words = f"a {load} of {1e3 * radius:.1f} mm radius pushed in by {1e3 * depth:.1f} mm"
        return _among(scene, (obstacle,), way, words)
    return None


def _flattened(scene: Scene, place: Place, load: str) -> Scene | None:
    """Pressed by a plane, or squeezed between two, in a direction in which they stay clear of what is held."""
    count, shares = (1, PRESS) if load == "plane" else (2, SQUEEZE)
    share = float(place.rng.uniform(*shares))
    planes = closing(place.points, place.points[place.held], share, place.rng, END, count)
    if not planes:
        return None
    return _among(scene, planes, planes[0].normal, f"{load} by {100 * share:.0f} %")


def _pulled(scene: Scene, place: Place) -> Scene | None:
    """A second patch, away from what is held, moves out."""
    region, patch = _region(place, PULLED, ball=True)
    points, size = place.points, float(np.linalg.norm(np.ptp(place.points, axis=0)))
    if np.linalg.norm(points[patch][:, None] - points[place.held][None, ::7], axis=2).min(initial=np.inf) < 0.1 * size:
        return None
    way = _unit(_direction(place.rng) + place.normals[patch].mean(axis=0))
    far = round(float(place.rng.uniform(*PULL)) * size, 4)
    patches = *scene.held, Held("pulled", region, _path(way, far))
    title = f"{scene.title}, a patch pulled by {1e3 * far:.1f} mm"
    return replace(scene, title=title, held=patches, probed=ForceOutput("held", 1, rounded(way)))


def _among(scene: Scene, obstacles: tuple[Obstacle, ...], way: Iterable[float], words: str) -> Scene:
    probed = ForceOutput("obstacle", 0, rounded(way))
    return replace(scene, title=f"{scene.title}, {words}", obstacles=obstacles, probed=probed)


def _path(way: np.ndarray, far: float) -> Trajectory:
    return Trajectory((0.0, END), ((0.0, 0.0, 0.0), scaled(rounded(way), round(float(far), 6))))


def _gravity(rng: np.random.Generator) -> tuple[float, float, float]:
    return scaled(rounded(_direction(rng)), round(float(rng.uniform(*GRAVITY)), 2))


def _direction(rng: np.random.Generator) -> np.ndarray:
    return _unit(rng.normal(size=3))


def _unit(vector: np.ndarray) -> np.ndarray:
    return vector / np.linalg.norm(vector)
