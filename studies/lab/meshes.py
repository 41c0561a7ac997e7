"""`python -m studies.lab.meshes publish` makes the meshes that are shipped with the package: those of the main studies
and of all smoke runs, and so of the demo; `... check` makes each again and names those that differ.

For a release: a new set changes results (CHANGELOG). Files are compressed, and no digit is lost.
"""

import argparse
import hashlib
import json
import os
import sys
import warnings
import zipfile
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from studies import STUDIES, Study, StudyError, prepare
from studies.geometry.mesher import jobs
from studies.geometry.mesher.shipped import FOLDER, INDEX, OWN, index, key_of, shipped
from studies.lab.refusal import refusal

Meshes = Mapping[str, tuple[dict[str, Any], Mapping[str, np.ndarray]]]
"""Key of a recipe -> the recipe, the arrays."""
SHIPPED = (*(study.smoke() for study in STUDIES), *(study for study in STUDIES if study.main))
DIGITS = 16
"""Of a key in the name of its file."""


def made(studies: Sequence[Study] = SHIPPED) -> Meshes:
    """The meshes of the organs of all cases, made anew unless the cache has them by this very code; an adaptive body
    begins with one of them."""
    meshes, real = dict[str, tuple[dict[str, Any], Mapping[str, np.ndarray]]](), jobs.cached

    def noted(recipe: dict[str, Any], *given: Any) -> dict[str, np.ndarray]:
        arrays = real(recipe, *given)
        if recipe["kind"] == "organ":
            meshes[key_of(recipe)] = recipe, arrays
        return arrays

    cases = {(case.scene.name, case.body): case for study in studies for case in study.cases}
    jobs.cached, os.environ[OWN] = noted, "1"
    try:
        for case in cases.values():
            try:
                prepare(case)
            except StudyError as error:
                print(f"{case.name}: {error}", file=sys.stderr)
    finally:
        jobs.cached = real
        del os.environ[OWN]
    return meshes


def publish(meshes: Meshes, folder: Path = FOLDER) -> float:
    """Writes the set in place of the one that is there; its size [MB]."""
    folder.mkdir(exist_ok=True)
    for old in folder.iterdir():
        old.unlink()
    listed, size = {}, 0
    for key, (recipe, arrays) in sorted(meshes.items(), key=lambda item: (item[1][0]["name"], item[0])):
        file = folder / f"{recipe['name']}-{key[:DIGITS]}.npz"
        with zipfile.ZipFile(file, "w") as packed:
            for name, values in arrays.items():
                entry = zipfile.ZipInfo(f"{name}.npy")  # without the time of writing
                entry.compress_type = zipfile.ZIP_LZMA
                with packed.open(entry, "w") as member:
                    np.lib.format.write_array(member, np.asarray(values), allow_pickle=False)
        listed[key] = {"file": file.name, "sha256": hashlib.sha256(file.read_bytes()).hexdigest()}
        size += file.stat().st_size
    (folder / INDEX).write_text(json.dumps({"meshes": listed}, indent=1) + "\n", encoding="utf-8")
    index.cache_clear()
    return size / 1e6


def differences(meshes: Meshes, folder: Path = FOLDER) -> list[str]:
    """A line for each mesh that is not shipped as it was made."""
    lines = []
    for recipe, arrays in meshes.values():
        stored = shipped(recipe, folder)
        if stored is None or any(not np.array_equal(values, stored[name]) for name, values in arrays.items()):
            lines.append(
                f"{recipe['name']}, {recipe['nodes']} nodes: {'not' if stored is None else 'otherwise'} shipped"
            )
    return lines


def main(words: list[str]) -> int:
    """Exit code 1: a mesh differs from the shipped one."""
    parser = argparse.ArgumentParser(prog="python -m studies.lab.meshes", description=(__doc__ or "").split("\n\n")[0])
    parser.add_argument("what", choices=("publish", "check"))
    what = parser.parse_args(words).what
    warnings.simplefilter("ignore", UserWarning)
    if what == "publish":
        print(f"{publish(made()):.1f} MB in {FOLDER}")
        return 0
    lines = differences(made())
    print("\n".join(lines) or "all as shipped")
    return int(bool(lines))


if __name__ == "__main__":
    with refusal("meshes"):
        sys.exit(main(sys.argv[1:]))
