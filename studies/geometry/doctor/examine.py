"""The mesh doctor: what is wrong with a mesh, how much of it, and what mends it."""

import warnings
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from studies.geometry.doctor.findings import Finding, findings_of
from studies.geometry.doctor.measures import describe_surface, describe_tetrahedra, describe_welding, springs_see
from studies.geometry.files.reading import cells_of, parse, weld
from studies.geometry.files.units import UNITS, check_unit, likely_units
from studies.geometry.mesh.organ_mesh import OrganMesh, boundary_triangles

TISSUE = 1800.0, 1060.0
"""Shear modulus [Pa] and density [kg/m^3] for the time step when none are given: a liver's."""


@dataclass(frozen=True)
class Findings:
    """Everything the doctor saw."""

    name: str
    measures: dict[str, Any]
    """Numbers by name, SI units, JSON-able; docs/meshes.md has the list."""
    findings: tuple[Finding, ...]

    @property
    def clean(self) -> bool:
        """Whether nothing needs mending."""
        return not self.findings

    def to_dict(self) -> dict[str, Any]:
        """JSON-able form: {"name", "clean", "measures": {...}, "findings": [{"code", "count", "sentence", "mend"}]}."""
        rows = [vars(finding) for finding in self.findings]
        return {"name": self.name, "clean": self.clean, "measures": self.measures, "findings": rows}


def examine(
    source: str | Path | OrganMesh, *, unit: str | None = None, tissue: tuple[float, float] = TISSUE
) -> Findings:
    """What is to be known about a mesh file or an OrganMesh.

    unit: of the file, "m", "cm" or "mm"; None: the likely one is taken for the numbers, and that is a finding. tissue:
    shear modulus [Pa] and density [kg/m^3] for the time step. Raises StudyError for a file that holds no mesh.
    """
    if isinstance(source, OrganMesh):
        cells = source.tetrahedra if len(source.tetrahedra) else source.triangles
        return examine_cells(source.name, source.points, cells, {"unit": "m", "unit_said": True}, tissue)
    path = Path(source)
    raw = parse(path)
    points = np.asarray(raw.points, float)
    tetrahedra, triangles = cells_of(raw, path.name)
    if unit is not None:
        check_unit(unit)
    used = {"unit": unit or guessed_unit(points), "unit_said": unit is not None or only_metres(points)}
    cells = tetrahedra if len(tetrahedra) else triangles
    # An STL file repeats the corners of every triangle: nothing to report.
    found = describe_welding(points, cells, repeats=path.suffix.lower() == ".stl")
    points, cells = (points, cells) if found["bad_points"] else weld(points, cells)
    return examine_cells(path.name, points * UNITS[used["unit"]], cells, used | found, tissue)


def guessed_unit(points: np.ndarray) -> str:
    """The smallest unit that makes an organ of the points, for showing numbers only."""
    return (likely_units(longest_side(points)) or ["m"])[-1]


def only_metres(points: np.ndarray) -> bool:
    """Whether the file is an organ in metres and in nothing else."""
    return likely_units(longest_side(points)) == ["m"]


def longest_side(points: np.ndarray) -> float:
    """Longest side of the bounding box of the finite points."""
    finite = points[np.isfinite(points).all(axis=1)]
    return float(np.ptp(finite, axis=0).max()) if len(finite) else 0.0


def examine_cells(
    name: str, points: np.ndarray, cells: np.ndarray, known: dict[str, Any], tissue: tuple[float, float]
) -> Findings:
    """Findings about points (n, 3) [m] and triangles (t, 3) or tetrahedra (k, 4); `known` is put in front."""
    solid = cells.shape[1] == 4
    measures: dict[str, Any] = {"kind": "tetrahedra" if solid else "surface", **known}
    measures = {"bad_points": int((~np.isfinite(points).all(axis=1)).sum())} | measures
    if not measures["bad_points"]:
        triangles = boundary_triangles(cells) if solid else cells
        measures |= describe_surface(points, triangles)
        if solid:
            measures |= describe_tetrahedra(points, cells)
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            measures["springs"] = springs_see(points, triangles, cells if solid else None, measures, tissue)
    return Findings(name, measures, findings_of(measures))
