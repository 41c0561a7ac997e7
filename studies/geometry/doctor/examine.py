"""The mesh doctor: finds the faults of a mesh, counts them, and names what repairs them."""

import warnings
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from studies.geometry.doctor.findings import REMARKS, Finding, findings_of
from studies.geometry.doctor.measures import describe_springs, describe_surface, describe_tetrahedra
from studies.geometry.files.checked_reading import weld
from studies.geometry.files.content import Content, parts_in
from studies.geometry.files.masks import is_mask
from studies.geometry.files.opening import opened
from studies.geometry.files.units import UNITS, Source, as_source, check_range, likely_units
from studies.geometry.mesh.organ_mesh import OrganMesh, boundary_triangles, turn_inverted

TISSUE = 1800.0, 1060.0
"""Default shear modulus [Pa] and density [kg/m^3] for the time step: those of a liver."""


@dataclass(frozen=True)
class Findings:
    """The measures of a mesh, and its faults."""

    name: str
    measures: dict[str, Any]
    """Numbers by name, SI units, JSON-able; docs/meshes.md has the list."""
    findings: tuple[Finding, ...]
    command: str | None = None
    """A command line that repairs everything, as a trial has shown (api/advice.py), or None."""

    @property
    def clean(self) -> bool:
        return all(finding.code in REMARKS for finding in self.findings)

    def to_dict(self) -> dict[str, Any]:
        """JSON-able form, as docs/meshes.md has it."""
        rows = [vars(finding) for finding in self.findings]
        data = {"name": self.name, "clean": self.clean, "measures": self.measures}
        return data | {"findings": rows, "command": self.command}


def examine(
    source: str | Path | Source | OrganMesh, *, unit: str | None = None, tissue: tuple[float, float] = TISSUE
) -> Findings:
    """The measures and faults of a mesh file or an OrganMesh.

    unit: of the file, one of UNITS; None: the one that it states, else the most likely one, which is a finding unless
    only metres are likely. tissue: shear modulus [Pa] and density [kg/m^3] for the time step. Raises StudyError for a
    file without a mesh or with an impossible size.
    """
    if isinstance(source, OrganMesh):
        cells = source.tetrahedra if len(source.tetrahedra) else source.triangles
        return examine_cells(source.name, source.points, cells, {"unit": "m", "unit_said": True}, tissue)
    file = as_source(source, unit)
    content = opened(file)
    used, metres = unit_of(file, content)
    check_range(content.longest_side * metres, file.path.name)
    points, cells = content.points, content.cells
    count = len(np.unique(cells))
    welding: dict[str, Any] = {
        "points_in_file": len(points),
        "unused_points": len(points) - count,
        "duplicate_points": 0,
    }
    if np.isfinite(points).all():
        welding["part_list"] = [] if is_mask(file.path) else parts_in(content, metres)  # --part is a label there
        points, cells = weld(points, cells)
        # An STL file repeats the corners of every triangle, which is no fault.
        welding["duplicate_points"] = 0 if file.path.suffix.lower() == ".stl" else count - len(points)
    return examine_cells(file.path.name, points * metres, cells, used | welding, tissue)


def unit_of(source: Source, content: Content) -> tuple[dict[str, Any], float]:
    """The measures "unit" and "unit_said" (whether the unit is certain), and metres per unit of the file."""
    side = source.scale * content.longest_side
    explicit = source.unit or content.unit
    likely = likely_units(side)
    # The smallest unit that gives the size of an organ; it serves to show numbers only.
    unit = explicit or ("m" if source.longest_side is not None else (likely or ["m"])[-1])
    certain = explicit is not None or source.longest_side is not None or likely == ["m"]
    metres = source.metres(content.longest_side, unit) if certain else source.scale * UNITS[unit]
    return {"unit": unit, "unit_said": certain}, metres


def examine_cells(
    name: str, points: np.ndarray, cells: np.ndarray, file_measures: dict[str, Any], tissue: tuple[float, float]
) -> Findings:
    """Measures and faults of points (n, 3) [m] and triangles (t, 3) or tetrahedra (k, 4), with those of the file; of
    points that are not finite nothing else is measured."""
    solid = cells.shape[1] == 4
    measures: dict[str, Any] = {"kind": "tetrahedra" if solid else "surface", "part_list": [], **file_measures}
    measures = {"bad_points": int((~np.isfinite(points).all(axis=1)).sum())} | measures
    if not measures["bad_points"]:
        # Faces look outward only where volumes are positive.
        turned = turn_inverted(points, cells.copy()) if solid else cells
        triangles = boundary_triangles(turned) if solid else cells
        measures |= describe_surface(points, triangles)
        if solid:
            measures |= describe_tetrahedra(points, cells, measures["volume"])
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            measures["springs"] = describe_springs(points, triangles, turned if solid else None, measures, tissue)
    return Findings(name, measures, findings_of(measures))
