"""Files of VTK that meshio does not read whole: legacy surfaces, and XML.

meshio reads no VTP, of a VTU the cells of the last piece alone, and confuses arrays that ParaView appends as raw bytes
at the end of a file. VTK itself would read all of them, but it crashes on some damaged files, and the whole command
with it. File formats: The VTK User's Guide, 11th edition, 2010, chapter 19.
"""

import base64
import lzma
import re
import zlib
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import meshio
import numpy as np

from studies.geometry.files.content import coincident, fans

TYPES = {
    b"float": ">f4",
    b"double": ">f8",
    b"int": ">i4",
    b"long": ">i8",
    b"short": ">i2",
    b"vtktypeint64": ">i8",
    b"vtkidtype": ">i4",
    b"unsigned_int": ">u4",
    b"unsigned_long": ">u8",
}
"""Number types of legacy files; binary files are big-endian."""
CELLS = (b"VERTICES", b"LINES", b"POLYGONS", b"TRIANGLE_STRIPS")
Triangles = np.ndarray
"""Shape (t, 3)."""


def is_legacy_polydata(path: Path) -> bool:
    """Whether a .vtk file contains a surface and not a grid."""
    with open(path, "rb") as file:
        head = file.read(1024)
    return head.startswith(b"# vtk") and re.search(rb"\nDATASET\s+POLYDATA", head, re.IGNORECASE) is not None


class Legacy:
    """Reads the lines and numbers of a legacy file one after the other."""

    def __init__(self, data: bytes):
        """data: the bytes of the whole file."""
        self.data, self.at = data, 0
        self.line()  # version
        self.line()  # title
        self.binary = self.line().strip().upper() == b"BINARY"

    def line(self) -> bytes:
        """The next line, without its end."""
        end = self.data.find(b"\n", self.at)
        end = len(self.data) if end < 0 else end
        line, self.at = self.data[self.at : end], end + 1
        return line

    def words(self) -> list[bytes]:
        """Words of the next line that is not empty; [] at the end of the file."""
        while self.at < len(self.data):
            words = self.line().split()
            if words:
                return words
        return []

    def numbers(self, count: int, kind: bytes) -> np.ndarray:
        """The next `count` numbers of a type of TYPES. Raises ReadError if there are fewer, or for another type."""
        if kind.lower() not in TYPES:
            raise meshio.ReadError(f"numbers of type {kind.decode(errors='replace')} are not known")
        dtype = np.dtype(TYPES[kind.lower()])
        size = count * (dtype.itemsize if self.binary else 2)
        if size > len(self.data) - self.at + 1:
            raise meshio.ReadError(f"it is cut short: {count:,} of the declared numbers are missing")
        if self.binary:
            values = np.frombuffer(self.data, dtype, count, self.at)
            self.at += size
            return values.astype(dtype.newbyteorder("="))
        return self._text_numbers(count, dtype.newbyteorder("="))

    def _text_numbers(self, count: int, dtype: np.dtype) -> np.ndarray:
        tokens: list[bytes] = []
        while len(tokens) < count:
            words = self.words()
            if not words:
                raise meshio.ReadError(f"it is cut short: {count:,} of the declared numbers are missing")
            tokens += words
        return np.array(tokens[:count], dtype=float).astype(dtype)


def read_legacy(path: Path) -> meshio.Mesh:
    """The surface of a legacy file; polygons and strips are cut into triangles. Raises ReadError for a file that is cut
    short or has numbers of an unknown type."""
    text = Legacy(path.read_bytes())
    points, triangles = np.empty((0, 3)), [np.empty((0, 3), np.int64)]
    while words := text.words():
        key = words[0].upper()
        if key in (b"POINT_DATA", b"CELL_DATA"):
            break
        if key == b"POINTS":
            points = text.numbers(3 * int(words[1]), words[2]).reshape(-1, 3).astype(float)
        elif key in CELLS:
            sizes, corners = cells(text, int(words[1]), int(words[2]))
            if key in CELLS[2:]:
                triangles.append(cut(sizes, corners, strips=key == CELLS[3]))
    return meshio.Mesh(points, [("triangle", np.concatenate(triangles))])


def cells(text: Legacy, first: int, second: int) -> tuple[np.ndarray, np.ndarray]:
    """Number of corners of each of the `first` cells, and the corners of all cells in turn: in the old form, with
    counts among the corners, and that of version 5.1, with OFFSETS and CONNECTIVITY."""
    start = text.at
    words = text.words()
    if words and words[0].upper() == b"OFFSETS":
        offsets = text.numbers(first, words[1])
        corners = text.numbers(second, text.words()[1])
        return np.diff(offsets).astype(np.int64), corners.astype(np.int64)
    text.at = start
    table = text.numbers(second, b"int").astype(np.int64)
    if first and second % first == 0 and (table.reshape(first, -1)[:, 0] == second // first - 1).all():
        rows = table.reshape(first, -1)  # all cells have the same number of corners
        return rows[:, 0], rows[:, 1:].ravel()
    sizes, corners, at = [], [], 0
    for _ in range(first):
        sizes.append(int(table[at]))
        corners.append(table[at + 1 : at + 1 + sizes[-1]])
        at += 1 + sizes[-1]
    return np.array(sizes, np.int64), np.concatenate([np.empty(0, np.int64), *corners])


def cut(sizes: np.ndarray, corners: np.ndarray, strips: bool) -> Triangles:
    """Triangles (t, 3) of polygons or strips with `sizes` corners each; every second triangle of a strip is flipped."""
    starts, triangles = np.cumsum(sizes) - sizes, [np.empty((0, 3), np.int64)]
    for size in np.unique(sizes[sizes > 2]):
        rows = corners[starts[sizes == size][:, None] + np.arange(size)]
        if not strips:
            triangles.append(fans(rows))
            continue
        turned = ([k, k + 1, k + 2] if k % 2 == 0 else [k + 1, k, k + 2] for k in range(int(size) - 2))
        triangles.extend(rows[:, corner] for corner in turned)
    return np.concatenate(triangles)


RAW = re.compile(rb'<AppendedData[^>]*encoding\s*=\s*"raw"[^>]*>\s*_')
UNPACK = {"": bytes, "vtkZLibDataCompressor": zlib.decompress, "vtkLZMADataCompressor": lzma.decompress}
KINDS = {1: "vertex", 2: "vertex", 3: "line", 4: "line", 5: "triangle", 7: "polygon", 9: "quad", 10: "tetra"}
KINDS |= {12: "hexahedron", 13: "wedge", 14: "pyramid", 21: "line", 22: "triangle6", 23: "quad8", 24: "tetra10"}
KINDS |= {25: "hexahedron20", 26: "wedge15", 27: "pyramid13", 28: "quad9", 29: "hexahedron27", 34: "triangle7"}
"""Number of a kind of cell in VTK -> its name in meshio."""
GHOST = "vtkGhostType"
"""Cell data above 0 at cells that another piece owns."""


def read_xml(path: Path) -> meshio.Mesh:
    """All pieces of a VTU or VTP file. Raises ReadError for arrays that are missing, cut short, or packed by a library
    that Python lacks, and for kinds of cells that are not known."""
    data = path.read_bytes()
    raw = RAW.search(data)
    text = data if raw is None else data[: raw.start()] + b"</VTKFile>"
    root = ElementTree.fromstring(text)
    arrays = Arrays(root, b"" if raw is None else data[raw.end() :])
    points, point_data, cells, before = [np.empty((0, 3))], list[dict[str, np.ndarray]](), list[Any](), 0
    for piece in root.iter("Piece"):
        points.append(arrays.in_(piece, "Points", None).reshape(-1, 3).astype(float))
        if len(points[-1]) != int(piece.get("NumberOfPoints", 0)):
            raise meshio.ReadError("the points of a piece are not as many as it states")
        names = [array.get("Name", "") for array in piece.iterfind("PointData/DataArray")]
        point_data.append({name: arrays.in_(piece, "PointData", name) for name in names})
        cells += [(kind, rows + before) for kind, rows in piece_cells(arrays, piece)]
        before += len(points[-1])
    shared = set.intersection(*map(set, point_data)) if point_data else set()
    places = np.concatenate(points)
    # Pieces repeat the points along which they meet.
    first = coincident(places) if len(point_data) > 1 else np.arange(before)
    kept, joined = np.unique(first, return_inverse=True)
    fields: dict[str, Any] = {name: np.concatenate([data[name] for data in point_data])[kept] for name in shared}
    return meshio.Mesh(places[kept], [(kind, joined[rows]) for kind, rows in cells], fields)


def piece_cells(arrays: "Arrays", piece: ElementTree.Element) -> list[tuple[str, np.ndarray]]:
    """Kind and corners of the cells of a piece, without those that another piece owns."""
    found = list[tuple[str, np.ndarray]]()
    for group, number in (("Cells", None), ("Polys", 7), ("Strips", 6)):
        count = int(piece.get(f"NumberOf{group}", 0))
        if not count:
            continue
        ends = arrays.in_(piece, group, "offsets").astype(np.int64)
        corners = arrays.in_(piece, group, "connectivity").astype(np.int64)
        kinds = np.full(count, number) if number else arrays.in_(piece, group, "types").astype(int)
        if len(ends) != count or len(kinds) != count or ends[-1] != len(corners):
            raise meshio.ReadError("the cells of a piece are not as many as it states")
        sizes = np.diff(ends, prepend=0)
        ghosts = piece.find(f"CellData/DataArray[@Name='{GHOST}']")
        own = np.ones(count, bool) if ghosts is None else arrays.numbers(ghosts)[:count] == 0
        for kind, size in np.unique(np.stack([kinds[own], sizes[own]]), axis=1).T:
            chosen = own & (kinds == kind) & (sizes == size)
            rows = corners[(ends - sizes)[chosen][:, None] + np.arange(size)]
            if kind == 6:
                found.append(("triangle", cut(np.full(len(rows), size), rows.ravel(), strips=True)))
            elif int(kind) in KINDS:
                found.append((KINDS[int(kind)], rows))
            else:
                raise meshio.ReadError(f"cells of VTK's kind {kind} are not known; convert to tetrahedra")
    return found


class Arrays:
    """Reads the arrays of a VTK file in XML."""

    def __init__(self, root: ElementTree.Element, raw: bytes):
        """raw: the bytes of AppendedData of encoding "raw" behind their underscore."""
        self.raw, self.packing = raw, root.get("compressor", "")
        self.order = ">" if root.get("byte_order") == "BigEndian" else "<"
        self.size = np.dtype(self.order + ("u8" if root.get("header_type") == "UInt64" else "u4"))
        appended = root.find("AppendedData")
        self.coded = b"" if appended is None else (appended.text or "").strip().removeprefix("_").encode()
        if self.packing not in UNPACK:
            raise meshio.ReadError(f"its arrays are packed by {self.packing}; save it with ZLib or without compression")

    def in_(self, piece: ElementTree.Element, group: str, name: str | None) -> np.ndarray:
        """The array of a group of a piece by its name (None: the only one)."""
        array = piece.find(f"{group}/DataArray" + (f"[@Name='{name}']" if name else ""))
        if array is None:
            raise meshio.ReadError(f"the array {name or ''} of {group} is missing")
        return self.numbers(array)

    def numbers(self, array: ElementTree.Element) -> np.ndarray:
        kind, form = array.get("type", ""), array.get("format")
        dtype = np.dtype(kind.lower()) if re.fullmatch(r"U?Int(8|16|32|64)|Float(32|64)", kind) else None
        if dtype is None:
            raise meshio.ReadError(f"numbers of type {kind} are not known")
        if form == "ascii":
            return np.array((array.text or "").split(), float if dtype.kind == "f" else int).astype(dtype)
        inline = "".join((array.text or "").split()).encode()
        stored = inline if form != "appended" else (self.raw or self.coded)[int(array.get("offset", 0)) :]
        content = self.content(stored, coded=form != "appended" or not self.raw)
        return np.frombuffer(content, np.dtype(self.order + dtype.str[1:])).astype(dtype)

    def content(self, stored: bytes, coded: bool) -> bytes:
        """The bytes of the array at the beginning of `stored`, which is base64 if `coded`: behind their number, or
        packed in blocks behind the number, two sizes and the packed sizes of the blocks."""
        width = self.size.itemsize

        def head(words: int) -> np.ndarray:
            return np.frombuffer(taken(stored, words * width, coded), self.size)

        count = int(head(1)[0])
        if not self.packing:
            start = length_of(width, coded)
            if coded and b"=" not in stored[:start]:  # header and data are coded as one
                return taken(stored, width + count, coded)[width:]
            return taken(stored[start:], count, coded)
        sizes = head(3 + count)[3:].astype(int)
        blocks = taken(stored[length_of((3 + count) * width, coded) :], int(sizes.sum()), coded)
        ends = np.cumsum(sizes)
        return b"".join(UNPACK[self.packing](blocks[end - size : end]) for size, end in zip(sizes, ends, strict=True))


def length_of(count: int, coded: bool) -> int:
    """Number of bytes in which `count` bytes are stored."""
    return -(-count // 3) * 4 if coded else count


def taken(stored: bytes, count: int, coded: bool) -> bytes:
    """The first `count` bytes. Raises ReadError if there are fewer."""
    part = stored[: length_of(count, coded)]
    content = (base64.b64decode(part) if coded else part)[:count]
    if len(content) < count:
        raise meshio.ReadError("it is cut short: numbers of an array are missing")
    return content
