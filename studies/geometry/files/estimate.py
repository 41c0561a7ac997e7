"""The size of a mesh file, estimated before it is read."""

import re
from pathlib import Path

from studies.base.errors import StudyError

LARGE = 2_000_000
"""Number of triangles from which on the user is asked first: they take minutes and gigabytes of memory."""
BYTES = {".stl": 270.0, ".obj": 50.0, ".off": 45.0, ".ply": 45.0, ".vtk": 45.0, ".vtu": 35.0, ".msh": 55.0}
"""Bytes per triangle in a text file, including its share of the points."""
SECONDS, GIGABYTES = 30.0, 2.3
"""Time [s] and memory [GB] to weld, check and measure a million triangles on one core; valid from 200,000 on."""
HEADER = 84
PER_TRIANGLE = 50
HEAD = 4096


def triangle_count(path: Path) -> int:
    """Number of triangles in a file: from the header of a binary STL or a PLY file, else estimated from its size."""
    size = path.stat().st_size
    with open(path, "rb") as file:
        head = file.read(HEAD)
    if path.suffix.lower() == ".stl" and not is_ascii_stl(head):
        return int.from_bytes(head[80:84], "little") if size >= HEADER else 0
    declared = re.search(rb"element face (\d+)", head) if path.suffix.lower() == ".ply" else None
    return int(declared[1]) if declared else int(size / BYTES.get(path.suffix.lower(), 50.0))


def is_ascii_stl(head: bytes) -> bool:
    """Whether a file with this beginning is a text STL; a binary STL may begin with "solid" as well."""
    return head.lstrip().startswith(b"solid") and (b"facet" in head or b"endsolid" in head)


def is_text(head: bytes) -> bool:
    """Whether all bytes are printable ASCII characters or white space."""
    return all(byte >= ord(" ") or chr(byte).isspace() for byte in head) and max(head, default=0) < 0x80


def check_whole(path: Path) -> None:
    """Raise StudyError for a binary STL file that is shorter than its header says."""
    if path.suffix.lower() != ".stl":
        return
    size = path.stat().st_size
    with open(path, "rb") as file:
        head = file.read(HEAD)
    if is_ascii_stl(head) or size < HEADER or not head.strip():
        return
    count = int.from_bytes(head[80:84], "little")
    promised = HEADER + PER_TRIANGLE * count
    # A text that is no STL has letters in the place of the count.
    if size < promised and not is_text(head[:HEADER]):
        raise StudyError(
            f"{path.name} is cut short: its header promises {count:,} triangles in {promised:,} bytes, "
            f"but it has {size:,}; copy or export it again"
        )


def size_warning(path: Path) -> str | None:
    """A warning for the user before a file of LARGE triangles or more is read; None for a smaller file."""
    count = triangle_count(path)
    if count < LARGE:
        return None
    millions = count / 1e6
    return (
        f"{path.name} holds about {count:,} triangles ({path.stat().st_size / 1e6:,.0f} MB); to read and check it "
        f"takes about {max(1, round(SECONDS * millions / 60))} minutes and {GIGABYTES * millions:.0f} GB of memory"
    )
