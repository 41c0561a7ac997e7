"""Random cuts through random organs: each trial runs, or is refused with a sentence, or fails by a name."""

import os
import tempfile
import time
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np

from massspring import METHODS, MassSpringError, Method, Trajectory, simulate
from massspring.body.volumes import tetrahedron_volumes
from massspring.run.history import History
from studies.base.errors import StudyError
from studies.geometry import BallRegion, HalfSpace
from studies.meshing.graded_mesh import MIDDLE, halved
from studies.meshing.quadratic_mesh import QuadraticMesh
from studies.meshing.scene_mesh import mesh_for
from studies.meshing.shaping import quadratic_mesh
from studies.runs.case import BodyRecipe, Case
from studies.runs.prepare import Prepared, prepared_on
from studies.scene.checks import check_scene, surface_of
from studies.scene.cut import Cut
from studies.scene.scene import ForceOutput, Held, Organ, Scene
from studies.scene.tissues import LIVER
from studies.tools.fuzz.choices import Choices
from studies.tools.fuzz.outcome import UNEXPLAINED, Outcome, end_of
from studies.tools.fuzz.truths import broken, named

CHOICES: dict[str, tuple[Any, ...]] = {
    "organ": ("ball", "liver", "liver", "kidney", "kidney", "spleen", "spleen"),
    "body": ("van_gelder", "van_gelder", "van_gelder nodal", "cotangent", "quadratic"),
    "blade": ("none", "none", "half space", "ball"),
    "held": ("both ends", "both ends", "both ends", "both ends", "one end", "across"),
    "free": (False, True),
}
"""What is drawn evenly; a choice that stands there twice is drawn twice as often."""
HOLLOW, ODD = 0.03, 0.1
"""Shares of trials with a hollow organ, and with a method that is drawn of all."""
FRAMES, DURATION = 20, 0.4
SECONDS = 20.0
"""After which a trial is given up."""
CAP = 0.15
"""Of the organ's extent: how much of it is held at an end."""
SAME = 1e-12
"""Relative: volumes of the same tetrahedra, up to round-off."""


@dataclass(frozen=True)
class CutTrial(Choices):
    """An organ, a body, where it is held and how it is cut."""

    COMMAND: ClassVar[str] = "organbench fuzz --cuts"

    organ: str = "ball"
    body: str = "van_gelder"
    method: str = "implicit_volume"
    nodes: int = 120
    """On the surface; of a quadratic body as many vertices."""
    normal: tuple[float, float, float] = (0.0, 0.0, 1.0)
    """Of the plane, of any length."""
    height: float = 0.5
    """Of the plane, over the extent along its normal; beyond 0 and 1 it misses."""
    blade: str = "none"
    reach: float = 0.5
    """How far the blade goes into the section, or its radius, over half the extent across the normal."""
    held: str = "both ends"
    """Along the normal of the plane, or "across" it."""
    free: bool = False
    pull: float = 0.0
    """Of the ends away from each other, over the extent."""
    when: float = 0.5
    """Of the cut, over the duration."""
    gravity: float = 0.0
    """[m/s²]."""


def draw(seed: int, number: int) -> CutTrial:
    """Trial `number` of the campaign of `seed`: the same on every machine."""
    rng = np.random.default_rng((seed, number, 33))
    drawn = {name: values[int(rng.integers(len(values)))] for name, values in CHOICES.items()}
    drawn |= {
        "nodes": int(rng.integers(80, 220)),
        "normal": tuple(float(c) for c in rng.standard_normal(3).round(4)),
        "height": float(rng.uniform(-0.05, 1.05) if rng.random() < 0.2 else rng.uniform(0.2, 0.8)),
        "reach": float(rng.uniform(0.02, 1.2) if rng.random() < 0.2 else rng.uniform(0.2, 0.6)),
        "pull": float(rng.uniform(0.0, 0.2)),
        "when": float(rng.uniform(0.0, 1.0) if rng.random() < 0.1 else rng.uniform(0.2, 0.8)),
        "gravity": 9.81 if rng.random() < 0.3 else 0.0,
    }
    if rng.random() < HOLLOW:
        drawn["organ"] = "stomach"
    if rng.random() < ODD:
        drawn["method"] = METHODS[int(rng.integers(len(METHODS)))].name
    return CutTrial(seed, number, **drawn)


def tried(trial: CutTrial) -> Outcome:
    """What comes of a trial. Never raises: an error that is not ours is the finding."""
    begun = time.perf_counter()
    with _own_meshes():
        status, message = end_of(lambda: _run(trial))
    return Outcome(trial, status, message, time.perf_counter() - begun)


def _run(trial: CutTrial) -> tuple[str, str]:
    try:
        scene = scene_of(trial)
        check_scene(scene)
        case = case_of(trial, scene)
    except StudyError as refused:
        return "refused", str(refused)
    try:
        mesh = mesh_of(trial, scene)
    except StudyError as failed:
        # A mesher that dies says nothing that helps.
        return (UNEXPLAINED if "ended with code" in str(failed) else "not-meshed"), str(failed)
    try:
        prepared = prepared_on(case, mesh)
    except (StudyError, MassSpringError) as refused:
        return "refused", str(refused)
    wrong = parts_differ(prepared, mesh)
    if wrong:
        return UNEXPLAINED, wrong
    opening, setup = prepared.opening, prepared.setup
    assert opening is not None  # the scene has a cut
    history = simulate(setup, snapshots=[opening.frame, FRAMES], time_limit=SECONDS)
    if history.outcome != "finished":
        return history.outcome, history.message
    wrong = parted_early(prepared, history) or broken(setup.later[-1], history)
    return (UNEXPLAINED, wrong) if wrong else named(setup.later[-1], history)


def scene_of(trial: CutTrial) -> Scene:
    """The organ held at its ends and cut. Raises StudyError."""
    organ = Organ(trial.organ)
    points, _ = surface_of(organ, trial.organ)
    normal = np.asarray(trial.normal) / np.linalg.norm(trial.normal)
    side = np.cross(normal, np.eye(3)[np.abs(normal).argmin()])
    side /= np.linalg.norm(side)
    low, extent = float((points @ normal).min()), float(np.ptp(points @ normal))
    level = low + trial.height * extent
    near = points[np.argsort(np.abs(points @ normal - level))[:50]]
    middle = near.mean(axis=0) + (level - near.mean(axis=0) @ normal) * normal
    half = 0.5 * float(np.ptp(near @ side))
    within = None
    if trial.blade == "ball":
        within = BallRegion(_vector(middle), trial.reach * half)
    elif trial.blade == "half space":
        within = HalfSpace(_vector(middle + (2 * trial.reach - 1) * half * side), _vector(side))
    cut = Cut("cut", HalfSpace(_vector(middle), _vector(normal)), within, trial.when * DURATION, free=trial.free)
    axis = side if trial.held == "across" else normal
    return Scene(
        name="cut",
        title="A random cut",
        organ=organ,
        tissue=LIVER,
        duration=DURATION,
        frames=FRAMES,
        checkpoints=(DURATION,),
        probed=ForceOutput("held", 0, (0.0, 0.0, 1.0)),
        reference=None,
        held=_ends(points, axis, trial),
        gravity=(0.0, 0.0, -trial.gravity),
        damping=15.0,
        cuts=(cut,),
    )


def _ends(points: np.ndarray, axis: np.ndarray, trial: CutTrial) -> tuple[Held, ...]:
    along = points @ axis
    ends = (along.min() + CAP * np.ptp(along), axis), (along.max() - CAP * np.ptp(along), -axis)
    held = [
        Held(
            f"end {k}",
            HalfSpace(_vector(level * axis), _vector(out)),
            Trajectory((0.0, DURATION), ((0.0, 0.0, 0.0), _vector(-0.5 * trial.pull * np.ptp(along) * out))),
        )
        for k, (level, out) in enumerate(ends)
    ]
    return tuple(held[:1] if trial.held == "one end" else held)


def _vector(values: np.ndarray) -> tuple[float, float, float]:
    x, y, z = (float(value) for value in values)
    return x, y, z


def case_of(trial: CutTrial, scene: Scene) -> Case:
    """The body and its method. Raises StudyError."""
    law, _, nodal = trial.body.partition(" ")
    method: Method = {method.name: method for method in METHODS}[trial.method]()
    if law == "quadratic":
        return Case(scene, BodyRecipe("quadratic", 4 * trial.nodes - 6), method, dt_fraction=0.8)
    volumes = "nodal" if nodal or law == "cotangent" else "scene"
    return Case(scene, BodyRecipe(nodes=trial.nodes, law=law, volumes=volumes), method, dt_fraction=0.8)


def mesh_of(trial: CutTrial, scene: Scene) -> Any:
    """A mesh with evenly spread nodes, which is quick to make. Raises StudyError."""
    if trial.body == "quadratic":
        return quadratic_mesh(scene, *halved(scene, trial.nodes, 0, 0, even=True), MIDDLE)
    return mesh_for(scene, trial.nodes, even=True)


def parts_differ(prepared: Prepared, mesh: Any) -> str | None:
    """Whether the cut changes what the body is: its mass, its volume, or the places of its nodes."""
    before, after = prepared.setup.body, prepared.body
    if abs(after.mass.sum() / before.mass.sum() - 1.0) > SAME:
        return "mass changes when the body is cut"
    volumes = [tetrahedron_volumes(body.rest, body.tetrahedra).sum() for body in (before, after)]
    if abs(volumes[1] / volumes[0] - 1.0) > SAME:
        return f"the volume of the parts is {volumes[1] / volumes[0] - 1.0:.2g} off that of the whole"
    if not isinstance(mesh, QuadraticMesh) and abs(volumes[0] / mesh.volume - 1.0) > SAME:
        return "the body has another volume than its mesh"
    return None


def parted_early(prepared: Prepared, history: History) -> str | None:
    """Whether copies of a node lie apart before the cut, or all on each other long after it."""
    opening = prepared.opening
    assert opening is not None  # the scene has a cut
    apart = np.diff(history.snapshots[:, opening.pairs], axis=2)
    if np.abs(apart[0]).max() > 0.0:
        return "copies of a node lie apart before the cut"
    moved = np.abs(history.snapshots[-1] - prepared.body.rest).max() > 1e-6 * prepared.body.size
    return "nothing opens" if moved and not apart[1].any() else None


@contextmanager
def _own_meshes() -> Iterator[None]:
    """A cache of meshes that ends with the trial: they are wanted once."""
    name = "ORGANBENCH_CACHE"
    given = os.environ.get(name)
    with tempfile.TemporaryDirectory() as folder:
        os.environ[name] = folder
        try:
            yield
        finally:
            os.environ.pop(name)
            if given is not None:
                os.environ[name] = given
