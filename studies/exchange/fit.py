"""Checks that a submitted result fits the scene: the same mesh, node by node, in metres, at every checkpoint."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.spatial import KDTree

from studies.base.errors import StudyError
from studies.exchange.description import FILES
from studies.exchange.handed import Handed
from studies.exchange.meshes import GivenMesh
from studies.geometry.files.units import NAMES, UNITS
from studies.scene.scene import Scene

SAME = 1e-6
"""Largest difference of equal rest positions, over the size of the body; allows for storage as 32-bit floats."""
FAR = 20.0
"""Displacement, in sizes of the body, beyond which positions are in another unit or the body has burst."""
SMALL = 0.5
"""Size of a step over that of the body at rest below which it may be displacements, and cosine of the angle between
both below which it is: displacements are no copy of the body."""
SAME_TIME = 1e-6
"""Largest difference of equal times, over the duration of the scene."""


@dataclass(frozen=True, eq=False)
class Fitting:
    """Steps on a mesh of the scene, all after t = 0."""

    mesh: GivenMesh
    t: np.ndarray
    """[s], (F,), ascending, every checkpoint among them."""
    positions: np.ndarray
    """[m], (F, n, 3)."""
    histories: dict[str, np.ndarray]
    """Of handed.OPTIONAL what there is, (F,) each."""


def fitted(handed: Handed, scene: Scene, meshes: Sequence[GivenMesh]) -> Fitting:
    """The submitted steps with their mesh. Raises StudyError for data that do not fit the scene."""
    name, x = handed.name, handed.positions
    if x.ndim != 3 or x.shape[2] != 3:
        raise StudyError(f"{name}: positions have shape {x.shape}; they must be (steps, nodes, 3)")
    t = _times(handed, scene)
    _check_finite(name, "positions", t, x)
    mesh = _mesh_of(name, x.shape[1], meshes)
    _check_rest(name, x[0], mesh)
    _check_near(name, t, x)
    _check_positions(name, t, x)
    for key, values in handed.histories.items():
        if values.shape != t.shape:
            raise StudyError(f"{name}: {key} has shape {values.shape} for {len(t)} steps; give one number for each")
        _check_finite(name, key, t[1:], values[1:])
    return Fitting(mesh, t[1:], x[1:], {key: values[1:] for key, values in handed.histories.items()})


def force_at(name: str, t: np.ndarray, times: np.ndarray, force: np.ndarray, scene: Scene) -> np.ndarray:
    """The forces [N] that a table (times, force) has at the steps t (F,), (F,).

    Raises StudyError for a step that is missing there, and for one without a number.
    """
    if not len(times):
        raise StudyError(f"{name} has no force")
    gaps = np.diff(order := np.sort(times))
    if (gaps <= 0.0).any():
        raise StudyError(f"{name} has several forces at t = {order[np.argmin(gaps)]:g} s; give one")
    nearest = np.abs(times[None] - t[:, None]).argmin(axis=1)
    missing = np.abs(times[nearest] - t) > SAME_TIME * scene.duration
    if missing.any():
        raise StudyError(f"{name} has no force at t = {_list(t[missing])} s, where positions were handed in")
    _check_finite(name, "force", t, force[nearest])
    return force[nearest]


def _times(handed: Handed, scene: Scene) -> np.ndarray:
    """The times of all steps, the first 0 (F + 1,)."""
    name, steps, times = handed.name, len(handed.positions), np.array([0.0, *scene.checkpoints])
    t = times if handed.t is None else np.asarray(handed.t)
    if not steps:
        raise StudyError(f"{name} holds no steps; hand in rest and {len(times) - 1} checkpoints")
    if t.shape != (steps,):
        what = "files" if handed.t is None else "steps"
        raise StudyError(f"{name}: {steps} {what} for {t.size} times; hand in rest and {len(times) - 1} checkpoints")
    if not np.isfinite(t).all() or (np.diff(t) <= 0).any():
        raise StudyError(f"{name}: the times of the steps must be increasing numbers")
    near = SAME_TIME * scene.duration
    if len(t) > 1 and abs(t[-1] / 1e3 - scene.duration) <= near:
        raise StudyError(f"{name}: the times go to {t[-1]:g}, the scene to {scene.duration:g} s: give seconds, not ms")
    missing = times[[np.abs(t - one).min() > near for one in times]]
    if len(missing):
        rest = " (t = 0 is the rest shape)" if missing[0] == 0.0 else ""
        raise StudyError(f"{name}: steps are missing at t = {_list(missing)} s{rest}; hand in all of {_list(times)}")
    if t[0] < -near or abs(t[0]) > near:
        raise StudyError(f"{name}: the first step is at t = {t[0]:g} s; begin with the rest shape at t = 0")
    if t[-1] > scene.duration + near:
        raise StudyError(f"{name}: the last step is at t = {t[-1]:g} s, after the scene ends at {scene.duration:g} s")
    return t


def _list(times: np.ndarray) -> str:
    return ", ".join(f"{t:g}" for t in times)


def _check_finite(name: str, what: str, t: np.ndarray, values: np.ndarray) -> None:
    """Raises StudyError naming the first step, and node, whose value is no finite number."""
    wrong = np.argwhere(~np.isfinite(values))
    if len(wrong):
        step, *rest = (int(part) for part in wrong[0])
        where = f" of node {rest[0]}" if rest else ""
        raise StudyError(f"{name}: {what}{where} at t = {t[step]:g} s is not a finite number")


def _mesh_of(name: str, count: int, meshes: Sequence[GivenMesh]) -> GivenMesh:
    for mesh in meshes:
        if len(mesh.points) == count:
            return mesh
    for mesh in meshes:
        if count == len(mesh.points) - len(mesh.pairs):
            raise StudyError(
                f"{name}: positions of {count} nodes, but {FILES[mesh.kind]} has {len(mesh.points)}: the reader joined "
                "those that lie at one place, which shuts the cut; read it without"
            )
    sizes = " and ".join(f"{FILES[mesh.kind]} {len(mesh.points)}" for mesh in meshes)
    raise StudyError(
        f"{name}: positions of {count} nodes, but {sizes} at this number of vertices; they belong to another mesh "
        "(--nodes gives the number of vertices of the exported mesh)"
    )


def _check_rest(name: str, rest: np.ndarray, mesh: GivenMesh) -> None:
    """Raises StudyError for a rest shape that is not that of the mesh, and says in what it differs."""
    file, points = FILES[mesh.kind], mesh.points
    size = float(np.linalg.norm(np.ptp(points, axis=0)))
    if _gap(rest, points) <= SAME * size:
        return
    if _gap(rest, np.zeros_like(rest)) <= SAME * size:
        raise StudyError(
            f"{name}: the positions at t = 0 are all zero, so these are displacements; add the rest positions of {file}"
        )
    tree = KDTree(points)
    for unit, metres in UNITS.items():
        scaled = metres * rest
        distance, nearest = (np.asarray(array) for array in tree.query(scaled))
        if distance.max() > SAME * size:
            continue
        if metres != 1.0:
            raise StudyError(f"{name}: the rest positions are those of {file} in {NAMES[unit]}; hand them in in metres")
        if len(np.unique(nearest)) == len(points):
            odd = int(np.flatnonzero(nearest != np.arange(len(points)))[0])
            raise StudyError(
                f"{name}: the nodes are those of {file} in another order (number {odd} is its number {nearest[odd]}); "
                "hand them in in the order of the file"
            )
    gap = _gap(rest, points)
    raise StudyError(
        f"{name}: the positions at t = 0 are up to {gap:.3g} m from those of {file}; they belong to another rest mesh, "
        "or are not at rest"
    )


def _check_near(name: str, t: np.ndarray, x: np.ndarray) -> None:
    """Raises StudyError for the first step in which a node is FAR from its place at rest."""
    size = float(np.linalg.norm(np.ptp(x[0], axis=0)))
    moved = np.abs(x - x[0]).max(axis=(1, 2))
    far = np.flatnonzero(moved > FAR * size)
    if len(far):
        raise StudyError(
            f"{name}: a node at t = {t[far[0]]:g} s is {moved[far[0]]:.3g} m from its place at rest, "
            f"{moved[far[0]] / size:.2g} times the size of the body; hand in all steps in metres"
        )


def _check_positions(name: str, t: np.ndarray, x: np.ndarray) -> None:
    """Raises StudyError for the first step that is much smaller than the body at rest, and not of its form, as
    displacements are."""
    rest, *steps = (one - one.mean(axis=0) for one in x)
    size = float(np.linalg.norm(rest))
    for time, step in zip(t[1:], steps, strict=True):
        small = float(np.linalg.norm(step)) / size
        if small < SMALL and abs(float(np.sum(step * rest))) < SMALL * small * size**2:
            raise StudyError(
                f"{name}: the body at t = {time:g} s is {small:.2g} times as large as at rest, and not of its form; if "
                "these are displacements, add the rest positions to all steps"
            )


def _gap(one: np.ndarray, other: np.ndarray) -> float:
    return float(np.linalg.norm(one - other, axis=1).max())
