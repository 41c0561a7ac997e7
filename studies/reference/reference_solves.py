"""The reference of a scene as a job: its dependencies and its path."""

import json
from dataclasses import dataclass, replace
from pathlib import Path

from massspring.sources import source_fingerprint
from studies.geometry.mesher.jobs import MAKERS
from studies.scene.as_json import scene_to_json
from studies.scene.scene import Scene
from studies.store.paths import record_path

STUDY = "reference"


@dataclass(frozen=True)
class ReferenceSolve:
    """The solutions on all meshes of a scene's plan, and with refined settings on the coarsest."""

    scene: Scene

    @property
    def name(self) -> str:
        """Name in messages and file names."""
        return self.scene.name

    @property
    def key(self) -> str:
        """Canonical JSON of everything except the code on which the solution depends. It leaves out the frames, and for
        a scene without motion damping and start."""
        data = json.loads(scene_to_json(physics_of(self.scene)))
        return json.dumps({"scene": with_floats(data)}, sort_keys=True, ensure_ascii=False)

    @property
    def moves(self) -> bool:
        """Whether it is a motion in time; a load path has no inertia."""
        return self.scene.reference is not None and self.scene.reference.dt is not None

    def path(self, root: Path) -> Path:
        """Path of the stored reference."""
        return record_path(root, STUDY, self.name, self.key)


def physics_of(scene: Scene) -> Scene:
    """The scene without fields on which its reference does not depend."""
    assert scene.reference is not None  # a reference solve belongs to a plan
    cuts = tuple(cut.at_once for cut in scene.cuts)
    plain = replace(scene, title="", duration=0.0, frames=0, quantities=(), not_for=(), cuts=cuts)
    return plain if scene.reference.dt is not None else replace(plain, damping=0.0, start=None)


def with_floats(value: object) -> object:
    """JSON-able data with every number as a float: a scene read back from a record has 350.0 for 350."""
    if isinstance(value, dict):
        return {key: with_floats(inner) for key, inner in value.items()}
    if isinstance(value, list):
        return [with_floats(inner) for inner in value]
    return float(value) if isinstance(value, int) and not isinstance(value, bool) else value


def reference_solves(scene: Scene) -> list[ReferenceSolve]:
    """The job of the scene's reference; none without a plan."""
    return [] if scene.reference is None else [ReferenceSolve(scene)]


def settings_varied(scene: Scene) -> list[str]:
    """The settings of the plan that matter in a scene: without contact the contact penalty does not."""
    assert scene.reference is not None
    return [name for name in scene.reference.variants if name != "contact" or scene.obstacles]


def reference_fingerprint() -> str:
    """Hash of the code that makes a reference and of all that it imports; without the code that computes their
    uncertainty."""
    return source_fingerprint("studies.reference.solve", *MAKERS)
