"""The frozen set: eight scenes, five open and three held back, with the hashes of their meshes and references.

`python -m studies.tools.league.freeze FOLDER` makes one; a reference that changes needs a new set.
"""

import json
from dataclasses import dataclass
from functools import cache
from pathlib import Path

from studies.base.errors import StudyError

SET = "OB-2027.1"
FILE = Path(__file__).parent / f"{SET}.json"


@dataclass(frozen=True)
class FrozenScene:
    """A scene of the set."""

    reference: str
    """SHA-256 of the file of its reference; empty for one that is held back and not solved yet."""
    physics: str
    """SHA-256 of what that depends on (studies.reference.published)."""
    meshes: dict[str, str]
    """ "straight-150" -> GivenMesh.digest."""
    bars: dict[str, float]
    """Uncertainty of its reference [%] by metric, of the pairs of scene and quantity that are judged."""
    held_back: bool


@cache
def frozen(file: Path = FILE) -> dict[str, FrozenScene]:
    """The scenes of the set by name, the open ones first. Raises StudyError where its file cannot be read."""
    try:
        data = json.loads(file.read_text(encoding="utf-8"))
        return {
            name: FrozenScene(one["reference"], one["physics"], one["meshes"], one.get("bars", {}), held_back)
            for held_back, part in ((False, "open"), (True, "held back"))
            for name, one in data[part].items()
        }
    except (OSError, ValueError, LookupError, TypeError) as error:
        raise StudyError(f"the frozen set {file.name} cannot be read ({error}); install organbench again") from error


def mesh_key(kind: str, nodes: int) -> str:
    """Of FrozenScene.meshes."""
    return f"{kind}-{nodes}"
