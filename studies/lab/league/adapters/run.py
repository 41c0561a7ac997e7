"""`python run.py ADAPTER FOLDER OUT MESH SETTINGS`: one adapter, by its file, on one exported scene.

It runs with the interpreter of the program's environment, and adds the versions of all packages there to the results.
"""

import json
import platform
import sys
from importlib import import_module
from importlib.metadata import distributions
from pathlib import Path

from scene_folder import CANNOT, MISSING, CannotDo, SceneFolder


def main(adapter: str, folder: str, out: str, mesh: str, settings: str) -> int:
    """Exit code 0, CANNOT or MISSING with a sentence on standard error; any other code is an error of the adapter."""
    sys.path.insert(0, str(Path(adapter).parent))
    try:
        module = import_module(Path(adapter).stem)
    except ModuleNotFoundError as error:
        print(f"{error.name} is not installed", file=sys.stderr)
        return MISSING
    try:
        module.run(SceneFolder(Path(folder), mesh), Path(out), **json.loads(settings))
    except CannotDo as reason:
        print(reason, file=sys.stderr)
        return CANNOT
    packages = {one.metadata["Name"].lower(): one.version for one in distributions()}
    surroundings = {"python": platform.python_version(), "machine": platform.platform(), "packages": packages}
    report = Path(out).with_suffix(".json")
    report.write_text(json.dumps(json.loads(report.read_text(encoding="utf-8")) | surroundings), encoding="utf-8")
    return 0


if __name__ == "__main__":
    sys.exit(main(*sys.argv[1:]))
