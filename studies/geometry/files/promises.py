"""How many cells a mesh file states, counted in its bytes and not by its reader: what is read has to be as many."""

import json
import re

import numpy as np

MARK = b"\xef\xbb\xbf"
"""Bytes with which some editors begin a text."""
HEADER, PER_TRIANGLE = 84, 50
"""Bytes of the header of a binary STL, and of each of its triangles."""
NUMBERS = {
    ".ply": rb"^element face (\d+)",
    ".off": rb"\A\s*(?:ST|C|N|4)*OFF\s+(?:#.*\n\s*)*\d+\s+(\d+)",
    ".vtk": rb"^CELLS (\d+)",
    ".mesh": rb"^\s*(?:Edges|Triangles|Quadrilaterals|Tetrahedra|Hexahedra|Prisms|Pyramids)(?:P\d)?\s+(\d+)",
    ".su2": rb"^(?:NELEM|MARKER_ELEMS)\s*=\s*(\d+)",
    ".vol": rb"^(?:surfaceelements\w*|volumeelements|edgesegments\w*)\s+(\d+)",
}
"""Patterns of the numbers of cells that follow."""
LINES = {
    ".obj": rb"^\s*f\s",
    ".bdf": rb"^\s*C(?:BAR|ROD|TRIA|QUAD|TETRA|HEXA|PENTA|PYRA)",
}
"""Patterns of the lines that are a cell each."""
LINES |= {".fem": LINES[".bdf"], ".nas": LINES[".bdf"]}
SAME = re.IGNORECASE | re.MULTILINE


def promised_cells(data: bytes, suffix: str) -> int:
    """Fewest cells that the file with these bytes holds; 0 if they are counted by its reader (VTU, VTP, INP). Raises
    any exception for a header that is damaged."""
    if suffix == ".stl":
        return len(re.findall(rb"^\s*facet\s+normal", data, SAME)) if is_ascii_stl(data) else stl_triangles(data)
    if suffix == ".msh":
        return msh_elements(data)
    if suffix in (".glb", ".gltf"):
        return gltf_triangles(data)
    if suffix in LINES:
        return len(re.findall(LINES[suffix], data, SAME))
    numbers = [int(number) for number in re.findall(NUMBERS.get(suffix, rb"(?!)()"), data, SAME)]
    # Version 5 of VTK states one more: the ends of the cells begin with 0.
    return sum(numbers) - (len(numbers) if suffix == ".vtk" and b"\nOFFSETS " in data else 0)


def cleaned(data: bytes, suffix: str) -> bytes:
    """The bytes without what readers stumble on: a mark at the beginning of a text, bytes behind a binary STL."""
    if suffix == ".stl" and not is_ascii_stl(data):
        return data[: HEADER + PER_TRIANGLE * stl_triangles(data)]
    return data.removeprefix(MARK)


def is_ascii_stl(data: bytes) -> bool:
    """Whether an STL that begins with these bytes is a text; a binary one may begin with "solid" as well."""
    head = data[:65_536].removeprefix(MARK).lstrip().lower()
    return head.startswith(b"solid") and (b"facet" in head or b"endsolid" in head) and b"\0" not in head


def stl_triangles(data: bytes) -> int:
    return int.from_bytes(data[HEADER - 4 : HEADER], "little")


def msh_elements(data: bytes) -> int:
    """The number of elements that an MSH file of gmsh states in its version 1, 2 or 4."""
    start = re.search(rb"\$(?:Elements|ELM)\s*?\n", data)
    if start is None:
        return 0
    version = re.search(rb"\$MeshFormat\s+(\d)\S*\s+(\d)", data)
    major, binary = (int(version[1]), version[2] == b"1") if version else (1, False)
    if major == 4 and binary:
        return int(np.frombuffer(data, "<u8", 2, start.end())[1])
    return int(data[start.end() : start.end() + 200].split()[major == 4])


def fluent_cells(data: bytes) -> int:
    """The number of cells and faces that a file of ANSYS Fluent states, which is in hexadecimal digits."""
    return sum(int(number, 16) for number in re.findall(rb"^\(1[23] \(0 \w+ (\w+)", data, re.MULTILINE))


def gltf_triangles(data: bytes) -> int:
    """The triangles of all nodes of a glTF file."""
    text = data
    if data.startswith(b"glTF"):
        text = data[20 : 20 + int.from_bytes(data[12:16], "little")]
    tree, total = json.loads(text), 0
    for node in tree.get("nodes", []):
        for part in tree["meshes"][node["mesh"]]["primitives"] if "mesh" in node else []:
            corners = tree["accessors"][part.get("indices", part["attributes"]["POSITION"])]["count"]
            total += {4: corners // 3, 5: corners - 2, 6: corners - 2}.get(part.get("mode", 4), 0)
    return total
