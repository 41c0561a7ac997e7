"""What a stranger's file may name and promise: its neighbours, and no more bytes than a machine can hold."""

from pathlib import Path

from studies.base.errors import StudyError

MOST_BYTES = 2e9
"""That a packed file may unpack to: a mask of 512 × 512 × 1,900 voxels of four bytes each."""


def check_unpacked(size: float, by: str, way_out: str) -> None:
    """Raises StudyError for a packed file `by` whose head says that it unpacks to more than MOST_BYTES."""
    if size > MOST_BYTES:
        raise StudyError(
            f"{by} holds {1e-9 * size:.3g} GB unpacked; at most {1e-9 * MOST_BYTES:g} GB are read: {way_out}"
        )


def file_within(folder: Path, name: str, by: str) -> Path:
    """The regular file `name` in `folder`, or below. by: the file that names it.

    Raises StudyError for an absolute name, one that leads outside, also through a link, and for what is no regular
    file: a pipe would be read for ever.
    """
    file = Path(folder, name).resolve()
    if Path(name).is_absolute() or not file.is_relative_to(folder.resolve()) or not file.is_file():
        raise StudyError(
            f"{by}: its data file {name!r} is no file in the folder of {by}; put it there, and give its name alone"
        )
    return file
