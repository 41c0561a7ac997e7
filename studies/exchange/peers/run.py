"""`python -m studies.exchange.peers.run MODULE FOLDER OUT MESH SHORTER`: one adapter on one exported scene."""

import sys
from importlib import import_module
from pathlib import Path

from studies.exchange.peers.scene_folder import CANNOT, MISSING, CannotDo, SceneFolder


def main(module: str, folder: str, out: str, mesh: str, shorter: str) -> int:
    """Exit code 0, CANNOT or MISSING with a sentence on standard error; anything else is the adapter's own error."""
    try:
        adapter = import_module(module)
    except ModuleNotFoundError as error:
        print(f"{error.name} is not installed; pip install 'organbench[peers]'", file=sys.stderr)
        return MISSING
    try:
        adapter.run(SceneFolder(Path(folder), mesh), Path(out), float(shorter))
    except CannotDo as reason:
        print(reason, file=sys.stderr)
        return CANNOT
    return 0


if __name__ == "__main__":
    sys.exit(main(*sys.argv[1:]))
