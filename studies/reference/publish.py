"""`python -m studies.reference.publish SET [SCENE ...]`: solves references of the catalogue for the published set.

For a release: a new set changes results (CHANGELOG). Scenes that are not named keep their present file.
"""

import argparse
import hashlib
import json
import sys
import tempfile
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path

import h5py
import numpy as np

from studies.base.errors import StudyError
from studies.base.processes import run_each
from studies.reference.load import Reference, load_reference
from studies.reference.published import FOLDER, INDEX, LENGTHS, PRECISION, index, physics
from studies.reference.reference_solves import ReferenceSolve
from studies.reference.solve import solve
from studies.scene.library import CUT, JUDGED
from studies.scene.scene import Scene

MOST, TOLERANCE = 80e3, 0.002
"""Unknowns and tolerance of published nested references: finer than the plans of the scenes, which are affordable for
users."""
PROCESSES = 2


def finer(scene: Scene, most: float = MOST) -> Scene:
    """The scene with the plan of its published reference, of at most `most` unknowns."""
    plan = scene.reference
    assert plan is not None  # scenes without a plan are left out
    return replace(scene, reference=replace(plan, most=most, tolerance=TOLERANCE)) if plan.nested else scene


def judged_scenes() -> dict[str, Scene]:
    """Scenes of the catalogue whose reference is published, by name: all that have one, but those in which the faces of
    a cut touch, those with several cuts, and those whose cut opens a lumen."""
    opened = [
        scene for scene in CUT if len(scene.cuts) == 1 and not (scene.cuts[0].contact or scene.cuts[0].opens_lumen)
    ]
    return {scene.name: scene for scene in (*JUDGED, *opened) if scene.reference is not None}


def solved(work: tuple[str, str, float]) -> None:
    """Run in a worker process: solves one scene of the catalogue; work: (name, folder, most unknowns)."""
    name, root, most = work
    solve(Path(root), ReferenceSolve(finer(judged_scenes()[name], most)))


def publish(name: str, chosen: list[str], root: Path, most: float = MOST) -> Path:
    """Solves the chosen scenes below `root` and writes them as the set `name`, in which the others keep their files;
    returns the path of its index. Raises StudyError for a scene that did not converge."""
    for scene, _, cause in run_each([(scene, str(root), most) for scene in chosen], PROCESSES, solved):
        if cause is not None:
            raise StudyError(f"{scene[0]} was not solved: {cause}")
        print(f"solved {scene[0]}", flush=True)
    references = {key: load_reference(root, finer(judged_scenes()[key], most)) for key in chosen}
    return write_published(FOLDER, name, {key: one for key, one in references.items() if one is not None})


def write_published(folder: Path, name: str, references: Mapping[str, Reference]) -> Path:
    """A set of references in a folder, by the names of their scenes; returns the path of its index. Other entries of
    the index do not change."""
    folder.mkdir(parents=True, exist_ok=True)
    path = folder / INDEX
    listed = json.loads(path.read_text(encoding="utf-8"))["references"] if path.is_file() else {}
    for scene, reference in references.items():
        file = folder / f"{scene}.h5"
        write_file(file, reference)
        bars = {quantity: float(f"{bar:.3g}") for quantity, bar in reference.total_uncertainty.items()}
        listed[scene] = {
            "file": file.name,
            "sha256": hashlib.sha256(file.read_bytes()).hexdigest(),
            "physics": physics(reference.scene),
            "unknowns": reference.record.attributes["unknowns"],
            "relative bars": bars,
        }
    path.write_text(json.dumps({"set": name, "references": listed}, indent=1) + "\n", encoding="utf-8")
    index.cache_clear()
    return path


def write_file(path: Path, reference: Reference) -> None:
    """All fields of a reference, compressed, its lengths rounded to PRECISION of the largest displacement."""
    largest = np.abs(reference.field("displacement")).max()
    digits = int(np.ceil(-np.log10(2.0 * PRECISION * largest)))
    with h5py.File(path, "w", libver="v110") as file:
        file.attrs.update(reference.record.attributes)
        for name, item in reference.record.fields.items():
            values = np.asarray(item.values)
            if values.dtype.kind == "U":
                file.create_dataset(name, data=values.astype(h5py.string_dtype()))
            elif name in LENGTHS:
                rounded = np.round(values, digits).astype(np.float32)
                file.create_dataset(name, data=rounded, scaleoffset=digits, compression="gzip")
            else:
                options = {"compression": "gzip", "shuffle": True} if values.size > 100 else {}
                file.create_dataset(name, data=values.astype(np.uint32) if name == "tetrahedra" else values, **options)


def main(words: list[str]) -> int:
    """Exit codes: 0; 1 where a scene was not solved; 2 for an unknown scene."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("set", help="name of the set: the year and a number, as 2027.1")
    parser.add_argument("scenes", nargs="*", metavar="SCENE", help="default: all of the catalogue")
    parser.add_argument("--root", type=Path, help="where solutions are kept; default: a folder that is removed")
    parser.add_argument("--most", type=float, default=MOST, metavar="N", help="unknowns of nested references")
    given = parser.parse_args(words)
    unknown = [scene for scene in given.scenes if scene not in judged_scenes()]
    if unknown:
        print(f"no scene with a reference is called {unknown[0]}", file=sys.stderr)
        return 2
    with tempfile.TemporaryDirectory() as folder:
        try:
            path = publish(given.set, given.scenes or list(judged_scenes()), given.root or Path(folder), given.most)
        except StudyError as error:
            print(f"organbench: {error}", file=sys.stderr)
            return 1
    size = sum(file.stat().st_size for file in path.parent.glob("*.h5"))
    print(f"{path}: {len(list(path.parent.glob('*.h5')))} references, {size / 1e6:.1f} MB")
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
