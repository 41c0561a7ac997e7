"""One file per study that opens like a tree: every case under its readable name, by external links."""

import io
from collections import Counter
from pathlib import Path

import h5py

from studies.base.atomic import is_there, sweep_parts, write_whole
from studies.base.errors import StudyError
from studies.store.checksums import BLOCK, sealed
from studies.store.paths import index_path, record_files, timing_files
from studies.store.record import INDEX_KIND, SCHEMA, peek


def link_study(root: Path, study: str) -> list[str]:
    """Writes results/STUDY/STUDY.h5: an external link (relative file name, so that the folder can be moved) to every
    record by its name, and below "timing/MACHINE" to every timing file. Also removes what killed writers left.

    Returns one sentence for each file that had to be left out because it cannot be read.
    Raises StudyError when the index cannot be written.
    """
    index = index_path(root, study)
    sweep_parts(index.parent)
    targets, unreadable = _targets(record_files(root, study))
    timings, more = _targets(timing_files(root, study), by_machine=True)
    image = io.BytesIO()
    with h5py.File(image, "w", userblock_size=BLOCK) as file:
        file.attrs.update({"schema": SCHEMA, "kind": INDEX_KIND, "name": study})
        for name, target in (targets | timings).items():
            file[name] = h5py.ExternalLink(target.name, "/")
    content = sealed(image.getvalue())
    if not is_there(index) or index.read_bytes() != content:  # a folder that cannot be written to may be looked at
        write_whole(index, content)
    return unreadable + more


def _targets(files: list[Path], by_machine: bool = False) -> tuple[dict[str, Path], list[str]]:
    """Link name -> file. Names that are taken twice, or are also a folder of another name, get the file's hash."""
    names: dict[Path, str] = {}
    unreadable = []
    for file in files:
        try:
            record = peek(file)
        except StudyError as problem:
            unreadable.append(str(problem))
            continue
        name = "/".join(part for part in record.name.split("/") if part not in ("", ".", "..")) or file.stem
        names[file] = f"timing/{record.machine}/{name}" if by_machine else name
    count = Counter(names.values())
    folders = {"/".join(parts[:n]) for parts in (x.split("/") for x in count) for n in range(1, len(parts))}
    if not by_machine:
        folders.add("timing")
    clash = {name for name in count if count[name] > 1 or name in folders}
    return {(f"{name}-{_hash(file)}" if name in clash else name): file for file, name in names.items()}, unreadable


def _hash(file: Path) -> str:
    return file.name.split(".timing.")[0].removesuffix(".h5")[-8:]
