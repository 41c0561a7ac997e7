"""One file per study that opens like a tree: every case under its readable name, by external links."""

import io
from collections import Counter
from collections.abc import Collection, Sequence

import h5py

from studies.base.atomic import is_there, sweep_parts, write_whole
from studies.store.entry import Entry
from studies.store.ledger import Ledger
from studies.store.opening import INDEX_KIND, sealed
from studies.store.paths import DIGITS, SUFFIX, TIMING, index_path
from studies.store.record import SCHEMA


def link_study(ledger: Ledger, study: str) -> list[str]:
    """Writes results/STUDY/STUDY.h5: an external link (relative file name, so that the folder can be moved) to every
    record by its name, and below "timing/MACHINE" to every timing file. Also removes what killed writers left.

    Returns one sentence for each file that had to be left out because it cannot be read, and for a folder that lies in
    the index's place.
    Raises StudyError when the index cannot be written.
    """
    index = index_path(ledger.root, study)
    sweep_parts(index.parent)
    entries = ledger.files(study).values()
    unreadable = [entry.error_message for entry in entries if entry.fault]
    records, timings = (
        [entry for entry in entries if not entry.fault and (TIMING in entry.file) == timed] for timed in (False, True)
    )
    targets = _targets(records, {"timing"}) | _targets(timings)
    image = io.BytesIO()
    with h5py.File(image, "w") as file:
        file.attrs.update({"schema": SCHEMA, "kind": INDEX_KIND, "name": study})
        for name, target in targets.items():
            file[name] = h5py.ExternalLink(target, "/")
    content = sealed(image.getvalue())
    if index.is_dir():
        return [
            *unreadable,
            f"{index} is a folder, but the study's index belongs there: delete it, and run the study again",
        ]
    if not is_there(index) or index.read_bytes() != content:  # a folder that cannot be written to may be looked at
        write_whole(index, content)
    return unreadable


def _targets(entries: Sequence[Entry], taken: Collection[str] = ()) -> dict[str, str]:
    """Link name -> file. Names that are taken twice, or are also a folder of another name, get the file's hash."""
    names = {entry.file: _name(entry) for entry in entries}
    count = Counter(names.values())
    folders = {"/".join(parts[:n]) for parts in (x.split("/") for x in count) for n in range(1, len(parts))} | set(
        taken
    )
    clash = {name for name in count if count[name] > 1 or name in folders or name in taken}
    return {(f"{name}-{_hash(file)}" if name in clash else name): file for file, name in names.items()}


def _name(entry: Entry) -> str:
    parts = [part for part in entry.name.split("/") if part not in ("", ".", "..")]
    name = "/".join(parts) or entry.file.removesuffix(SUFFIX)
    return f"timing/{entry.machine}/{name}" if TIMING in entry.file else name


def _hash(file: str) -> str:
    return file.split(TIMING)[0].removesuffix(SUFFIX)[-DIGITS:]
