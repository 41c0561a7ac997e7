"""Unpacked archives: results folders that stay as they are, whatever machine and code reads them."""

from pathlib import Path

from studies.base.errors import StudyError
from studies.store.machine import machine_id, machine_of

CRATE = "ro-crate-metadata.json"
"""The file that makes a folder an archive (https://www.researchobject.org/ro-crate)."""
MANIFEST = "manifest-sha256.txt"
"""SHA-256 and path of every other file, as `sha256sum -c` reads them."""


def is_archive(root: Path) -> bool:
    """Whether a results folder is an unpacked archive."""
    return (root / CRATE).is_file()


def shown_machine(root: Path) -> str:
    """The machine whose frame times tables and charts of a folder show: this one; of an archive the one it names."""
    if not is_archive(root):
        return machine_id()
    machine = machine_of(root)
    if machine is None:
        raise StudyError(f"{root / 'machine.json'} is missing or names no machine: unpack the archive again")
    return machine


def check_no_archive(root: Path) -> None:
    """Raises StudyError for an archive, in which nothing runs."""
    if is_archive(root):
        raise StudyError(f"{root} is an unpacked archive, which stays as it is; run into another folder with --results")
