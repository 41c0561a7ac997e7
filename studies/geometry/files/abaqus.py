"""Abaqus files: meshio reads one block of nodes and one part, so each part is given to it alone, in one block."""

import re
from pathlib import Path
from typing import Any

import meshio
import numpy as np

SAME = re.IGNORECASE | re.MULTILINE
NODES = re.compile(rb"^\*NODE[ \t]*(?:,[^\n]*)?\n((?:[^*][^\n]*(?:\n|\Z))*)", SAME)
ELEMENTS = re.compile(rb"^\*ELEMENT[ \t]*,[^\n]*\n((?:[^*][^\n]*(?:\n|\Z))*)", SAME)
TYPE = re.compile(rb"^\*ELEMENT\b[^\n]*", SAME)
PART = re.compile(rb"^\*PART\b[^\n]*\n(.*?)^\*END PART", SAME | re.DOTALL)
INSTANCE = re.compile(rb"^\*INSTANCE\b[^\n]*\n(\s*[-+.\d])?", SAME)


def read_abaqus(path: Path) -> meshio.Mesh:
    """All parts of an Abaqus file, each where its own coordinates put it. Raises ReadError for a file that includes
    others, for an assembly that moves or repeats parts, for two nodes of one number, and for a kind of element that is
    not known."""
    text = re.sub(rb"^\s*(?:\*\*[^\n]*)?\r?\n", b"", path.read_bytes().replace(b"\r\n", b"\n"), flags=re.MULTILINE)
    if re.search(rb"^\*INCLUDE\b", text, SAME):
        raise meshio.ReadError("it includes other files; write one file")
    parts, instances = PART.findall(text) or [text], INSTANCE.findall(text)
    if any(instances) or len(instances) not in (0, len(parts)):
        raise meshio.ReadError("its assembly moves, repeats or leaves out parts; write a mesh without parts")
    read = [read_part(part, path.with_name(f"part{k}.inp")) for k, part in enumerate(parts)]
    starts = np.cumsum([0, *(len(part.points) for part in read)])
    cells: list[Any] = [(b.type, b.data + start) for part, start in zip(read, starts, strict=False) for b in part.cells]
    return meshio.Mesh(np.concatenate([part.points for part in read]), cells)


def read_part(text: bytes, path: Path) -> meshio.Mesh:
    """The mesh of one part, which is written to `path` for meshio."""
    blocks = NODES.findall(text)
    numbers = [line.split(b",")[0].strip() for block in blocks for line in block.splitlines()]
    if len(set(numbers)) < len(numbers):
        raise meshio.ReadError("two of its nodes have the same number; write each part as a file")
    # meshio knows element types in capitals alone.
    elements = TYPE.sub(lambda found: found[0].upper(), NODES.sub(b"", text))
    path.write_bytes(b"*NODE\n" + b"".join(blocks) + elements)
    mesh = meshio.read(path)
    # A line that ends with a comma goes on in the next.
    stated = sum(len(re.findall(rb"[^,\s]\s*(?:\n|\Z)", block)) for block in ELEMENTS.findall(text))
    if sum(len(block) for block in mesh.cells) != stated:
        raise meshio.ReadError(f"it states {stated:,} elements, and meshio reads another number; save it as VTU")
    return mesh
