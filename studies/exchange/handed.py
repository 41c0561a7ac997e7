"""Reads the results of another program from its files, without interpretation."""

import re
import xml.etree.ElementTree as ElementTree
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path
from typing import Any
from zipfile import ZipFile, is_zipfile

import numpy as np
import pandas as pd

from studies.base.errors import StudyError
from studies.base.hdf5 import reading
from studies.base.within import check_unpacked, file_within
from studies.geometry.files.writing import SUFFIX, read_points

DISPLACEMENT = "displacement"
"""Point data with displacements, for a grid whose points are those at rest."""
OPTIONAL = ("force", "pressure", "lumen_pressure")
"""Histories that an npz file may hold besides the positions, one number for each step."""


@dataclass(frozen=True, eq=False)
class Handed:
    """Steps of a body, as in its file."""

    name: str
    """Name of the file."""
    t: np.ndarray | None
    """[s], (F,); None where the file has no times."""
    positions: np.ndarray
    """[m], (F, n, 3)."""
    histories: dict[str, np.ndarray]
    """Histories of OPTIONAL that are present, (F,) each."""


def read_handed(path: Path) -> Handed:
    """The steps in a file (npz, CSV, VTKHDF, PVD), in a folder of VTU files, or in those that a pattern names.

    Raises StudyError for a file of another kind, and for one that cannot be read or lacks something.
    """
    if path.is_dir() or "*" in path.name:
        return _read_series(path)
    if not path.is_file():
        raise StudyError(f"there is no file {path}")
    if path.suffix.lower() not in READERS:
        raise StudyError(f"{path.name}: entries are read from {', '.join(READERS)} or a folder of {SUFFIX} files")
    try:
        return READERS[path.suffix.lower()](path)
    except StudyError:
        raise
    except Exception as error:  # readers of damaged files, or of files of another kind, raise any exception
        reason = (str(error).splitlines() or [type(error).__name__])[0]
        raise StudyError(
            f"{path.name} cannot be read ({reason}); README.md of the scene describes what it must contain"
        ) from error


def read_force(path: Path) -> tuple[np.ndarray, np.ndarray]:
    """Times [s] and forces [N] of a CSV file with the columns t and force, (q,) each. Raises StudyError."""
    table = _table(path, ("t", "force"))
    return table["t"].to_numpy(np.float64), table["force"].to_numpy(np.float64)


def _table(path: Path, columns: Sequence[str]) -> pd.DataFrame:
    if not path.is_file():
        raise StudyError(f"there is no file {path}")
    try:
        _check_separators(path)
        table = pd.read_csv(path, dtype=str, skipinitialspace=True)  # as floats some would lose their last bit
        missing = [name for name in columns if name not in table.columns]
        if missing:
            raise StudyError(f"{path.name} lacks the column {missing[0]!r}; it needs {', '.join(columns)}")
        return pd.DataFrame({name: table[name].to_numpy(object).astype(np.float64) for name in columns})
    except StudyError:
        raise
    except (ValueError, OSError) as error:
        raise StudyError(f"{path.name} cannot be read as a table ({str(error).splitlines()[0]})") from error


def _check_separators(path: Path) -> None:
    """Raises StudyError for a table with semicolons between its columns, and for one with commas in its numbers."""
    with open(path, encoding="utf-8", newline="") as file:
        head, first = (next(file, "") for _ in range(2))
    semicolons = ";" in head
    commas = re.search(r"\d,\d", first) if semicolons else first.count(",") > head.count(",")
    faults = ["semicolons between its columns"] * semicolons + ["commas in its numbers"] * bool(commas)
    if faults:
        raise StudyError(f"{path.name} has {' and '.join(faults)}: write commas between columns and points in numbers")


def _read_npz(path: Path) -> Handed:
    if not is_zipfile(path):
        raise StudyError(f"{path.name} is no npz file, or was cut off; numpy.savez writes one")
    with ZipFile(path) as packed:
        check_unpacked(sum(one.file_size for one in packed.infolist()), path.name, "hand in the checkpoints alone")
    with np.load(path, allow_pickle=False) as file:
        missing = [name for name in ("t", "positions") if name not in file]
        if missing:
            raise StudyError(
                f"{path.name} lacks {missing[0]!r}; it needs t (F) and positions (F, n, 3), and holds "
                f"{', '.join(file.files) or 'nothing'}"
            )
        stored = {name: file[name] for name in ("t", "positions", *OPTIONAL) if name in file}
    odd = [name for name, values in stored.items() if np.iscomplexobj(values)]
    if odd:
        raise StudyError(f"{path.name}: {odd[0]} holds complex numbers; hand in real ones")
    arrays = {name: np.asarray(values, np.float64) for name, values in stored.items()}
    return Handed(path.name, arrays.pop("t"), arrays.pop("positions"), arrays)


def _read_csv(path: Path) -> Handed:
    table = _table(path, ("t", "node", "x", "y", "z")).sort_values(["t", "node"], kind="stable")
    if table.empty:
        raise StudyError(f"{path.name} holds no rows; it needs one for each node and step")
    double = table[table.duplicated(["t", "node"])]
    if len(double):
        t, node = double.iloc[0][["t", "node"]]
        raise StudyError(f"{path.name}: node {node:g} has several rows at t = {t:g} s; give one")
    t, counts = np.unique(table["t"], return_counts=True)
    nodes = table["node"].to_numpy()
    usual = max(counts, key=lambda count: (int((counts == count).sum()), count))
    if (counts != usual).any():
        odd = int(np.argmax(counts != usual))
        raise StudyError(f"{path.name}: step t = {t[odd]:g} s has {counts[odd]} nodes, others have {usual}")
    if not np.array_equal(nodes, np.tile(np.arange(counts[0]), len(t))):
        raise StudyError(f"{path.name}: nodes are numbered {nodes.min():g} to {nodes.max():g}; number them from 0 on")
    positions = table[["x", "y", "z"]].to_numpy(np.float64).reshape(len(t), counts[0], 3)
    return Handed(path.name, t, positions, {})


def _read_vtkhdf(path: Path) -> Handed:
    with reading(path) as file:
        root: Any = file["VTKHDF"]
        steps = root.get("Steps")
        if steps is None:
            raise StudyError(f"{path.name} has no steps; write them all into one file, or as VTU files")
        t, count = np.asarray(steps["Values"], np.float64), np.asarray(root["NumberOfPoints"], np.int64)
        if "NumberOfParts" in steps and (np.asarray(steps["NumberOfParts"]) != 1).any():
            raise StudyError(f"{path.name} has its grid in several parts; write it as one")
        part = np.asarray(steps["PartOffsets"] if "PartOffsets" in steps else np.zeros(len(t)), np.int64)
        sizes = count[part]
        begins = np.asarray(steps["PointOffsets"], np.int64)
        data = root.get(f"PointData/{DISPLACEMENT}")
        points = [root["Points"][b : b + n].astype(np.float64) for b, n in zip(begins, sizes, strict=True)]
        fields: list[np.ndarray | None] = [None] * len(t)
        if data is not None and f"PointDataOffsets/{DISPLACEMENT}" in steps:
            begins = np.asarray(steps[f"PointDataOffsets/{DISPLACEMENT}"], np.int64)
            fields = [data[b : b + n] for b, n in zip(begins, sizes, strict=True)]
    return Handed(path.name, t, _stacked(path.name, points, fields), {})


def _read_pvd(path: Path) -> Handed:
    sets = ElementTree.parse(path).getroot().iter("DataSet")
    rows = sorted((float(entry.attrib["timestep"]), entry.attrib["file"]) for entry in sets)
    if not rows:
        raise StudyError(f"{path.name} names no files")
    positions = _of_grids(path.name, [file_within(path.parent, name, path.name) for _, name in rows])
    return Handed(path.name, np.array([t for t, _ in rows]), positions, {})


def _read_series(path: Path) -> Handed:
    folder, pattern = (path, f"*{SUFFIX}") if path.is_dir() else (path.parent, path.name)
    files = sorted(folder.glob(pattern))
    if not files:
        raise StudyError(f"{folder} holds no file {pattern}")
    for one, other in pairwise(files):
        if _numbers(one) > _numbers(other):
            raise StudyError(
                f"{folder.name}: is {other.name} before or after {one.name}? Write their numbers with as many digits, "
                "0002 and 0010, or hand in a PVD file, which has the times"
            )
    return Handed(path.name, None, _of_grids(path.name, files), {})


def _numbers(path: Path) -> list[str | float]:
    """The words and whole numbers of which a name consists, alternately."""
    return [float(part) if part.isdecimal() else part for part in re.split(r"(\d+)", path.stem)]


def _of_grids(name: str, files: Sequence[Path]) -> np.ndarray:
    grids = [read_points(file) for file in files]
    return _stacked(name, [points for points, _ in grids], [data.get(DISPLACEMENT) for _, data in grids])


def _stacked(name: str, points: Sequence[np.ndarray], moved: Sequence[np.ndarray | None]) -> np.ndarray:
    """Positions of all steps: the points, or if these are constant, points plus displacements."""
    if len({rows.shape for rows in points}) > 1:
        raise StudyError(f"{name}: the number of nodes changes from step to step; hand in one mesh that moves")
    still = all(np.array_equal(rows, points[0]) for rows in points)
    fields = [row for row in moved if row is not None]
    if not still or not fields:
        return np.stack(points)
    if len(fields) != len(points) or any(np.shape(row) != points[0].shape for row in fields):
        raise StudyError(f"{name}: '{DISPLACEMENT}' must be in every step, with three numbers for each node")
    return np.stack([rows + row for rows, row in zip(points, fields, strict=True)])


READERS: dict[str, Callable[[Path], Handed]] = {
    ".npz": _read_npz,
    ".csv": _read_csv,
    ".vtkhdf": _read_vtkhdf,
    ".hdf": _read_vtkhdf,
    ".pvd": _read_pvd,
}
"""Reader by suffix."""
