"""How near meshes of real organs are to their files: `python -m studies.bench.scans FOLDER [NODES]`."""

import sys
import time
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from studies.base.errors import StudyError
from studies.geometry.api.scans import raw_surface, scan
from studies.geometry.files.units import UNITS
from studies.geometry.mesh.organ_mesh import OrganMesh, signed_volume
from studies.geometry.mesh.quality import dihedral_angles, tetrahedron_radius_ratio
from studies.geometry.surface.distance import distance_to_surface


@dataclass(frozen=True)
class Nearness:
    """One import against its file."""

    name: str
    nodes: int
    hausdorff: float
    """Two-sided, from nodes and points between them, over the diagonal of the box [%]."""
    volume: float
    """Of the mesh over that of the file, less one [%]."""
    dihedral: float
    """Smallest angle of a tetrahedron [degrees]."""
    radius_ratio: float
    """Smallest of a tetrahedron."""
    seconds: float


def nearness(path: Path, nodes: int, unit: str) -> Nearness:
    """Import a file and compare. Raises StudyError where it cannot be imported."""
    points, triangles = raw_surface(path)
    points = points * UNITS[unit]
    start = time.perf_counter()
    mesh = scan(path, nodes, unit=unit)
    seconds = time.perf_counter() - start
    return Nearness(
        path.stem,
        mesh.outer_count,
        100.0 * hausdorff_share(mesh, points, triangles),
        100.0 * (mesh.volume / signed_volume(points, triangles) - 1.0),
        float(dihedral_angles(mesh.points, mesh.tetrahedra).min()),
        float(tetrahedron_radius_ratio(mesh.points, mesh.tetrahedra).min()),
        seconds,
    )


def hausdorff_share(mesh: OrganMesh, points: np.ndarray, triangles: np.ndarray) -> float:
    """Sampled two-sided Hausdorff distance of the outer surface to another, over the diagonal of the other's box."""
    here = mesh.points[: mesh.outer_count], mesh.outer_triangles
    away = distance_to_surface(samples(*here), points, triangles).max()
    back = distance_to_surface(samples(points, triangles), *here).max()
    return float(max(away, back) / np.linalg.norm(np.ptp(points[np.unique(triangles)], axis=0)))


def samples(points: np.ndarray, triangles: np.ndarray) -> np.ndarray:
    """Nodes, centroids of triangles and middles of edges (m, 3)."""
    corners = points[triangles]
    middles = ((corners + np.roll(corners, 1, axis=1)) / 2.0).reshape(-1, 3)
    return np.vstack([points[np.unique(triangles)], corners.mean(axis=1), middles])


def main(words: list[str]) -> int:
    """Print a row for every surface in millimetres of a folder; exit code 2 without one."""
    folder, nodes = Path(words[0] if words else "."), int(words[1]) if len(words) > 1 else 550
    paths = sorted(folder.glob("*.ply"))
    if not paths:
        print(f"there is no .ply file in {folder}; name the folder of the surfaces", file=sys.stderr)
        return 2
    print(f"{'file':24} nodes  Hausdorff  volume  dihedral  ratio  seconds")
    for path in paths:
        try:
            row = nearness(path, nodes, "mm")
        except StudyError as error:
            print(f"{path.stem:24} {error}")
            continue
        numbers = f"{row.nodes:5}  {row.hausdorff:7.2f} %  {row.volume:+5.2f} %"
        print(f"{row.name:24} {numbers}  {row.dihedral:7.1f}  {row.radius_ratio:5.2f}  {row.seconds:7.1f}")
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
