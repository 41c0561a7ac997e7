"""A program to start from: reads an exported scene and hands in a body that does not move."""

NAME = "solve.py"
"""Of the file in the exported folder."""
HANDED_IN = "mine.npz"
SOLVER = f'''"""A start for a solver of your own: writes {HANDED_IN}, which `organbench judge` takes as it is."""

import json
from pathlib import Path

import meshio
import numpy as np

folder = Path(__file__).parent
scene = json.loads((folder / "scene.json").read_text())
mesh = meshio.read(folder / scene["meshes"]["straight"]["file"])
rest, tetrahedra = mesh.points, mesh.cells[0].data  # [m] (n, 3), (k, 4)
shear, bulk = scene["material"]["shear_modulus"], scene["material"]["bulk_modulus"]  # [Pa]


def displacement(path, time):
    """How far an obstacle or a held region has moved [m], (3,)."""
    return np.array([np.interp(time, path["times"], axis) for axis in zip(*path["displacements"])])


t, positions, force, x = [0.0], [rest], [0.0], rest.copy()
for time in scene["checkpoints"]:
    held = [(mesh.point_data[h["point_data"]] == 1, displacement(h["path"], time)) for h in scene["held"]]
    obstacles = [(o, displacement(o["path"], time)) for o in scene["obstacles"]]
    probed = 0.0
    # Your solver goes here: it moves x [m] to the shape at `time` and sets the probed force [N].
    t.append(time), positions.append(x.copy()), force.append(probed)
np.savez(folder / "{HANDED_IN}", t=t, positions=positions, force=force)
'''
"""The text of the file."""
