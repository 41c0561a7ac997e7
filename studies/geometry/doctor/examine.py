"""The mesh doctor: what is wrong with a mesh, how much of it, and what fixes it."""

import warnings
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from studies.geometry.doctor.findings import Finding, findings_of
from studies.geometry.doctor.measures import describe_surface, describe_tetrahedra, describe_welding, springs_see
from studies.geometry.files.content import Content
from studies.geometry.files.opening import opened
from studies.geometry.files.parts import Part, parts_in
from studies.geometry.files.reading import weld
from studies.geometry.files.units import UNITS, Source, as_source, check_range, likely_units
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
    command: str | None = None
    """That was tried and repairs everything (studies.geometry.api.advice); None where none was found."""

    @property
    def clean(self) -> bool:
        """Whether nothing needs mending."""
        return not self.findings

    def to_dict(self) -> dict[str, Any]:
        """JSON-able form: {"name", "clean", "measures": {...}, "findings": [{"code", "count", "sentence", "mend"}],
        "command"}."""
        rows = [vars(finding) for finding in self.findings]
        told = {"name": self.name, "clean": self.clean, "measures": self.measures, "findings": rows}
        return told | {"command": self.command}


def examine(
    source: str | Path | Source | OrganMesh, *, unit: str | None = None, tissue: tuple[float, float] = TISSUE
) -> Findings:
    """What is to be known about a mesh file or an OrganMesh.

    source: a Source has also a scale or a part. unit: of the file, one of UNITS; None: the likely one is taken for the
    numbers, and that is a finding. tissue: shear modulus [Pa] and density [kg/m^3] for the time step. Raises StudyError
    for a file that holds no mesh, or one of a size beyond all measure.
    """
    if isinstance(source, OrganMesh):
        cells = source.tetrahedra if len(source.tetrahedra) else source.triangles
        return examine_cells(source.name, source.points, cells, {"unit": "m", "unit_said": True}, tissue)
    asked = as_source(source, unit)
    content = opened(asked)
    used, metres = how_long(asked, content)
    check_range(content.longest_side * metres, asked.path.name)
    # An STL file repeats the corners of every triangle: nothing to report.
    repeats = asked.path.suffix.lower() == ".stl"
    found = describe_welding(content.points, content.cells, repeats)
    found["part_list"] = [] if found["bad_points"] else [row_of(part, metres) for part in parts_in(content)]
    points, cells = content.points, content.cells
    points, cells = (points, cells) if found["bad_points"] else weld(points, cells)
    return examine_cells(asked.path.name, points * metres, cells, used | found, tissue)


def how_long(source: Source, content: Content) -> tuple[dict[str, Any], float]:
    """The unit, whether it was stated, and metres per unit of the file."""
    side = source.scale * content.longest_side
    said = source.unit or content.unit
    likely = likely_units(side)
    # The smallest unit that makes an organ of the points, for showing numbers only.
    unit = said or ("m" if source.longest_side is not None else (likely or ["m"])[-1])
    known = said is not None or source.longest_side is not None or likely == ["m"]
    metres = source.metres(content.longest_side, unit) if known else source.scale * UNITS[unit]
    return {"unit": unit, "unit_said": known}, metres


def row_of(part: Part, metres: float) -> dict[str, Any]:
    """A part in metres, JSON-able."""
    size = [metres * side for side in part.size]
    return {"number": part.number, "name": part.name, "triangles": part.triangles, "size": size}


def examine_cells(
    name: str, points: np.ndarray, cells: np.ndarray, known: dict[str, Any], tissue: tuple[float, float]
) -> Findings:
    """Findings about points (n, 3) [m] and triangles (t, 3) or tetrahedra (k, 4); `known` is put in front."""
    solid = cells.shape[1] == 4
    measures: dict[str, Any] = {"kind": "tetrahedra" if solid else "surface", "part_list": [], **known}
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
