"""Files that trimesh reads: STL, OFF, OBJ and glTF (geometry only, no materials or motion), with their named objects;
and PLY."""

import io
import re
from pathlib import Path
from typing import Any

import meshio
import numpy as np

from studies.base.within import file_within
from studies.geometry.files.content import Content

NONE = np.empty((0, 4), np.int64)
METRES = (".glb", ".gltf")
"""Formats whose standard prescribes metres."""
OBJECT = re.compile(rb"^o[ \t]+(\S.*?)\s*$", re.MULTILINE)
"""The line with which an object of an OBJ file begins."""


def read_objects(path: Path) -> Content:
    """All triangles of a file. Each object has its transformation applied and is a part, if there are several (Khronos
    Group: glTF 2.0 specification, 2021). Raises any exception of trimesh for a broken file."""
    scene = scene_of(path)
    points, triangles, part, names = [np.empty((0, 3))], [np.empty((0, 3), np.int64)], [np.empty(0, np.int64)], []
    count = 0
    for node in in_order(scene, path):
        placed, name = scene.graph[node]
        shape = scene.geometry[name]
        faces = np.asarray(getattr(shape, "faces", []), np.int64).reshape(-1, 3)
        if not len(faces):
            continue  # only lines or points
        points.append(np.asarray(shape.vertices, float) @ placed[:3, :3].T + placed[:3, 3])
        # A reflection would turn the triangles inwards.
        triangles.append((faces[:, ::-1] if np.linalg.det(placed[:3, :3]) < 0 else faces) + count)
        part.append(np.full(len(faces), len(names)))
        names.append(str(name))
        count += len(points[-1])
    numbers, several = np.concatenate(part), len(names) > 1
    return Content(
        np.concatenate(points),
        np.concatenate(triangles),
        NONE,
        names=tuple(names) if several else (),
        part=numbers if several else numbers[:0],
        unit="m" if path.suffix.lower() in METRES else None,
    )


def read_ply(path: Path) -> meshio.Mesh:
    """A PLY with edges, texture coordinates or other lists. Raises any exception of trimesh for a broken file."""
    from trimesh.exchange.ply import load_ply

    read = load_ply(io.BytesIO(path.read_bytes()), fix_texture=False, skip_materials=True)
    vertex = read["metadata"]["_ply_raw"]["vertex"]
    data: dict[str, Any] = {
        name: np.ravel(vertex["data"][name]) for name in vertex["properties"] if name not in ("x", "y", "z")
    }
    return meshio.Mesh(read["vertices"], [("triangle", np.asarray(read["faces"]))], data)


def scene_of(path: Path) -> Any:
    """The file as a trimesh scene, whose points are neither merged nor reordered."""
    import trimesh  # takes a second to load, and few files need it
    from trimesh.resolvers import FilePathResolver

    class Beside(FilePathResolver):
        def get(self, name: str) -> bytes:
            return file_within(path.parent, name, path.name).read_bytes()

    if path.suffix.lower() != ".obj":
        with path.open("rb") as file:
            kind = path.suffix.lower().removeprefix(".")
            return trimesh.load_scene(file, file_type=kind, resolver=Beside(str(path)), process=False)
    text = io.BytesIO(counted_from_one(path.read_bytes()))
    return trimesh.load_scene(text, file_type="obj", process=False, skip_materials=True, split_objects=True)


def in_order(scene: Any, path: Path) -> list[str]:
    """Names of the nodes of a scene that have geometry, in the order of the file."""
    names = list(scene.geometry)
    if path.suffix.lower() == ".obj":
        names = [name.decode(errors="ignore") for name in OBJECT.findall(path.read_bytes())] + names
    return sorted(scene.graph.nodes_geometry, key=lambda node: names.index(scene.graph[node][1]))


def counted_from_one(text: bytes) -> bytes:
    """The text of an OBJ whose faces count points from the first one, without texture coordinates and normals, where
    negative numbers count back; else the text unchanged."""
    if not re.search(rb"^f\b.*-\d", text, re.MULTILINE):
        return text
    lines, points = [], 0
    for line in text.splitlines():
        points += line.startswith((b"v ", b"v\t"))
        if line.startswith((b"f ", b"f\t")):
            corners = [int(word.split(b"/")[0]) for word in line.split()[1:]]
            line = b"f " + b" ".join(b"%d" % (k + 1 + points if k < 0 else k) for k in corners)
        lines.append(line)
    return b"\n".join(lines) + b"\n"
