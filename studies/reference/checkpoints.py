"""Partial load paths, next to the record they will become: a crash costs one load step, not the path.

A file holds arrays and one text, and no pickle: reading one that a stranger made runs none of its code.
"""

import hashlib
import io
import warnings
import zipfile
import zlib
from dataclasses import fields
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from reference_fem.errors import SolveError
from studies.base.atomic import is_there, write_whole

if TYPE_CHECKING:
    from reference_fem import Checkpoint

DIGEST = 64
"""Bytes at the head of the file: SHA-256 of the rest, as text. It finds damage; a stranger can write one that fits."""
STAMP, PATH, STATE = "stamp", "path_", "state_"
"""Of the names of the arrays: what problem and code the path belongs to, its equilibria, what the next step needs."""
UNREADABLE = (LookupError, TypeError, ValueError, EOFError, OSError, MemoryError, NotImplementedError, RuntimeError)
"""What NumPy and zipfile raise for content of another make (RuntimeError: encrypted)."""

IGNORED = "holds no readable load steps; it is ignored, and the load path starts again"


def steps_path(record: Path) -> Path:
    """Where the path half-way to `record` lies."""
    return record.with_suffix(".steps")


def keep(record: Path, stamp: str, checkpoint: "Checkpoint") -> None:
    """Stores how far the path is, whole or not at all; `stamp` names the problem and the code that it belongs to."""
    write_whole(steps_path(record), sealed(arrays_of(stamp, checkpoint)))


def arrays_of(stamp: str, checkpoint: "Checkpoint") -> dict[str, np.ndarray]:
    """The stamp, every field of the K equilibria (K, …), and the state that the next load step starts from."""
    from reference_fem import Equilibrium

    path = {PATH + one.name: np.array([getattr(e, one.name) for e in checkpoint.path]) for one in fields(Equilibrium)}
    state = {STATE + name: values for name, values in checkpoint.state.to_arrays().items()}
    return {STAMP: np.array(stamp), **path, **state}


def sealed(arrays: dict[str, np.ndarray]) -> bytes:
    """An archive of NumPy behind the SHA-256 of its bytes."""
    content = io.BytesIO()
    np.savez(content, allow_pickle=False, **arrays)  # pyright: ignore[reportArgumentType]
    return hashlib.sha256(content.getvalue()).hexdigest().encode() + content.getvalue()


def kept(record: Path, stamp: str) -> "Checkpoint | None":
    """Where the path of this very problem and code stopped; None when it did not begin, is of another, or its file is
    not as it was written: then the path begins again. Warns of a file of another make, as those of version 0.2."""
    file = steps_path(record)
    if not is_there(file) or not file.is_file():  # a device would be read for ever
        return None
    try:
        whole = file.read_bytes()
        if hashlib.sha256(whole[DIGEST:]).hexdigest().encode() != whole[:DIGEST]:
            return None
        return _checkpoint(whole[DIGEST:], stamp)
    except (*UNREADABLE, SolveError, zipfile.BadZipFile, zlib.error):
        warnings.warn(
            f"{file} holds no readable load steps; it is ignored, and the load path starts again", stacklevel=2
        )
        return None


def _checkpoint(content: bytes, stamp: str) -> "Checkpoint | None":
    """None where the stamp is another. Raises UNREADABLE, SolveError or an error of zipfile for what `keep` did not
    write."""
    from reference_fem import Checkpoint, Equilibrium
    from reference_fem.system.state import State

    with zipfile.ZipFile(io.BytesIO(content)) as archive:
        if sum(entry.file_size for entry in archive.infolist()) > len(content):
            raise ValueError("it is compressed")  # a small file could fill the memory
    with np.load(io.BytesIO(content), allow_pickle=False) as arrays:
        if str(arrays[STAMP]) != stamp:
            return None
        path = {one.name: arrays[PATH + one.name] for one in fields(Equilibrium)}
        state = State.from_arrays({name.removeprefix(STATE): arrays[name] for name in arrays if name.startswith(STATE)})
    rows = [{name: _value(values[k]) for name, values in path.items()} for k in range(len(path["t"]))]
    return Checkpoint([Equilibrium(**row) for row in rows], state)


def _value(values):
    """A number as Python's own, an array as it is."""
    return values.item() if np.ndim(values) == 0 else values


def drop(record: Path) -> None:
    """Forgets the path half-way: it has ended."""
    steps_path(record).unlink(missing_ok=True)
