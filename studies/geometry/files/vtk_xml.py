"""Converts XML files of VTK so that meshio can read them: VTP to VTU, and raw appended data to inline data.

meshio reads unstructured grids only, and confuses arrays that ParaView appends as raw bytes at the end of a file. File
formats: The VTK User's Guide, 11th edition, 2010, chapter 19.3.
"""

import base64
import re

import meshio
import numpy as np

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
    """Header and body of the array at byte `at` of the appended data `blob`.

    The header is the length of the array, or of a packed one the number and the lengths of its blocks, in numbers of
    the type `size`. Raises ReadError if the file ends before.
    """

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
