"""What must be so before a worker gets a piece: the same code and packages, and the same results folder."""

import os
import secrets
import time
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from studies.base.atomic import is_there, write_whole
from studies.base.errors import StudyError
from studies.engines.identity import Identity, difference, this_identity
from studies.engines.requests import Presence
from studies.runs.user_code import Given
from studies.sweep.workers import Death

SIGHT_SECONDS = 60.0
"""In which a file that another machine has written must be seen: network folders remember for half a minute what was
not there."""


@dataclass(frozen=True)
class Check:
    """What every worker is held to."""

    token: Path
    """A file in the results folder."""
    content: str
    ours: Identity
    request: Presence

    def fault(self, name: str, answer: Any) -> str | None:
        """What is wrong with the worker that answered so, a sentence without its end; None when nothing is."""
        if isinstance(answer, Death):
            return f"worker {name} cannot start a process for organbench: {answer.cause}"
        if isinstance(answer, ImportError):
            return f"worker {name} has no organbench that can be loaded ({answer}); install it there"
        if isinstance(answer, Exception):
            return f"worker {name} cannot begin: {(str(answer) or repr(answer)).splitlines()[0]}"
        theirs, seen = answer
        if seen != self.content:
            folder = self.token.parents[1]
            return f"worker {name} does not see {folder}; put the results on a folder that every worker shares"
        odd = difference(self.ours, theirs)
        return None if odd is None else f"worker {name} {odd}"


@contextmanager
def check_for(root: Path, files: tuple[Given, ...]) -> Iterator[Check]:
    """The check of workers that are to write below `root`; its file is gone afterwards. Raises StudyError where it
    cannot be written."""
    content = secrets.token_hex(16)
    token = root / "cache" / f"shared-{content[:8]}"
    write_whole(token, content.encode())
    try:
        yield Check(token, content, this_identity(files), Presence(token, files))
    finally:
        token.unlink(missing_ok=True)


def wait_until_seen(paths: Iterable[Path], seconds: float = SIGHT_SECONDS) -> None:
    """Returns when all the files, which other machines have written, are seen here. Raises StudyError when they are
    not in so many seconds."""
    until = time.monotonic() + seconds
    missing = [path for path in paths if not is_there(path)]
    while missing:
        if time.monotonic() > until:
            raise StudyError(
                f"{missing[0]} was written by a worker and is not seen here after {seconds:g} s: the results must lie "
                "on a folder that every worker shares"
            )
        time.sleep(min(1.0, seconds / 10))
        for folder in {path.parent for path in missing if path.parent.is_dir()}:
            os.listdir(folder)  # asks the server of a network folder again
        missing = [path for path in missing if not is_there(path)]
