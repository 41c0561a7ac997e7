"""The commit of this code."""

import subprocess
from pathlib import Path


def commit() -> str:
    """Of the code, "-dirty" if files differ from it."""
    words = "git", "describe", "--always", "--dirty", "--exclude=*"
    return subprocess.run(words, cwd=Path(__file__).parent, capture_output=True, text=True).stdout.strip() or "unknown"
