"""Files that other files name: a stranger's file names its neighbours, and nothing else."""

from pathlib import Path

from studies.base.errors import StudyError


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
