"""A scene in a folder, so that another program can run it without this one."""

import json
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
from jinja2 import Environment, FileSystemLoader, StrictUndefined

from studies.base.atomic import write_whole
from studies.base.errors import StudyError
from studies.exchange.description import CUT_FILES, FILES, HELD, LUMEN, OUTER, description
from studies.exchange.meshes import NODES, GivenMesh, given_meshes, given_scene
from studies.exchange.starter import NAME, SOLVER
from studies.geometry.files.writing import write_grid_file
from studies.geometry.mesh.organ_mesh import OrganMesh
from studies.scene.scene import Scene

DESCRIPTION, README = "scene.json", "README.md"
PAGE = Environment(
    loader=FileSystemLoader(Path(__file__).parent),
    undefined=StrictUndefined,
    trim_blocks=True,
    lstrip_blocks=True,
    keep_trailing_newline=True,
).get_template("readme.md.jinja")
DIGITS = 12
"""Significant digits of exported numbers: 3.6 and not 3.5999999999999996."""


def export(
    scene: Scene, folder: Path, nodes: int = NODES, rows: Sequence[Sequence[str]] = ()
) -> tuple[list[Path], str]:
    """Writes the scene into `folder` with `nodes` vertices on its outer surface; the files, and why there is no curved
    mesh (nothing where there is one). rows: a body of ours, its error of force and of displacement [%], each as text.

    Of a scene with a cut the meshes are cut already. An earlier export in the folder is replaced, but for a solve.py
    that was edited. Raises StudyError for a folder that is a file or holds something else, a mesh that cannot be made,
    and a cut whose time matters.
    """
    scene = given_scene(scene)
    if folder.exists() and not folder.is_dir():
        raise StudyError(f"{folder} is a file; give the name of a folder")
    if folder.is_dir() and any(folder.iterdir()) and not (folder / DESCRIPTION).is_file():
        raise StudyError(f"{folder} holds other files; give a new folder, or one with an exported scene")
    meshes, why_not = given_meshes(scene, nodes)
    data = rounded(description(scene, meshes, why_not))
    for mesh in meshes:
        kind = "tetra10" if mesh.cells.shape[1] == 10 else "tetra"
        write_grid_file(folder / FILES[mesh.kind], mesh.points, {kind: mesh.cells}, marks(mesh))
    write_surface(meshes[0], folder / FILES["surface"])
    texts = {CUT_FILES[mesh.kind]: facets_csv(mesh) for mesh in meshes if scene.cut is not None}
    texts[FILES["paths"]] = paths_table(scene).to_csv(index=False, float_format=f"%.{DIGITS}g")
    texts[DESCRIPTION] = json.dumps(data, indent=1) + "\n"
    texts[README] = PAGE.render(data, nodes=nodes, rows=rows)
    solver = folder / NAME
    if not solver.is_file() or solver.read_text(encoding="utf-8", errors="replace") == SOLVER:
        texts[NAME] = SOLVER
    for name, text in texts.items():
        write_whole(folder / name, text.encode())
    written = [*(FILES[mesh.kind] for mesh in meshes), FILES["surface"], *texts]
    for name in {*FILES.values(), *CUT_FILES.values()} - {*written}:
        (folder / name).unlink(missing_ok=True)  # of an earlier export
    return [folder / name for name in written], why_not


def rounded(value: Any) -> Any:
    """The same with every number in it to DIGITS digits, and no zero with a sign."""
    if isinstance(value, dict):
        return {name: rounded(part) for name, part in value.items()}
    if isinstance(value, list | tuple):
        return [rounded(part) for part in value]
    return float(f"{value:.{DIGITS}g}") + 0.0 if isinstance(value, float) else value


def marks(mesh: GivenMesh) -> dict[str, np.ndarray]:
    """Point data, 1 or 0, (n,): outer surface, lumen and held regions."""
    number = np.arange(len(mesh.points))
    outer = number < mesh.mesh.outer_count
    masks = {OUTER: outer}
    if mesh.mesh.hollow:
        masks[LUMEN] = ~outer & (number < mesh.mesh.surface_count)
    for name, nodes in mesh.held_nodes().items():
        masks[HELD + name] = np.isin(number, nodes)
    return {name: values.astype(np.int32) for name, values in masks.items()}


def write_surface(straight: GivenMesh, path: Path) -> None:
    assert isinstance(straight.mesh, OrganMesh)  # linear
    count = straight.mesh.outer_count
    data = {name: values[:count] for name, values in marks(straight).items() if name.startswith(HELD)}
    write_grid_file(path, straight.points[:count], {"triangle": straight.mesh.outer_triangles}, data)


def facets_csv(mesh: GivenMesh) -> str:
    """The facets of the cut in pairs: nodes behind it, and in front of it."""
    facets = mesh.cut_facets
    names = [f"{side}_{number}" for side in ("behind", "front") for number in range(facets.shape[2])]
    return pd.DataFrame(facets.reshape(len(facets), -1), columns=names).to_csv(index=False)


def paths_table(scene: Scene) -> pd.DataFrame:
    """Time [s] and displacements [m] of obstacles and held regions, and the factor of the lumen's volume, at the end of
    every frame of the scene and at every key time."""
    moving = {f"obstacle_{number}": obstacle.path for number, obstacle in enumerate(scene.obstacles)}
    moving |= {HELD + held.name: held.path for held in scene.held}
    keys = [t for path in moving.values() for t in path.times] + list(scene.checkpoints)
    if scene.lumen is not None:
        keys += scene.lumen.filling.times
    t = np.unique(rounded(np.concatenate([np.linspace(0.0, scene.duration, scene.frames + 1), keys]).tolist()))
    columns = {"t": t}
    for name, path in moving.items():
        columns |= {f"{name}_{axis}": values for axis, values in zip("xyz", path(t).T + 0.0, strict=True)}
    if scene.lumen is not None:
        columns["lumen_volume_factor"] = scene.lumen.filling(t)
    return pd.DataFrame(columns)
