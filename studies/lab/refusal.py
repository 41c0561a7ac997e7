"""How the commands of the lab end when they refuse."""

import sys
from collections.abc import Iterator
from contextlib import contextmanager

from studies import StudyError


@contextmanager
def refusal(command: str) -> Iterator[None]:
    """A StudyError becomes its sentence and exit code 2, as in organbench."""
    try:
        yield
    except StudyError as problem:
        print(f"{command}: {problem}", file=sys.stderr)
        sys.exit(2)
