"""Published references: the finest solution of every scene of the catalogue, shipped with the package.

The reference of a benchmark must be the same for all users. A published reference is valid for a scene as long as the
physics are the same: organ, tissue, obstacles, held regions and checkpoints. An edit of code makes none stale
(`python -m studies.lab.references check` solves them again). A new set is a release with changed results.
"""

import hashlib
import json
import warnings
from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cache
from pathlib import Path

import h5py
import numpy as np

from studies.base.errors import StudyError
from studies.base.hdf5 import reading, text_in
from studies.reference.reference_solves import ReferenceSolve, physics_of, reference_fingerprint, with_floats
from studies.reference.shape import shape_attributes
from studies.scene.as_json import scene_to_json
from studies.scene.library import CUT, JUDGED
from studies.scene.scene import Scene
from studies.store.paths import key_digest
from studies.store.record import Record, Status, new_fields, new_record
from studies.store.schema import REFERENCE_FIELDS

FOLDER = Path(__file__).parent / "published"
INDEX = "set.json"
PRECISION = 1e-5
"""Largest rounding of a stored length, over the largest displacement."""
LENGTHS = ("displacement", "nodes", "sample_displacement", "sample_points")
"""Fields that are rounded; all others keep every digit."""


@dataclass(frozen=True)
class Entry:
    """One published reference."""

    name: str
    """Name of the set, as "2027.1"."""
    file: Path
    sha256: str
    """SHA-256 of the file (hex)."""
    shape_error: float
    """Largest distance of its finest mesh from the true shape, over the size [1]; NaN if that is unknown."""

    @property
    def words(self) -> str:
        """For tables: the set, and which file."""
        return f"{self.name} {self.sha256[:8]}"


def judged_scenes() -> dict[str, Scene]:
    """Scenes of the catalogue whose reference is published, by name: all that have one, but those in which the faces of
    a cut touch, those with several cuts, and those whose cut opens a lumen."""
    opened = [
        scene for scene in CUT if len(scene.cuts) == 1 and not (scene.cuts[0].contact or scene.cuts[0].opens_lumen)
    ]
    return {scene.name: scene for scene in (*JUDGED, *opened) if scene.reference is not None}


def physics(scene: Scene) -> str:
    """SHA-256 of everything in the scene on which its reference depends, independent of the solver."""
    plain = replace(physics_of(scene), name="", reference=None)
    return key_digest(json.dumps(with_floats(json.loads(scene_to_json(plain))), sort_keys=True, ensure_ascii=False))


def published(scene: Scene, folder: Path = FOLDER) -> Entry | None:
    """The published reference of the scene's physics; None without one. Warns of a file that is missing or damaged:
    the scene is then solved."""
    if scene.reference is None:
        return None
    return index(folder).get(physics(scene))


@cache
def index(folder: Path = FOLDER) -> Mapping[str, Entry]:
    """The references in a folder by their physics, without missing or damaged files."""
    if not (folder / INDEX).is_file():
        return {}
    try:
        data = json.loads((folder / INDEX).read_text(encoding="utf-8"))
        listed = [
            (scene, row["physics"], Entry(data["set"], folder / row["file"], row["sha256"], float(row["shape error"])))
            for scene, row in data["references"].items()
        ]
    except (OSError, ValueError, LookupError, TypeError, AttributeError) as error:
        warnings.warn(
            f"the list of published references cannot be read ({error}); all are solved instead", stacklevel=2
        )
        return {}
    entries = {}
    for scene, key, entry in listed:
        fault = fault_of(entry)
        if fault:
            warnings.warn(
                f"the published reference of {scene} {fault}; it is solved instead, which takes minutes (install "
                "organbench again to get it back)",
                stacklevel=2,
            )
        else:
            entries[key] = entry
    return entries


def fault_of(entry: Entry) -> str | None:
    """What is wrong with the file, "is missing" or "is damaged"; None if it is unchanged."""
    if not entry.file.is_file():
        return "is missing"
    digest = hashlib.sha256(entry.file.read_bytes()).hexdigest()
    return None if digest == entry.sha256 else "is damaged"


def fingerprint_of(scene: Scene) -> str:
    """Hash whose change makes the stored reference of the scene stale: that of the published file, or of the code that
    solves it."""
    entry = published(scene)
    return reference_fingerprint() if entry is None else f"published {entry.sha256}"


def record_of(scene: Scene, entry: Entry) -> Record:
    """The published reference as a record of the scene. Raises StudyError for a file that cannot be read."""
    try:
        with reading(entry.file) as file:
            values = {name: _values(item) for name, item in file.items()}
            attributes = {name: np.asarray(value).item() for name, value in file.attrs.items()}
    except (OSError, KeyError) as error:
        raise StudyError(f"the published reference {entry.file.name} cannot be read ({error})") from error
    return new_record(
        kind="reference",
        key=ReferenceSolve(scene).key,
        name=scene.name,
        status=Status.OK,
        message="",
        fingerprint=fingerprint_of(scene),
        attributes=attributes
        | shape_attributes(scene.name, entry.shape_error)
        | {"scene": scene.name, "set": entry.words},
        fields=new_fields(REFERENCE_FIELDS, values),
    )


def _values(dataset: h5py.Dataset) -> np.ndarray:
    if h5py.check_string_dtype(dataset.dtype) is not None:
        return text_in(dataset)
    values = np.asarray(dataset[()])
    return values.astype({"f": float, "u": np.int64}.get(values.dtype.kind, values.dtype))
