"""Files of VTK that meshio does not read: legacy surfaces, VTP, and raw appended data of VTU.

Legacy surfaces are read here; XML files are converted to a VTU that meshio reads, which knows unstructured grids only
and confuses arrays that ParaView appends as raw bytes at the end of a file. VTK itself would read all of them, but it
crashes on some damaged files, and the whole command with it. File formats: The VTK User's Guide, 11th edition, 2010,
chapter 19.
"""

import base64
import re
from pathlib import Path

import meshio
import numpy as np

from studies.geometry.files.content import fans

TYPES = {
    b"float": ">f4",
    b"double": ">f8",
    b"int": ">i4",
    b"long": ">i8",
    b"short": ">i2",
    b"vtktypeint64": ">i8",
    b"vtkidtype": ">i8",
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


def read_legacy(path: Path) -> tuple[np.ndarray, Triangles]:
    """Points (n, 3) and triangles (t, 3) of a legacy file; polygons and strips are cut into triangles. Raises ReadError
    for a file that is cut short or has numbers of an unknown type."""
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
    return points, np.concatenate(triangles)


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


POLYGON = 7
"""Number of this kind of cell in VTK."""
RAW = re.compile(rb'<AppendedData[^>]*encoding\s*=\s*"raw"[^>]*>\s*_')
ARRAY = re.compile(rb'<DataArray\b([^>]*?offset\s*=\s*"(\d+)"[^>]*?)(?:/>|>.*?</DataArray>)', re.DOTALL)


def as_grid(data: bytes) -> bytes:
    """The bytes of a VTP file as those of a VTU file. Raises ReadError for triangle strips."""
    data = re.sub(rb"<Piece\b.*?</Piece>", lambda match: as_cells(match[0]), with_arrays(data), flags=re.DOTALL)
    return data.replace(b"PolyData", b"UnstructuredGrid")


def as_cells(piece: bytes) -> bytes:
    """A piece of a VTP file with its polygons as cells. Raises ReadError for triangle strips."""
    for kind in (b"Strips", b"Verts", b"Lines"):
        counts = re.findall(rb'NumberOf%s\s*=\s*"(\d+)"' % kind, piece)
        if kind == b"Strips" and any(int(count) for count in counts):
            raise meshio.ReadError("it holds triangle strips; triangulate the surface")
        piece = re.sub(rb"<%s>.*?</%s>|<%s\s*/>" % (kind, kind, kind), b"", piece, flags=re.DOTALL)
        piece = re.sub(rb'\s*NumberOf%s\s*=\s*"\d+"' % kind, b"", piece)
    count = re.search(rb'NumberOfPolys\s*=\s*"(\d+)"', piece)
    types = f"{POLYGON} " * int(count[1] if count else 0)
    types_array = f'<DataArray type="UInt8" Name="types" format="ascii">{types}</DataArray>'.encode()
    piece = piece.replace(b"<Polys>", b"<Cells>").replace(b"</Polys>", types_array + b"</Cells>")
    return piece.replace(b"NumberOfPolys", b"NumberOfCells")


def with_arrays(data: bytes) -> bytes:
    """The file with its raw appended arrays inline in base64; unchanged if it has none. Raises ReadError if it is cut
    short."""
    raw = RAW.search(data)
    if raw is None:
        return data
    text, blob = data[: raw.start()], data[raw.end() :]
    order = ">" if b'byte_order="BigEndian"' in text else "<"
    size = np.dtype(order + ("u8" if b'header_type="UInt64"' in text else "u4"))
    packed = b"compressor=" in text

    def inline(match: re.Match[bytes]) -> bytes:
        head, body = block(blob, int(match[2]), size, packed)
        content = base64.b64encode(head) + base64.b64encode(body) if packed else base64.b64encode(head + body)
        attributes = re.sub(rb'offset\s*=\s*"\d+"', b"", match[1]).replace(b'"appended"', b'"binary"')
        return b"<DataArray" + attributes + b">" + content + b"</DataArray>"

    return ARRAY.sub(inline, text) + b"</VTKFile>\n"


def block(blob: bytes, at: int, size: np.dtype, packed: bool) -> tuple[bytes, bytes]:
    """Header and body of the array at byte `at` of the appended data `blob`. The header is the length of the array, or
    of a packed one the number and the lengths of its blocks, as numbers of the type `size`. Raises ReadError if the
    file ends before."""

    def number(k: int) -> int:
        values = blob[at + k * size.itemsize : at + (k + 1) * size.itemsize]
        if len(values) < size.itemsize:
            raise meshio.ReadError("it is cut short: arrays are missing at its end")
        return int(np.frombuffer(values, size)[0])

    count = number(0)
    words = 3 + count if packed else 1
    length = sum(number(3 + k) for k in range(count)) if packed else count
    start = at + words * size.itemsize
    if len(blob) < start + length:
        raise meshio.ReadError("it is cut short: arrays are missing at its end")
    return blob[at:start], blob[start : start + length]
