"""Tetrahedra as the legacy VTK file that Bullet and Drake read."""

import numpy as np


def vtk_text(points: np.ndarray, cells: np.ndarray) -> str:
    """A file of points (n, 3) and tetrahedra (k, 4), a line for each: Bullet reads line by line."""
    lines = [
        "# vtk DataFile Version 2.0",
        "organ",
        "ASCII",
        "DATASET UNSTRUCTURED_GRID",
        f"POINTS {len(points)} double",
    ]
    lines += [" ".join(map(repr, point)) for point in points.tolist()]
    lines += [f"CELLS {len(cells)} {5 * len(cells)}", *("4 " + " ".join(map(str, cell)) for cell in cells.tolist())]
    return "\n".join([*lines, f"CELL_TYPES {len(cells)}", *["10"] * len(cells), ""])
