"""`python -m studies.reference.publish SET [SCENE ...]`: solves references of the catalogue for the published set.

For a release: a new set changes results (CHANGELOG). Scenes that are not named keep the file that they have.
"""

import argparse
import sys
import tempfile
from dataclasses import replace
from pathlib import Path

from studies.base.errors import StudyError
from studies.base.processes import run_each
from studies.reference.load import Reference, load_reference
from studies.reference.published import FOLDER, index, published, record_of, write_published
from studies.reference.reference_solves import ReferenceSolve
from studies.reference.solve import solve
from studies.scene.library import JUDGED
from studies.scene.scene import Scene

MOST, TOLERANCE = 80e3, 0.002
"""Of published nested references: finer than the plan of the scene, which a user can afford."""
PROCESSES = 2


def finer(scene: Scene) -> Scene:
    """The scene with the plan of its published reference."""
    plan = scene.reference
    assert plan is not None  # scenes without a plan are left out
    return replace(scene, reference=replace(plan, most=MOST, tolerance=TOLERANCE)) if plan.nested else scene


def judged_scenes() -> dict[str, Scene]:
    """Scenes of the catalogue that have a reference, by name."""
    return {scene.name: scene for scene in JUDGED}


def solved(work: tuple[str, str]) -> None:
    """In a process: solves one scene of the catalogue, (name, folder)."""
    name, root = work
    solve(Path(root), ReferenceSolve(finer(judged_scenes()[name])))


def publish(name: str, chosen: list[str], root: Path) -> Path:
    """Solves the chosen scenes below `root` and writes them, with those already published, as the set `name`; where
    its index lies. Raises StudyError for a scene that did not converge."""
    scenes = judged_scenes()
    for scene, _, cause in run_each([(scene, str(root)) for scene in chosen], PROCESSES, solved):
        if cause is not None:
            raise StudyError(f"{scene[0]} was not solved: {cause}")
        print(f"solved {scene[0]}", flush=True)
    references: dict[str, Reference] = {}
    for key, scene in scenes.items():
        entry = published(scene)
        if key in chosen:
            reference = load_reference(root, finer(scene))
            assert reference is not None  # it was solved
            references[key] = reference
        elif entry is not None:
            references[key] = Reference(scene, record_of(scene, entry))
    index.cache_clear()
    return write_published(FOLDER, name, references)


def main(words: list[str]) -> int:
    """Exit codes: 0; 1 where a scene was not solved; 2 for an unknown scene."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("set", help="name of the set: the year and a number, as 2027.1")
    parser.add_argument("scenes", nargs="*", metavar="SCENE", help="default: all of the catalogue")
    parser.add_argument("--root", type=Path, help="where solutions are kept; default: a folder that is removed")
    given = parser.parse_args(words)
    unknown = [scene for scene in given.scenes if scene not in judged_scenes()]
    if unknown:
        print(f"no scene with a reference is called {unknown[0]}", file=sys.stderr)
        return 2
    with tempfile.TemporaryDirectory() as folder:
        try:
            path = publish(given.set, given.scenes or list(judged_scenes()), given.root or Path(folder))
        except StudyError as error:
            print(f"organbench: {error}", file=sys.stderr)
            return 1
    size = sum(file.stat().st_size for file in path.parent.glob("*.h5"))
    print(f"{path}: {len(list(path.parent.glob('*.h5')))} references, {size / 1e6:.1f} MB")
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
