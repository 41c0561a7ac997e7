"""Whether the files of a results folder can be read by this version."""

import shlex
from collections.abc import Collection, Iterator
from pathlib import Path

from studies.base.errors import OtherVersion, StudyError
from studies.store.paths import index_path
from studies.store.record import SCHEMA, peek
from studies.tools.doctor.finding import Finding, fault, note, ok
from studies.tools.doctor.machine import cannot_write


def results_folder(root: Path, studies: Collection[str]) -> list[Finding]:
    """The state of the files below `root`; studies: the names that `organbench run` accepts."""
    if not root.exists():
        return [note(f"no results yet: there is no folder {root}", "organbench run")]
    if not root.is_dir():
        return [fault(f"{root} is not a folder, so results cannot be stored there", "unset ORGANBENCH_RESULTS")]
    problem = cannot_write(root)
    if problem is not None:
        line = f"chmod u+rwx {shlex.quote(str(root))}"
        return [fault(f"nothing can be stored in {root} ({problem}), so charts are not redrawn", line)]
    return list(_files(root, studies))


def _files(root: Path, studies: Collection[str]) -> Iterator[Finding]:
    good, others, bad = 0, dict[Path, str](), dict[Path, str]()
    for path in sorted(root.glob("*/*.h5")):
        if path == index_path(root, path.parent.name):
            continue
        try:
            peek(path)
            good += 1
        except OtherVersion as error:
            others[path] = str(error)
        except StudyError as error:
            bad[path] = str(error)
    yield ok(f"{good} results files of schema {SCHEMA} in {root}")
    if others:
        yield note(
            f"{len(others)} files of another version: {next(iter(others.values()))}", _again(root, others, studies)
        )
    if bad:
        yield fault(f"{len(bad)} files that cannot be read: {next(iter(bad.values()))}", _again(root, bad, studies))


def _again(root: Path, files: Collection[Path], studies: Collection[str]) -> str:
    """The line that replaces files: by running their studies, or by removing what no study of the catalogue wrote."""
    names = sorted({file.parent.name for file in files})
    runnable = [name for name in names if name in studies]
    lines = [f"rm {shlex.quote(str(file))}" for file in files if file.parent.name not in studies]
    if runnable:
        lines.append(f"organbench run {' '.join(runnable)} --only stale --results {shlex.quote(str(root))}")
    return " && ".join(lines)
