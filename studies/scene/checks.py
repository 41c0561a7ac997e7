"""Checks of a scene and its organ's surface before meshing: obstacles inside the organ, regions off its surface,
units."""

import json
import warnings
from functools import lru_cache

import numpy as np

from massspring import Capsule, Obstacle, Plane, Trajectory
from massspring.body.surface import winding_number
from studies.base.errors import StudyError
from studies.base.lookup import lookup
from studies.geometry.api.scans import Remeshing, repaired_surface
from studies.geometry.files.opening import opened
from studies.geometry.organs import SHAPES, make_shape
from studies.geometry.surface.first_surface import first_surface
from studies.scene.clock import check_clock, is_number
from studies.scene.cut_checks import check_cuts, check_cuttable
from studies.scene.kind import has_wall
from studies.scene.organ_file import scanned
from studies.scene.scene import Organ, Scene

Surface = tuple[np.ndarray, np.ndarray]
"""Points (n, 3) [m] and outward triangles (t, 3)."""
START_DEPTH = 1e-3
"""Depth, over the size of the body, to which an obstacle may start inside the true surface, as in reference_fem.system.
The run checks the depth in the mesh."""
LEAST_BULK = 100.0
"""kappa/mu below which a tissue is refused: there the reference is 0.6 % softer than incompressible tissue, which is
what every body is (docs/theory.md, eq. 6.14)."""
MODULUS, DENSITY, DURATION = (100.0, 1e5), (500.0, 2000.0), (1e-3, 1e3)
"""Usual shear moduli [Pa], densities [kg/m³] and durations [s]: from fat to cartilage, from lung to bone."""
UNUSUAL = 100.0
"""Factor outside its usual range beyond which a number is an error."""
LARGE = 10.0
"""Factor on the size of the body beyond which a length is an error."""
COMPARED = ("force", "surface", "interior", "silhouette", "volume", "frequency")
"""What the quantities of a scene may name."""
WEIGHTLESS = "gravity acts on the wall alone: the content of the lumen has no weight; drain it with Lumen('open')"
AXIS_POINTS = 9
SIDES = ((0, 1), (1, 2), (2, 0), (0, 1, 2))
"""Corners of a triangle whose mean is one more sample of the surface: its edges and its middle."""
PATH_TIMES = 41
"""Number of times at which the depth of an obstacle in a held region is measured, in addition to those of the paths."""


def check_scene(scene: Scene) -> list[str]:
    """Warnings of unusual numbers, a sentence each. Raises StudyError for a scene that cannot start, and for impossible
    numbers. Makes no mesh; takes a second or two if an obstacle or a held region is to be checked."""
    check_clock(scene)
    _check_names(scene)
    _check_bulk(scene)
    remarks = [
        *_unusual(scene, "shear modulus", scene.tissue.shear_modulus, MODULUS, "Pa"),
        *_unusual(scene, "density", scene.tissue.density, DENSITY, "kg/m³"),
        *_unusual(scene, "duration", scene.duration, DURATION, "s"),
    ]
    _check_organ(scene)
    _check_lumen(scene)
    if scene.filled and any(scene.gravity):
        remarks.append(WEIGHTLESS)
    for cut in scene.cuts:
        check_cuttable(scene, cut)
    if not scene.obstacles and not scene.held and not scene.cuts:
        return remarks
    try:
        points, triangles = surface_of(scene.organ, scene.name)
    except StudyError as error:
        if scene.organ.shape != "file":
            raise
        return [*remarks, f"the cases of scene '{scene.name}' will fail: {error}"]
    size = float(np.linalg.norm(np.ptp(points, axis=0)))
    samples = np.concatenate([points, *(points[triangles[:, side]].mean(axis=1) for side in SIDES)])
    for number, obstacle in enumerate(scene.obstacles):
        remarks += _too_large(scene, f"obstacle {number}", _width(obstacle), size)
        remarks += _too_large(scene, f"the path of obstacle {number}", _reach(obstacle.path), size)
        if scene.start is None or not scene.start.shaped:
            _check_start(scene, number, depth_at_start(obstacle, points, triangles, has_wall(scene)), size)
        remarks += _pressed_through(scene, number, points)
    for held in scene.held:
        remarks += _too_large(scene, f"the path of region '{held.name}'", _reach(held.path), size)
        _check_region(scene, held.name, held.region.level(points), points, triangles)
    check_cuts(scene, (points, triangles))
    for number in range(len(scene.obstacles)):
        _check_clear_of_held(scene, number, samples, size)
    return remarks


def surface_of(organ: Organ, name: str) -> Surface:
    """The true surface of an organ, finely sampled; name: of the scene. Raises StudyError for an unknown organ, and for
    a file that cannot be read."""
    if organ.shape == "file":
        return _scan_surface(json.dumps(dict(organ.parameters), sort_keys=True), name)
    return _shape_surface(organ.shape, json.dumps(dict(organ.parameters), sort_keys=True))


@lru_cache(maxsize=64)
def _shape_surface(shape: str, parameters: str) -> Surface:
    return first_surface(make_shape(shape, json.loads(parameters)))


@lru_cache(maxsize=4)
def _scan_surface(parameters: str, name: str) -> Surface:
    source, how = scanned(Organ("file", json.loads(parameters)), name)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # meshing warns of every change to the surface
        surface, _ = repaired_surface(source, opened(source), Remeshing(**how))
    return surface.points, surface.triangles


def depth_at_start(obstacle: Obstacle, points: np.ndarray, triangles: np.ndarray, hollow: bool = False) -> float:
    """How deep an obstacle starts inside a closed surface [m], negative if it is outside; an obstacle in the lumen of a
    `hollow` organ is outside."""
    depth = -float(obstacle.gap(points, 0.0).min())
    if isinstance(obstacle, Plane) or hollow:
        return depth
    start = obstacle.anchor + obstacle.path(0.0)
    along = obstacle.span if isinstance(obstacle, Capsule) else np.zeros(3)
    for share in np.linspace(0.0, 1.0, AXIS_POINTS if along.any() else 1):
        place = start + share * along
        if abs(winding_number(place, points, triangles)) > 0.5:
            depth = max(depth, obstacle.radius + float(np.linalg.norm(points - place, axis=1).min()))
    return depth


def _check_organ(scene: Scene) -> None:
    """Raises StudyError for an unknown organ, and for invalid parameters."""
    try:
        if lookup(scene.organ.shape, [*SHAPES, "file"], "organ") != "file":
            make_shape(scene.organ.shape, scene.organ.parameters)
    except StudyError as error:
        raise StudyError(f"scene '{scene.name}': {error}") from error


def _check_names(scene: Scene) -> None:
    names = [held.name for held in scene.held]
    twice = sorted({name for name in names if names.count(name) > 1})
    if twice:
        raise StudyError(f"scene '{scene.name}' has two regions called '{twice[0]}'; give each its own name")
    for quantity in scene.quantities:
        lookup(quantity, COMPARED, f"quantity of scene '{scene.name}'")
    probed, count = scene.probed, len(scene.obstacles if scene.probed.what == "obstacle" else scene.held)
    compares = "force" in scene.quantities and (count > 0 or scene.reference is not None)
    if compares and not 0 <= probed.number < count:
        what = "obstacles" if probed.what == "obstacle" else "held regions"
        raise StudyError(
            f"scene '{scene.name}' probes the force at {probed.what} {probed.number}, and has {count} {what}, counted "
            "from 0; correct the number"
        )


def _check_bulk(scene: Scene) -> None:
    """Raises StudyError for a tissue that is not nearly incompressible."""
    ratio = scene.tissue.bulk_over_shear
    if ratio < LEAST_BULK:
        poisson = lambda ratio: (3.0 * ratio - 2.0) / (6.0 * ratio + 2.0)  # noqa: E731
        raise StudyError(
            f"scene '{scene.name}': the tissue has kappa/mu = {ratio:.3g}, a Poisson ratio of {poisson(ratio):.3g}, "
            f"and bodies are incompressible: give bulk_over_shear of at least {LEAST_BULK:g} "
            f"({poisson(LEAST_BULK):.3g}), or leave it out (5,000)"
        )


def _check_lumen(scene: Scene) -> None:
    """Raises StudyError for a lumen in a solid organ. Whether a mesh file is hollow is known when it is meshed."""
    organ = scene.organ
    if scene.lumen is not None and organ.shape != "file" and make_shape(organ.shape, organ.parameters).wall is None:
        raise StudyError(f"scene '{scene.name}' has a lumen, and its organ '{organ.shape}' is solid; leave it out")


def _check_start(scene: Scene, number: int, depth: float, size: float) -> None:
    limit = START_DEPTH * size
    if depth > limit:
        turn = ", or turn its normal towards the body" if isinstance(scene.obstacles[number], Plane) else ""
        raise StudyError(
            f"scene '{scene.name}': obstacle {number} starts {1e3 * depth:.3g} mm inside the body "
            f"({1e3 * limit:.2g} mm are allowed): move it back{turn}"
        )


def _check_region(scene: Scene, name: str, level: np.ndarray, points: np.ndarray, triangles: np.ndarray) -> None:
    """Raises StudyError for a region off the surface, by more than the spacing of its samples."""
    spacing = float(np.linalg.norm(points[triangles[:, 0]] - points[triangles[:, 1]], axis=1).mean())
    if level.min() > spacing:
        raise StudyError(
            f"scene '{scene.name}': region '{name}' contains no part of the body, "
            f"which begins {1e3 * level.min():.3g} mm away from it: move or enlarge it"
        )


def _pressed_through(scene: Scene, number: int, points: np.ndarray) -> list[str]:
    """A warning for a plane that moves all the way through a body that cannot move out of its way."""
    plane = scene.obstacles[number]
    if not isinstance(plane, Plane) or not (scene.held or len(scene.obstacles) > 1):
        return []
    thick = float(np.ptp(points @ plane.unit_normal))
    deepest = max(-float(plane.gap(points, t).min()) for t in plane.path.times)
    if deepest <= thick:
        return []
    return [
        f"scene '{scene.name}': obstacle {number} is pressed {1e3 * deepest:.3g} mm into a body that is "
        f"{1e3 * thick:.3g} mm thick there: is its path in metres?"
    ]


def _check_clear_of_held(scene: Scene, number: int, samples: np.ndarray, size: float) -> None:
    """Raises StudyError for an obstacle that moves into a held region, whose nodes cannot move out of its way: there is
    no equilibrium. The depth is measured at `samples` of the surface (n, 3) [m]; between them it may be larger."""
    obstacle, limit = scene.obstacles[number], START_DEPTH * size
    for held in scene.held:
        nodes = samples[held.region.level(samples) <= 0.0]
        times = np.unique([*np.linspace(0.0, scene.duration, PATH_TIMES), *obstacle.path.times, *held.path.times])
        depths = [-float(obstacle.gap(nodes + held.path(t), t).min()) for t in times] if len(nodes) else [0.0]
        if max(depths) > limit:
            first = times[np.array(depths) > limit][0]
            raise StudyError(
                f"scene '{scene.name}': obstacle {number} goes {1e3 * max(depths):.2g} mm into held region "
                f"'{held.name}', which cannot give way (more than the {1e3 * limit:.2g} mm allowed from {first:.3g} s "
                "on): end its path earlier, or hold less"
            )


def _unusual(scene: Scene, what: str, value: float, usual: tuple[float, float], unit: str) -> list[str]:
    """A warning for a number outside its usual range. Raises StudyError for an impossible one."""
    low, high = usual
    sentence = (
        f"scene '{scene.name}': the {what} is {value!r} {unit}, "
        f"the usual range is {low:,g} to {high:,g}: is it in {unit}?"
    )
    if not is_number(value) or not low / UNUSUAL <= value <= high * UNUSUAL:
        raise StudyError(sentence)
    return [] if low <= value <= high else [sentence]


def _too_large(scene: Scene, what: str, length: float, size: float) -> list[str]:
    """A warning for a length above the size of the body. Raises StudyError for an impossible one."""
    if length <= size:
        return []
    sentence = f"scene '{scene.name}': {what} is {length:.3g} m long, the body {size:.3g} m: are all lengths in metres?"
    if length > LARGE * size:
        raise StudyError(sentence)
    return [sentence]


def _width(obstacle: Obstacle) -> float:
    """Longest side of an obstacle [m]; a plane has none."""
    if isinstance(obstacle, Plane):
        return 0.0
    span = float(np.linalg.norm(obstacle.span)) if isinstance(obstacle, Capsule) else 0.0
    return span + 2.0 * obstacle.radius


def _reach(path: Trajectory) -> float:
    """Largest distance of a path from its start [m]."""
    return float(np.linalg.norm(np.subtract(path.displacements, path.displacements[0]), axis=1).max())
