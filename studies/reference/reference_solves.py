"""What the reference of a scene is made of: its solutions, what each depends on, and where it lies."""

import json
from dataclasses import dataclass, replace
from pathlib import Path

from massspring.sources import source_fingerprint
from studies.geometry.mesher.jobs import MAKERS
from studies.scene.as_json import scene_to_json
from studies.scene.scene import Scene
from studies.store.paths import key_digest, record_path

STUDY = "reference"


@dataclass(frozen=True)
class ReferenceSolve:
    """A mesh of the scene's family, or that mesh with one setting made better."""

    scene: Scene
    level: float
    variant: str = ""
    """"" or a name of VARIANTS."""

    @property
    def name(self) -> str:
        """For people and file names."""
        return f"{self.scene.name}-{self.level:g}" + (f"-{self.variant}" if self.variant else "")

    @property
    def key(self) -> str:
        """What the solution depends on, besides the code: not the frames or the other meshes; without motion not the
        damping or the start."""
        scene, plan = self.scene, self.scene.reference
        assert plan is not None  # a reference solve belongs to a plan
        plain = replace(
            scene,
            title="",
            duration=0.0,
            frames=0,
            reference=plan.alone(self.level),
            quantities=(),
            not_for=(),
        )
        if plan.dt is None:
            plain = replace(plain, damping=0.0, start=None)
        data = {"scene": json.loads(scene_to_json(plain)), "level": self.level, "variant": self.variant}
        return json.dumps(_with_floats(data), sort_keys=True, ensure_ascii=False)

    @property
    def moves(self) -> bool:
        """Whether it is a motion in time; a load path builds no mass."""
        return self.scene.reference is not None and self.scene.reference.dt is not None

    def path(self, root: Path) -> Path:
        """Where it lies."""
        return record_path(root, STUDY, self.name, self.key)

    @property
    def stamp(self) -> str:
        """Problem and code in one text."""
        return f"{reference_fingerprint()} {key_digest(self.key)}"

    @property
    def weight(self) -> float:
        """What it costs, roughly: unknowns."""
        return self.level if self.level > 1 else self.level**-3


def _with_floats(value: object) -> object:
    """JSON-able data with every number as a float: a scene read back from a record has 350.0 for 350."""
    if isinstance(value, dict):
        return {key: _with_floats(inner) for key, inner in value.items()}
    if isinstance(value, list):
        return [_with_floats(inner) for inner in value]
    return float(value) if isinstance(value, int) and not isinstance(value, bool) else value


def reference_solves(scene: Scene) -> list[ReferenceSolve]:
    """All that the reference of a scene is made of: every mesh, and each setting made better on the coarsest."""
    if scene.reference is None:
        return []
    family = [ReferenceSolve(scene, level) for level in scene.reference.levels]
    return [*family, *(replace(family[0], variant=name) for name in sensitivity_runs(scene))]


def sensitivity_runs(scene: Scene) -> list[str]:
    """The settings that matter in a scene: nothing touches, nothing sinks in."""
    assert scene.reference is not None
    return [name for name in scene.reference.variants if name != "contact" or scene.obstacles]


def reference_fingerprint() -> str:
    """Hash of the code that makes a reference and of all that it imports; what judges references is not among it."""
    return source_fingerprint("studies.reference.solve", *MAKERS)
