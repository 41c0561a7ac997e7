"""What is wrong with a file: checked before it is read, and said in place of the errors of the readers."""

import gzip
import lzma
import re
import zlib
from pathlib import Path
from xml.etree.ElementTree import ParseError

import h5py

from studies.base.errors import StudyError
from studies.geometry.files.promises import HEADER, PER_TRIANGLE, is_ascii_stl, stl_triangles

FORMATS = "STL, PLY, OBJ, OFF, glTF, VTK, VTU, VTP, MSH, MESH, INP, BDF, SU2, VOL, or a label mask in NIfTI or NRRD"
"""Formats that can be read, for messages."""
HEAD = 65_536
"""Bytes from the start of a file that are searched for a header."""
LARGE = 100_000_000
"""Bytes from which on the user is asked first: about two million triangles, which take minutes to check."""
OTHER_KINDS = {
    b"\x89PNG": "a PNG picture",
    b"\xff\xd8\xff": "a JPEG picture",
    b"%PDF": "a PDF document",
    b"PK\x03\x04": "a zip archive: unpack it first",
    b"<!DOCTYPE html": "a web page: the download has failed",
    b"<html": "a web page: the download has failed",
    b"version https://git-lfs": "a Git LFS pointer: the file itself was not downloaded",
}
"""First bytes of files that are no meshes."""
NO_STL = {
    b"ply": "a PLY file",
    b"OFF": "an OFF file",
    b"# vtk": "a VTK file",
    b"<?xml": "an XML file such as VTU or VTP",
    b"<VTKFile": "a VTU or VTP file",
    b"$MeshFormat": "an MSH file",
    b"glTF": "a glTF file",
}
"""First bytes of other mesh formats that occur in files called .stl."""
COMMA = rb"^\s*(?:vertex|facet normal)\b[^\n]*?[-+0-9],\d[^\n]*"
"""A line of a text STL with a decimal comma."""
PACKED = b"\x1f\x8b"
PROMISES = {
    ".ply": rb"element (vertex|face)\s+(\d+)",
    ".off": rb"^\s*(?:ST|C|N|4)*OFF\s+(?:#.*\n\s*)*()(\d+)",
    ".vtk": rb"\n(POINTS|CELLS|POLYGONS)\s+(\d+)",
    ".vtu": rb'NumberOf(Points|Cells)\s*=\s*"(\d+)"',
    ".vtp": rb'NumberOf(Points|Polys)\s*=\s*"(\d+)"',
    ".msh": rb"\$(Nodes|Elements)\s+(\d+)\s",
}
"""Patterns of headers: kind and number of the elements that follow."""
LEAST_BYTES = {".vtu": 1e-3, ".vtp": 1e-3}
"""Fewest bytes of an element, because zlib packs up to a thousand to one; 2 in the other formats."""
ENDS = {
    ".vtu": {b"<VTKFile": b"</VTKFile>"},
    ".vtp": {b"<VTKFile": b"</VTKFile>"},
    ".msh": {b"$MeshFormat": b"$EndElements", b"$NOD": b"$ENDELM"},
}
"""Text near the beginning of a file of a format, and near the end of a complete one."""


def size_warning(path: Path) -> str | None:
    """A warning for the user before a LARGE file is read; None for a smaller one."""
    size = path.stat().st_size
    return f"{path.name} has {size / 1e6:,.0f} MB; to read and check it can take minutes" if size >= LARGE else None


def check_promises(path: Path) -> None:
    """Raise StudyError for a file that is empty, packed by gzip, of another kind, or shorter than its header says."""
    size, suffix = path.stat().st_size, path.suffix.lower()
    if not size:
        raise unreadable(path, "it is empty")
    with open(path, "rb") as file:
        head = file.read(HEAD)
    first = head.lstrip().lower()
    for start, kind in OTHER_KINDS.items():
        if first.startswith(start.lower()):
            raise unreadable(path, f"it is {kind}")
    if h5py.is_hdf5(path):  # its signature may stand behind a block of another program
        raise unreadable(path, "it is an HDF5 file")
    if suffix == ".stl" and not is_ascii_stl(head):
        check_stl(path, head, size)
    if head.startswith(PACKED) and not path.name.lower().endswith((".nii.gz", ".nrrd.gz")):
        raise unreadable(path, "it is packed by gzip: unpack it first")
    for what, count in re.findall(PROMISES.get(suffix, rb"(?!)()()"), head):
        if int(count) * LEAST_BYTES.get(suffix, 2.0) > size:
            kind = str(what.decode()).lower()
            things = "points" if kind in ("", "vertex", "nodes") else kind
            raise unreadable(path, f"its header promises {int(count):,} {things}, but it has only {size:,} bytes")


def check_stl(path: Path, head: bytes, size: int) -> None:
    """Raise StudyError for a file called .stl that is another mesh or a text, or a binary STL that is too short."""
    kind = next((kind for first, kind in NO_STL.items() if head.startswith(first)), None)
    if kind is not None:
        raise unreadable(path, f"it is not an STL file but {kind}: give it the ending of its format")
    # A text that is no STL has letters in the place of the count.
    if all(byte >= ord(" ") or chr(byte).isspace() for byte in head[:HEADER]) and max(head[:HEADER]) < 0x80:
        if not head.lstrip().startswith(b"solid"):
            raise unreadable(path, "it is not an STL file: it is text without facets")
        return
    count = stl_triangles(head)
    promised = HEADER + PER_TRIANGLE * count
    more = size - promised
    if more >= PER_TRIANGLE and more % PER_TRIANGLE == 0:
        there = count + more // PER_TRIANGLE
        raise unreadable(path, f"its header states {count:,} triangles, and {there:,} seem to follow: export it again")
    if HEADER <= size < promised:
        raise StudyError(
            f"{path.name} is cut short: its header promises {count:,} triangles in {promised:,} bytes, "
            f"but it has {size:,}; copy or export it again"
        )


def unreadable(path: Path, reason: str) -> StudyError:
    return StudyError(f"{path.name} is not a mesh that can be read ({reason}); give {FORMATS}")


def reason_of(path: Path, error: BaseException, output: str) -> str:
    """Why a reader failed on a file: from the file, else from the `output` of the reader, else from its error."""
    if isinstance(error, PermissionError):
        return "it may not be read: change its permissions"
    with open(path, "rb") as file:
        head = file.read(HEAD)
    is_text_stl = path.suffix.lower() == ".stl" and is_ascii_stl(head)
    ends = {b"": b"endsolid"} if is_text_stl else ENDS.get(path.suffix.lower(), {})
    if any(start in head and end not in tail(path).replace(b"ENDSOLID", b"endsolid") for start, end in ends.items()):
        return "it is cut short: its end is missing"
    comma = comma_of(path.read_bytes()) if is_text_stl else ""
    said = sentence_in(output) or (sentence_in(str(error)) if "ReadError" in type(error).__name__ else "")
    return comma or said or next((words for kinds, words in WORDS if isinstance(error, kinds)), OTHERWISE)


OTHERWISE = "the readers of its format do not understand it"
WORDS: tuple[tuple[tuple[type[BaseException], ...], str], ...] = (
    ((MemoryError, OverflowError), "it declares more data than fits into memory"),
    ((UnicodeError,), "it contains binary data where text is expected"),
    ((ParseError,), "its XML is not well formed"),
    ((EOFError,), "it is cut short, or damaged"),
    ((zlib.error, gzip.BadGzipFile, lzma.LZMAError), "its packed data are damaged"),
    ((FileNotFoundError,), "a file that belongs to it is missing from its folder"),
)


def sentence_in(text: str) -> str:
    """The first line of the output of a reader that a user understands, up to 120 characters; "" if there is none."""
    for line in text.splitlines():
        line = " ".join(line.split()).removeprefix("Error: ").rstrip(".")
        if line and not re.search(r"Couldn't read|\w+Error\b|\w+Exception\b|Traceback|<class|0x[0-9a-f]{6}|/", line):
            return line[:120]
    return ""


def comma_of(data: bytes) -> str:
    """A sentence on the first line of a text STL with a decimal comma; "" if there is none."""
    first = re.search(COMMA, data, re.MULTILINE)
    if first is None:
        return ""
    line, text = data[: first.start()].count(b"\n") + 1, " ".join(first[0].decode("ascii", "replace").split())
    return f"line {line} has decimal commas, '{text[:60]}': export it with decimal points"


def tail(path: Path) -> bytes:
    """The last 64 MiB of a file; further data may follow the mesh."""
    with open(path, "rb") as file:
        file.seek(max(0, path.stat().st_size - (1 << 26)))
        return file.read()
