"""Random cuts through random organs: each trial runs, or is refused with a sentence, or fails by a name."""

import os
import tempfile
import time
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, replace
from typing import Any, ClassVar, Literal

import numpy as np

from massspring import METHODS, Body, MassSpringError, Method, Ramp, Trajectory, simulate
from massspring.run.history import History
from studies.base.errors import StudyError
from studies.geometry import BallRegion, HalfSpace
from studies.meshing.graded_mesh import MIDDLE, halved
from studies.meshing.quadratic_mesh import QuadraticMesh
from studies.meshing.scene_mesh import mesh_for
from studies.meshing.shaping import quadratic_mesh
from studies.runs.case import Case
from studies.runs.cutting import LUMEN, check_blades, check_opens, check_virtual
from studies.runs.prepare import Prepared, prepared_on
from studies.runs.recipes import VIRTUAL, QuadraticBody, SurfaceBody, TetrahedralBody
from studies.scene.checks import check_scene, surface_of
from studies.scene.cut import Cut
from studies.scene.scene import ForceOutput, Held, Lumen, Organ, Scene
from studies.scene.tissues import LIVER
from studies.tools.fuzz.choices import Choices
from studies.tools.fuzz.outcome import UNEXPLAINED, Outcome, end_of
from studies.tools.fuzz.truths import INSIDE, broken, named

SURFACE, LINEAR = "surface", ("van_gelder", "van_gelder nodal", "cotangent")
HOLLOW: dict[str, dict[str, float]] = {"hollow ball": {"wall": 0.008}, "stomach": {}, "bladder": {}}
"""Organs with a wall, and their parameters (m)."""
CHOICES: dict[str, tuple[Any, ...]] = {
    "organ": ("ball", "liver", "liver", "kidney", "kidney", "spleen", "spleen", *HOLLOW),
    "body": ("van_gelder", "van_gelder nodal", "cotangent", "quadratic", SURFACE),
    "way": ("conforming", "conforming", VIRTUAL),
    "blade": ("none", "half space", "half space", "ball"),
    "held": ("both ends", "both ends", "both ends", "both ends", "one end", "one end", "across"),
    "content": ("closed", "closed", "filled", "open"),
    "contact": (False, False, True),
    "opens": (True, False),
    "free": (False, True),
}
"""What is drawn evenly; a choice that stands there twice is drawn twice as often."""
UNFIT, ODD = 0.1, 0.1
"""Shares of trials whose choices are left although they may not go together, and with a method that is drawn of all."""
FRAMES, DURATION = 20, 0.4
SECONDS = 20.0
"""After which a trial is given up."""
FILLING = 1.1
"""Of the volume of a lumen at rest."""
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
    way: Literal["conforming", "virtual"] = "conforming"
    """Along faces of the mesh, or through its cells by virtual nodes."""
    blade: str = "none"
    reach: float = 0.5
    """How far the blade goes into the section, or its radius, over half the extent across the normal."""
    held: str = "both ends"
    """Along the normal of the plane, or "across" it."""
    content: str = "closed"
    """Of a hollow organ; "filled": it grows by a tenth until the cut."""
    contact: bool = False
    opens: bool = False
    """Whether the cut opens a lumen."""
    free: bool = False
    pull: float = 0.0
    """Of the ends away from each other, over the extent; negative: towards each other."""
    when: float = 0.5
    """Of the cut, over the duration."""
    advance: float = 0.0
    """How long it advances, over the time that is left; 0: all of it opens at once."""
    towards: float = 0.0
    """In which direction of its plane [rad]."""
    gravity: float = 0.0
    """[m/s²]."""

    @property
    def kind(self) -> str:
        """What kind of cut it is, as text: "solid, advancing, touching"."""
        words = ["hollow" if self.organ in HOLLOW else "solid"]
        words += ["paper's surface"] if self.body == SURFACE else []
        words += ["virtual nodes"] if self.way == VIRTUAL else []
        words += ["advancing"] if self.advance else []
        words += ["touching"] if self.contact else []
        return ", ".join(words)


def draw(seed: int, number: int) -> CutTrial:
    """Trial `number` of the campaign of `seed`: the same on every machine."""
    rng = np.random.default_rng((seed, number, 33))
    drawn = {name: values[int(rng.integers(len(values)))] for name, values in CHOICES.items()}
    drawn |= {
        "nodes": int(rng.integers(80, 220)),
        "normal": tuple(float(c) for c in rng.standard_normal(3).round(4)),
        "height": float(rng.uniform(-0.05, 1.05) if rng.random() < 0.2 else rng.uniform(0.2, 0.8)),
        "reach": float(rng.uniform(0.02, 1.2) if rng.random() < 0.2 else rng.uniform(0.2, 0.6)),
        "pull": float(rng.uniform(-0.15, 0.05) if drawn["contact"] else rng.uniform(0.0, 0.2)),
        "when": float(rng.uniform(0.0, 1.0) if rng.random() < 0.1 else rng.uniform(0.2, 0.8)),
        "advance": float(rng.uniform(0.0, 1.0)) if rng.random() < 0.4 else 0.0,
        "towards": float(rng.uniform(-np.pi, np.pi)),
        "gravity": 9.81 if rng.random() < 0.3 else 0.0,
    }
    if rng.random() < ODD:
        drawn["method"] = METHODS[int(rng.integers(len(METHODS)))].name
    if rng.random() > UNFIT:
        drawn |= _fitted(drawn, rng)
    return CutTrial(seed, number, **drawn)


def _fitted(drawn: dict[str, Any], rng: np.random.Generator) -> dict[str, Any]:
    """Other choices for those that are refused with the organ, body and way of cutting drawn."""
    organ, body, choices = drawn["organ"], drawn["body"], {}
    if organ in HOLLOW:
        body = body if body in LINEAR else LINEAR[int(rng.integers(len(LINEAR)))]
        choices = {"body": body, "contact": False, "pull": abs(drawn["pull"])}
    way = drawn["way"] if body in LINEAR and organ not in HOLLOW else "conforming"
    choices |= {"way": way, "opens": organ in HOLLOW}
    if organ in HOLLOW and drawn["blade"] == "ball":
        choices["blade"] = "half space"
    if body == SURFACE:
        choices |= {"blade": "none", "advance": 0.0}
    if way == VIRTUAL:
        choices |= {"contact": False, "advance": 0.0}
    if drawn["held"] == "one end" and choices.get("blade", drawn["blade"]) == "none":
        choices["free"] = True
    return choices


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
        check_case(case)
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
    if wrong:
        return UNEXPLAINED, wrong
    status, message = named(setup.later[-1], history)
    deep = overlap(prepared, history) if trial.contact and status == "ok" else 0.0
    if deep > INSIDE * prepared.body.size:
        return "penetrated", f"faces of the cut overlap by {1e3 * deep:.3g} mm"
    return status, message


def scene_of(trial: CutTrial) -> Scene:
    """The organ held at its ends and cut. Raises StudyError."""
    hollow = trial.organ in HOLLOW
    organ = Organ(trial.organ.removeprefix("hollow "), HOLLOW.get(trial.organ, {}))
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
    at = trial.when * DURATION
    along = np.cos(trial.towards) * side + np.sin(trial.towards) * np.cross(normal, side)
    cut = Cut(
        "cut",
        HalfSpace(_vector(middle), _vector(normal)),
        within,
        at,
        at + trial.advance * (DURATION - at) if trial.advance else None,
        _vector(along) if trial.advance else None,
        trial.contact,
        trial.opens,
        trial.free,
    )
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
        lumen=_lumen(trial) if hollow else None,
    )


def _lumen(trial: CutTrial) -> Lumen:
    if trial.content != "filled":
        return Lumen(trial.content)
    return Lumen(filling=Ramp((0.0, trial.when * DURATION), (1.0, FILLING)))


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
    way: dict[str, Any] = {} if trial.way == "conforming" else {"cut": trial.way}
    if law == "quadratic":
        recipe = QuadraticBody(4 * trial.nodes - 6, **way)
        return Case(scene, recipe, method, dt_fraction=0.8)
    if law == SURFACE:
        return Case(scene, SurfaceBody(trial.nodes, **way), method, dt_fraction=0.8)
    volumes = "nodal" if nodal or law == "cotangent" else "scene"
    recipe = TetrahedralBody(nodes=trial.nodes, law=law, volumes=volumes, **way)
    return Case(scene, recipe, method, dt_fraction=0.8)


def check_case(case: Case) -> None:
    """What `prepare` refuses before there is a mesh. Raises StudyError."""
    check_opens(case.scene, case.body)
    if case.scene.cut is not None:
        check_blades(case.scene, case.body.kind)
    if case.body.cut == VIRTUAL:
        check_virtual(case.scene)


def mesh_of(trial: CutTrial, scene: Scene) -> Any:
    """A mesh with evenly spread nodes, which is quick to make. Raises StudyError."""
    if trial.way == VIRTUAL:
        scene = replace(scene, cuts=())  # the mesh does not know it
    if trial.body == "quadratic":
        return quadratic_mesh(scene, *halved(scene, trial.nodes, 0, 0, even=True), MIDDLE)
    return mesh_for(scene, trial.nodes, even=True)


def parts_differ(prepared: Prepared, mesh: Any) -> str | None:
    """Whether the cut changes what the body is at rest: its mass, or its volume without that of a lumen."""
    whole = prepared.setup.body
    for body in (event.body for event in prepared.setup.events):
        if abs(body.mass.sum() / whole.mass.sum() - 1.0) > SAME:
            return "mass changes when the body is cut"
        if abs(_tissue(body) / _tissue(whole) - 1.0) > SAME:
            return f"the volume of the parts is {_tissue(body) / _tissue(whole) - 1.0:.2g} off that of the whole"
    if not isinstance(mesh, QuadraticMesh) and abs(_tissue(whole) / mesh.volume - 1.0) > SAME:
        return "the body has another volume than its mesh"
    return None


def _tissue(body: Body) -> float:
    """The volume of a body's tissue at rest [m³]."""
    tissue = np.array([name != LUMEN for name in body.kept.names])
    return float(body.kept.measure(body.rest)[tissue].sum())


def parted_early(prepared: Prepared, history: History) -> str | None:
    """Whether copies of a node lie apart before the cut, or all on each other long after it."""
    opening = prepared.opening
    assert opening is not None  # the scene has a cut
    apart = np.diff(_shown(prepared, history.snapshots)[:, opening.pairs], axis=2)
    if np.abs(apart[0]).max() > 0.0:
        return "copies of a node lie apart before the cut"
    moved = np.abs(history.snapshots[-1] - prepared.body.rest).max() > 1e-6 * prepared.body.size
    return "nothing opens" if moved and not apart[1].any() else None


def overlap(prepared: Prepared, history: History) -> float:
    """How deep the faces of the cut overlap at the end [m], of pairs that slid by less than an edge."""
    opening, x = prepared.opening, _shown(prepared, history.final[None])[0]
    assert opening is not None  # the scene has a cut
    a, b, c = x[opening.faces].transpose(1, 0, 2)
    normal = np.zeros_like(x)
    np.add.at(normal, opening.faces, np.cross(b - a, c - a)[:, None])
    behind, front = opening.pairs.T
    normal = normal[behind] / np.maximum(np.linalg.norm(normal[behind], axis=1), np.finfo(float).tiny)[:, None]
    apart = x[front] - x[behind]
    gap = (apart * normal).sum(axis=1)
    near = np.linalg.norm(apart - gap[:, None] * normal, axis=1) < np.linalg.norm(b - a, axis=1).mean()
    return max(0.0, -float(gap[near].min(initial=0.0)))


def _shown(prepared: Prepared, x: np.ndarray) -> np.ndarray:
    """Places of the nodes of the record (…, p, 3) by those of the body, (…, n, 3)."""
    return x if prepared.tissue is None else prepared.tissue.places(x)


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
