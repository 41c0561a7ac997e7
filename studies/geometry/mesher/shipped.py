"""Meshes of the catalogue that come with the package, so that first runs and tests wait for none.

As a published reference a shipped mesh is that of its recipe for all users, whatever code and libraries they have; an
edit of code makes none stale. `python -m studies.lab.meshes` makes a set and checks it. With OWN in the environment
every mesh is made.
"""

import hashlib
import io
import json
import os
import warnings
from collections.abc import Mapping
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np

FOLDER = Path(__file__).parents[1] / "shipped"
INDEX = "set.json"
OWN = "ORGANBENCH_OWN_MESHES"
"""Variable that leaves the shipped meshes aside."""
INSTEAD = "it is made instead, which takes seconds (install organbench again to get it back)"


def shipped(recipe: Mapping[str, Any], folder: Path = FOLDER) -> dict[str, np.ndarray] | None:
    """The arrays of a shipped mesh; None where there is none, or, with a warning, its file is missing or damaged."""
    entry = None if os.environ.get(OWN) else index(folder).get(key_of(recipe))
    if entry is None:
        return None
    file = folder / entry["file"]
    try:
        content = file.read_bytes()
    except OSError as error:
        return _told(f"the shipped mesh {file} cannot be read ({error.strerror}); {INSTEAD}")
    if hashlib.sha256(content).hexdigest() != entry["sha256"]:
        return _told(f"the shipped mesh {file} is damaged; {INSTEAD}")
    with np.load(io.BytesIO(content), allow_pickle=False) as data:
        return {key: data[key] for key in data.files}


@cache
def index(folder: Path = FOLDER) -> Mapping[str, Mapping[str, str]]:
    """File and hash of every shipped mesh, by the key of its recipe."""
    try:
        listed = json.loads((folder / INDEX).read_text(encoding="utf-8"))["meshes"]
        return {key: {"file": str(row["file"]), "sha256": str(row["sha256"])} for key, row in listed.items()}
    except (OSError, ValueError, LookupError, TypeError, AttributeError) as error:
        _told(f"the list of shipped meshes cannot be read ({error}); all are made instead")
        return {}


def key_of(recipe: Mapping[str, Any]) -> str:
    """SHA-256 (hex) of a recipe alone."""
    return hashlib.sha256(json.dumps(recipe, sort_keys=True).encode()).hexdigest()


def _told(sentence: str) -> None:
    warnings.warn(sentence, stacklevel=4)
