"""Reads a mesh file by gmsh in a process of its own, which it may crash or hang (studies.geometry.mesher.process says
more): `python -m studies.geometry.files.gmsh_reader FILE OUT.npz`."""

import os
import subprocess
import sys
import tempfile
from pathlib import Path

import meshio
import numpy as np

from massspring.sources import ROOT

LIMIT = 300.0
"""Seconds after which gmsh is stopped."""
KINDS = {(2, 3): "triangle", (2, 4): "quad", (3, 4): "tetra", (3, 8): "hexahedron", (3, 6): "wedge", (3, 5): "pyramid"}
"""Dimension and number of corners -> name in meshio."""


def read_by_gmsh(path: Path) -> meshio.Mesh:
    """All elements of an MSH, MESH or Nastran file, by their corners. Raises ReadError if gmsh cannot read it."""
    # gmsh takes an MSH file with another beginning for a program, and runs it.
    if path.suffix == ".msh" and not path.read_bytes().startswith((b"$MeshFormat", b"$NOD")):
        raise meshio.ReadError("it does not begin with $MeshFormat or $NOD")
    with tempfile.TemporaryDirectory() as folder:
        out = Path(folder, "out.npz")
        command = [sys.executable, "-m", "studies.geometry.files.gmsh_reader", str(path), str(out)]
        environment = os.environ | {"PYTHONPATH": os.pathsep.join([str(ROOT), os.environ.get("PYTHONPATH", "")])}
        try:
            subprocess.run(command, env=environment, stdin=subprocess.DEVNULL, capture_output=True, timeout=LIMIT)
        except subprocess.TimeoutExpired as error:
            raise meshio.ReadError(f"gmsh needs more than {LIMIT:g} s for it") from error
        if not out.exists():
            raise meshio.ReadError("gmsh cannot read it")
        with np.load(out, allow_pickle=False) as data:
            return meshio.Mesh(data["points"], [(key.split()[0], data[key]) for key in data.files if key != "points"])


def main(path: str, out: str) -> None:
    import gmsh  # here, because it is under the GPL, and this project is not

    gmsh.initialize(readConfigFiles=False, interruptible=False)
    gmsh.option.setNumber("General.Terminal", 0)
    gmsh.merge(path)
    tags, points, _ = gmsh.model.mesh.getNodes()
    order = np.argsort(tags)
    arrays = {"points": np.reshape(points, (-1, 3))[order]}
    for number, (kind, _, corners) in enumerate(zip(*gmsh.model.mesh.getElements(), strict=True)):
        _, dimension, _, width, _, first = gmsh.model.mesh.getElementProperties(kind)
        rows = np.searchsorted(tags[order], np.reshape(corners, (-1, width))[:, :first])
        arrays[f"{KINDS.get((dimension, first), 'line')} {number}"] = rows
    np.savez(out, allow_pickle=False, **arrays)


if __name__ == "__main__":
    main(*sys.argv[1:3])
