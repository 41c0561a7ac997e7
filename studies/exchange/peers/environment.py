"""The Python environment of another program: made by venv and pip when it is first needed, and kept."""

import os
import subprocess
import sys
import venv
from collections.abc import Sequence
from pathlib import Path

import studies
from studies.base.errors import StudyError

ADAPTERS_NEED = ("numpy", "meshio", "lazy-loader")
"""Of what reads a scene there."""
STAMP = "packages.txt"
"""What is installed, written last."""


def python_of(name: str, packages: Sequence[str], folder: Path) -> tuple[str, str]:
    """The interpreter for a program, and the PYTHONPATH under which it finds its adapter; without packages ours.

    Raises StudyError, with the last line of pip, where they cannot be installed.
    """
    if not packages:
        return sys.executable, os.pathsep.join(path or os.getcwd() for path in sys.path)
    home = (folder / name).resolve()
    python, stamp, listing = home / "bin" / "python", home / STAMP, "\n".join(packages)
    if not (stamp.is_file() and stamp.read_text(encoding="utf-8").strip() == listing):
        venv.create(home, with_pip=True)
        pip = [python, "-m", "pip", "install", "-q", *packages, *ADAPTERS_NEED]
        ended = subprocess.run(pip, capture_output=True, text=True)
        if ended.returncode != 0:
            last = ([line for line in ended.stderr.splitlines() if line.startswith("ERROR")] or ["no reason given"])[-1]
            raise StudyError(f"pip cannot install {' '.join(packages)} ({last.removeprefix('ERROR: ')})")
        stamp.write_text(listing, encoding="utf-8")
    alone = home / "adapters"  # nothing else of our environment may be found there
    alone.mkdir(exist_ok=True)
    link = alone / "studies"
    link.unlink(missing_ok=True)
    link.symlink_to(Path(studies.__path__[0]).resolve())
    return str(python), str(alone)
