"""Surfaces in the legacy format of VTK, DATASET POLYDATA, which meshio does not read.

File formats: The VTK User's Guide, 11th edition, 2010, chapter 19.
"""

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
    """Points (n, 3) and triangles (t, 3) of a legacy file; polygons and strips are cut into triangles.

    Raises ReadError for a file that is cut short or has numbers of an unknown type.
    """
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
    """Number of corners of each cell, and the corners of all cells in turn.

    first, second: the two numbers in the line of the cells. Reads the old form, with counts among the corners, and that
    of version 5.1, with OFFSETS and CONNECTIVITY.
    """
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
