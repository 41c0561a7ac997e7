"""`python -m studies.exchange.peers.run MODULE FOLDER OUT MESH SETTINGS`: one adapter on one exported scene.

It runs with the interpreter of the program's environment, and adds the versions of all packages there to the results.
"""

import json
import platform
import sys
from importlib import import_module
from importlib.metadata import distributions
from pathlib import Path

from studies.exchange.peers.scene_folder import CANNOT, MISSING, CannotDo, SceneFolder


def main(module: str, folder: str, out: str, mesh: str, settings: str) -> int:
    """Exit code 0, CANNOT or MISSING with a sentence on standard error; any other code is an error of the adapter."""
    try:
        adapter = import_module(module)
    except ModuleNotFoundError as error:
        print(f"{error.name} is not installed", file=sys.stderr)
        return MISSING
    try:
        adapter.run(SceneFolder(Path(folder), mesh), Path(out), **json.loads(settings))
    except CannotDo as reason:
        print(reason, file=sys.stderr)
        return CANNOT
    report = Path(out).with_suffix(".json")
    report.write_text(json.dumps(json.loads(report.read_text(encoding="utf-8")) | surroundings()), encoding="utf-8")
    return 0


def surroundings() -> dict[str, str | dict[str, str]]:
    """Python, the machine, and all installed packages with their versions."""
    packages = {one.metadata["Name"].lower(): one.version for one in distributions()}
    return {
        "python": platform.python_version(),
        "machine": platform.platform(),
        "packages": dict(sorted(packages.items())),
    }


if __name__ == "__main__":
    sys.exit(main(*sys.argv[1:]))
