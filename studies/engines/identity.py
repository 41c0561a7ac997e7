"""Who a process is: its code and packages, which decide results, and its machine, which decides times."""

import platform
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

from studies.reference.reference_solves import reference_fingerprint
from studies.runs.current import run_fingerprint
from studies.runs.user_code import Given, read_code
from studies.store.machine import machine_id, this_machine


@dataclass(frozen=True)
class Identity:
    """What must be equal in all processes that work on one folder, and the machine."""

    runs: str
    """Fingerprint of the code of runs."""
    references: str
    """Of that of references."""
    python: str
    packages: dict[str, str | None]
    """Name -> version; None where it is not installed."""
    files: dict[str, str]
    """The user's files with their fingerprints, which cover the modules beside them."""
    machine: str
    """Id of the machine (studies.store.machine)."""


def this_identity(files: tuple[Given, ...] = ()) -> Identity:
    """That of this process; `files`: of the user."""
    known = {path: read_code(Path(path), content).fingerprint for path, content in files}
    packages = this_machine().packages
    return Identity(
        run_fingerprint(), reference_fingerprint(), platform.python_version(), packages, known, machine_id()
    )


def difference(ours: Identity, theirs: Identity) -> str | None:
    """How another process differs, as the end of a sentence that begins with its name; None where it does not."""
    return next(_differences(ours, theirs), None)


def _differences(ours: Identity, theirs: Identity) -> Iterator[str]:
    if (ours.runs, ours.references) != (theirs.runs, theirs.references):
        yield "has other code of organbench; install the same version there, and start it again"
    if ours.python != theirs.python:
        yield f"has Python {theirs.python}, and here is {ours.python}; use the same there"
    for name, version in ours.packages.items():
        found = theirs.packages.get(name)
        if found != version:
            yield f"has {name} {found or 'not installed'}, and here is {version or 'none'}; install the same there"
    for path, known in ours.files.items():
        if theirs.files.get(path) != known:
            yield f"has other modules beside {path}; put that folder where every worker sees it"
