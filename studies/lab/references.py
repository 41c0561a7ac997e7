"""`python -m studies.lab.references publish SET [SCENE ...]` solves references of the catalogue for the published set;
`... check [SCENE ...]` solves published ones again and says of each whether it is within the error bars of both.

For a release: a new set changes results (CHANGELOG). Scenes that are not named keep their present file.
"""

import argparse
import hashlib
import json
import multiprocessing
import sys
import tempfile
from collections.abc import Mapping
from concurrent.futures import ProcessPoolExecutor
from dataclasses import replace
from functools import partial
from pathlib import Path

import h5py
import numpy as np

from studies import Record, Reference, Scene, reference_for, solve_reference
from studies.lab.refusal import refusal
from studies.reference.published import FOLDER, INDEX, LENGTHS, PRECISION, index, judged_scenes, physics

MOST, TOLERANCE = 80e3, 0.002
"""Unknowns and tolerance of published nested references: finer than the plans of the scenes, which are affordable for
users."""
PROCESSES = 2


def finer(scene: Scene, most: float = MOST) -> Scene:
    """The scene with the plan of its published reference, of at most `most` unknowns."""
    plan = scene.reference
    assert plan is not None  # scenes without a plan are left out
    return replace(scene, reference=replace(plan, most=most, tolerance=TOLERANCE)) if plan.nested else scene


def solved(root: Path, most: float, name: str) -> Reference:
    """A scene of the catalogue, in a process of its own."""
    return solve_reference(root, finer(judged_scenes()[name], most))


def publish(set_name: str, names: list[str], root: Path, most: float = MOST, folder: Path = FOLDER) -> Path:
    """Solves the scenes below `root` and writes them as the set; returns the path of its index. Raises StudyError."""
    with ProcessPoolExecutor(PROCESSES, multiprocessing.get_context("spawn")) as pool:
        references = dict(zip(names, pool.map(partial(solved, root, most), names), strict=True))
    records = {name: (one.scene, one.record, one.total_uncertainty) for name, one in references.items()}
    return write_published(folder, set_name, records)


def write_published(folder: Path, name: str, records: Mapping[str, tuple[Scene, Record, Mapping[str, float]]]) -> Path:
    """A set of references in a folder: by name of the scene the scene, its record and its error bars; returns the path
    of the index. Other entries of the index do not change."""
    folder.mkdir(parents=True, exist_ok=True)
    path = folder / INDEX
    listed = json.loads(path.read_text(encoding="utf-8"))["references"] if path.is_file() else {}
    for title, (scene, record, bars) in records.items():
        file = folder / f"{title}.h5"
        write_file(file, record)
        listed[title] = {
            "file": file.name,
            "sha256": hashlib.sha256(file.read_bytes()).hexdigest(),
            "physics": physics(scene),
            "unknowns": record.attributes["unknowns"],
            "shape error": float(f"{record.attributes.get('shape_error', np.nan):.3g}"),
            "relative bars": {quantity: float(f"{bar:.3g}") for quantity, bar in bars.items()},
        }
    path.write_text(json.dumps({"set": name, "references": listed}, indent=1) + "\n", encoding="utf-8")
    index.cache_clear()
    return path


def write_file(path: Path, record: Record) -> None:
    """All fields of a reference, compressed, its lengths rounded to PRECISION of the largest displacement."""
    largest = np.abs(record.fields["displacement"].values).max()
    digits = int(np.ceil(-np.log10(2.0 * PRECISION * largest)))
    with h5py.File(path, "w", libver="v110") as file:
        file.attrs.update(record.attributes)
        for name, item in record.fields.items():
            values = np.asarray(item.values)
            if values.dtype.kind == "U":
                file.create_dataset(name, data=values.astype(h5py.string_dtype()))
            elif name in LENGTHS:
                rounded = np.round(values, digits).astype(np.float32)
                file.create_dataset(name, data=rounded, scaleoffset=digits, compression="gzip")
            else:
                options = {"compression": "gzip", "shuffle": True} if values.size > 100 else {}
                file.create_dataset(name, data=values.astype(np.uint32) if name == "tetrahedra" else values, **options)


def check(names: list[str], root: Path) -> list[str]:
    """Solves scenes by their own plans and prints how far each quantity is from the published one; those that are
    beyond the sum of both error bars. Raises StudyError."""
    off = []
    for name in names:
        published = reference_for(FOLDER, judged_scenes()[name])
        apart = solve_reference(root, judged_scenes()[name]).apart(published) if published else {}
        bad = any(not difference <= allowed for difference, allowed in apart.values())
        off += [name] if bad else []
        words = ", ".join(f"{what} {difference:.2g} of {allowed:.2g}" for what, (difference, allowed) in apart.items())
        print(f"{name}: {'OFF' if bad else 'within its bars'} ({words})", flush=True)
    return off


def main(words: list[str]) -> int:
    """Exit code 1: a published reference is beyond the bars."""
    parser = argparse.ArgumentParser(
        prog="python -m studies.lab.references", description=(__doc__ or "").split("\n")[0]
    )
    parser.add_argument("what", choices=("publish", "check"))
    parser.add_argument("names", nargs="*", help="publish: name of the set, as 2027.1; then scenes, default: all")
    parser.add_argument("--most", type=float, default=MOST, metavar="N", help="unknowns of nested published references")
    given = parser.parse_args(words)
    with tempfile.TemporaryDirectory() as folder:
        if given.what == "check":
            return int(bool(check(given.names or list(judged_scenes()), Path(folder))))
        name, *scenes = given.names
        print(publish(name, scenes or list(judged_scenes()), Path(folder), given.most))
    return 0


if __name__ == "__main__":
    with refusal("references"):
        sys.exit(main(sys.argv[1:]))
