"""The line that installs a package where this program runs, from any folder and without its environment at hand."""

import shlex
import sys


def pip_install(*packages: str) -> str:
    return shlex.join([sys.executable, "-m", "pip", "install", *packages])
