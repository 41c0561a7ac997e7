"""Meshes from recipes: read from the cache, or made by the worker process with a time limit."""

import hashlib
import json
import os
import sys
import tempfile
import warnings
import zipfile
from collections.abc import Callable
from dataclasses import replace
from functools import lru_cache
from importlib.metadata import version
from pathlib import Path
from typing import Any

import numpy as np

from massspring.sources import cache_folder as user_cache
from massspring.sources import source_fingerprint
from studies.base.errors import StudyError
from studies.geometry.mesh.organ_mesh import OrganMesh
from studies.geometry.mesher.process import STOPPED, followed
from studies.geometry.mesher.shipped import shipped
from studies.geometry.shape.regions import held_nodes, region_from_dict

TIME_LIMIT = 300.0
"""Processor time [s] after which a meshing job is stopped: 20 times that of the largest one."""
NAME_BYTES = 80
"""Most bytes of the name of a mesh in the name of its file; file systems allow 255 in all."""
PARTS = ("points", "triangles", "tetrahedra", "surface_count", "outer_count")
"""Names of the arrays that the worker makes and the cache stores."""
LEVEL = ("low", "cell", "values", "losses")
"""The same for a recipe of kind "level": corner [m], cell edge [m] and distances [m] of a grid, and its losses."""

MADE_ELSEWHERE = {
    "scan": "studies.geometry.mesher.scan_recipe",
    "level": "studies.geometry.mesher.scan_recipe",
    "curved": "studies.geometry.mesh.second_order",
}
"""Modules of the kinds of recipes that organ_recipe does not make."""
MAKERS = ("studies.geometry.mesher.organ_recipe", *dict.fromkeys(MADE_ELSEWHERE.values()))
"""Modules that make meshes. Some run in a separate process, so no import refers to them."""


def mesh_from(
    recipe: dict[str, Any], arrays: dict[str, np.ndarray] | None = None, limit: float = TIME_LIMIT
) -> OrganMesh:
    """The mesh of a JSON-able recipe and the arrays that it needs, shipped or cached; limit: processor time [s]. Raises
    StudyError if it cannot be made or stored, and for a region without nodes."""
    given, cuts = arrays or {}, cuts_of(recipe)
    ready = None if given else shipped(recipe)
    parts = (*PARTS, *(("losses",) if recipe["kind"] == "scan" else ()), *cuts)
    made = ready or cached(recipe, given, parts, lambda: run_worker(recipe, given | surface_of(recipe), limit))
    mesh = OrganMesh(
        recipe["name"],
        made["points"],
        made["triangles"],
        made["tetrahedra"],
        int(made["surface_count"]),
        recipe=recipe,
        outer_count=int(made["outer_count"]),
        losses=json.loads(str(made["losses"])) if "losses" in made else {},
        cuts={cut["name"]: made[part] for part, cut in cuts.items()},
    )
    return replace(mesh, patches=patches_of(mesh, recipe.get("regions", {})))


def surface_of(recipe: dict[str, Any]) -> dict[str, np.ndarray]:
    """Points and triangles of the surface that the recipe of an organ fills, if the cache has them; else {}."""
    if recipe["kind"] != "organ" or not recipe["fill"] or cuts_of(recipe):
        return {}
    alone = {key: value for key, value in recipe.items() if key != "layers"} | {"fill": False}
    surface = shipped(alone) or stored_in(cache_path(alone, {}), PARTS)
    return {} if surface is None else {part: surface[part] for part in ("points", "triangles")}


def cuts_of(recipe: dict[str, Any]) -> dict[str, dict[str, Any]]:
    """Name of the array of the faces of each cut -> the cut in the recipe."""
    cuts = recipe.get("cuts", [recipe["cut"]] if "cut" in recipe else [])
    return {f"cut_faces{k or ''}": cut for k, cut in enumerate(cuts)}


def cached(
    recipe: dict[str, Any],
    arrays: dict[str, np.ndarray],
    parts: tuple[str, ...],
    make: Callable[[], dict[str, np.ndarray]],
) -> dict[str, np.ndarray]:
    """The arrays named `parts` for a recipe: from the cache, or made by `make` and stored. Raises StudyError if they
    cannot be stored."""
    path = cache_path(recipe, arrays)
    stored = stored_in(path, parts)
    if stored is not None:
        return stored
    made = make()
    try:
        # Under a temporary name first, so that another process sees all of the file or none.
        path.parent.mkdir(parents=True, exist_ok=True)
        with tempfile.NamedTemporaryFile(dir=path.parent, prefix=path.stem, suffix=".part", delete=False) as part:
            np.savez(part, allow_pickle=False, **made)
        os.replace(part.name, path)
    except OSError as error:
        raise StudyError(
            f"the mesh cannot be stored in {path.parent} ({error.strerror}); "
            "set ORGANBENCH_CACHE to a folder that can be written"
        ) from error
    return made


def stored_in(path: Path, parts: tuple[str, ...]) -> dict[str, np.ndarray] | None:
    """The arrays of a file of the cache, or None if there is none or, with a warning, it is damaged."""
    if not path.exists():
        return None
    try:
        with np.load(path, allow_pickle=False) as data:
            return {key: data[key] for key in parts}
    except (OSError, ValueError, KeyError, EOFError, zipfile.BadZipFile) as error:
        warnings.warn(f"the cached mesh {path} is damaged ({error}); it is made again", stacklevel=3)
        return None


def patches_of(mesh: OrganMesh, regions: dict[str, dict[str, Any]]) -> dict[str, np.ndarray]:
    """Outer nodes inside each region or on its outline. Raises StudyError for a region without nodes."""
    surface = mesh.points[: mesh.outer_count]
    patches = {}
    for name, data in regions.items():
        patches[name] = held_nodes(region_from_dict(data), surface)
        if not len(patches[name]):
            raise StudyError(
                f"{mesh.name}: region {name!r} holds no surface node; move or enlarge it, or use more nodes"
            )
    return patches


def cache_folder() -> Path:
    """ORGANBENCH_CACHE if set, else results/cache/meshes if the current folder has results, else that of the user."""
    given, results = os.environ.get("ORGANBENCH_CACHE"), Path.cwd() / "results"
    if given:
        return Path(given)
    return results / "cache" / "meshes" if results.is_dir() else user_cache() / "meshes"


def cache_path(recipe: dict[str, Any], arrays: dict[str, np.ndarray]) -> Path:
    name = recipe["name"].encode()[:NAME_BYTES].decode(errors="ignore")
    return cache_folder() / f"{name}-{recipe_hash(recipe, arrays)}.npz"


def recipe_hash(recipe: dict[str, Any], arrays: dict[str, np.ndarray]) -> str:
    """Hash, 16 hexadecimal digits, of all that decides the mesh: recipe, given arrays, our code, versions of
    libraries."""
    digest = hashlib.sha256(code_hash(recipe["kind"]).encode())
    digest.update(json.dumps(recipe, sort_keys=True).encode())
    for key in sorted(arrays):
        digest.update(
            f"{key} {arrays[key].dtype} {arrays[key].shape}".encode() + np.ascontiguousarray(arrays[key]).tobytes()
        )
    return digest.hexdigest()[:16]


@lru_cache
def code_hash(kind: str) -> str:
    """Fingerprint of the code that makes a kind of recipe, and the versions of the libraries that decide a mesh."""
    versions = " ".join(version(name) for name in ("gmsh", "mmgpy", "scikit-image", "numpy", "scipy"))
    return f"{source_fingerprint(MADE_ELSEWHERE.get(kind, MAKERS[0]))} {versions}"


def run_worker(recipe: dict[str, Any], arrays: dict[str, np.ndarray], limit: float) -> dict[str, np.ndarray]:
    """Runs the worker on a job and returns the arrays that it made.

    Raises StudyError with the message of the worker, for a crash, and after `limit` seconds of processor time.
    """
    with tempfile.TemporaryDirectory() as folder:
        job, out = Path(folder, "job.npz"), Path(folder, "out.npz")
        np.savez(job, allow_pickle=False, recipe=np.array(json.dumps(recipe)), **arrays)
        maker = MADE_ELSEWHERE.get(recipe["kind"], MAKERS[0])
        command = [sys.executable, "-m", maker, str(job), str(out), repr(limit)]
        code, stage, last = followed(command, recipe["name"], limit)
        if out.exists():
            with np.load(out, allow_pickle=False) as data:
                if "error" in data.files:
                    raise StudyError(str(data["error"]))
                return {key: data[key] for key in data.files}
    at = f" at: {stage}" if stage else ""
    if code in STOPPED:
        raise StudyError(
            f"{recipe['name']}: the mesher was stopped after {limit:g} s of processor time{at}; {wayout(recipe)}"
        )
    raise StudyError(f"{recipe['name']}: the mesher ended with code {code}{at} ({last}); {wayout(recipe)}")


def wayout(recipe: dict[str, Any]) -> str:
    if recipe["kind"] in ("scan", "level"):
        return "smooth the surface (--smooth 3), or ask for another node count"
    return "repair the surface, or make a new one (--nodes N)" if recipe["kind"] == "fill" else "try another node count"
