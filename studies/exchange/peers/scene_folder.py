"""What an adapter knows of a scene: the exported folder, and nothing else of this program."""

import json
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np

from studies.base.errors import StudyError
from studies.geometry.files.grids import read_cells, read_points

CANNOT, MISSING = 3, 4
"""Exit codes of studies.exchange.peers.run: a program has no means for the scene; its package is not installed."""
CELLS = {"straight": "tetra", "curved": "tetra10"}


class CannotDo(StudyError):
    """A program has no means for something that the scene needs; the message says for what."""


@dataclass(frozen=True)
class SceneFolder:
    """An exported scene on one of its meshes."""

    folder: Path
    mesh: str = "straight"

    @cached_property
    def data(self) -> dict[str, Any]:
        """scene.json."""
        return json.loads((self.folder / "scene.json").read_text(encoding="utf-8"))

    @cached_property
    def _grid(self) -> tuple[np.ndarray, dict[str, np.ndarray]]:
        return read_points(self._file)

    @property
    def _file(self) -> Path:
        return self.folder / self.data["meshes"][self.mesh]["file"]

    @property
    def points(self) -> np.ndarray:
        """Rest positions [m], (n, 3)."""
        return self._grid[0]

    @cached_property
    def cells(self) -> np.ndarray:
        """Tetrahedra in VTK's order, (k, 4) or (k, 10)."""
        return read_cells(self._file, CELLS[self.mesh])

    def marked(self, name: str) -> np.ndarray:
        """The nodes whose point data `name` is 1."""
        return np.flatnonzero(self._grid[1][name] == 1)

    @property
    def outer(self) -> np.ndarray:
        """Nodes of the outer surface."""
        return self.marked("outer")

    @property
    def mu(self) -> float:
        """Shear modulus [Pa]."""
        return float(self.data["material"]["shear_modulus"])

    @property
    def density(self) -> float:
        """[kg/m³]."""
        return float(self.data["material"]["density"])

    @property
    def times(self) -> np.ndarray:
        """Rest and checkpoints [s], (K + 1,)."""
        return np.array([0.0, *self.data["checkpoints"]])

    @property
    def planes(self) -> list[dict[str, Any]]:
        """The obstacles. Raises CannotDo for one that is no frictionless plane, which is all that adapters know."""
        for obstacle in self.data["obstacles"]:
            if obstacle["kind"] != "plane" or obstacle["friction"] != 0:
                raise CannotDo(f"its adapter knows frictionless planes, not: {obstacle['words']}")
        return self.data["obstacles"]

    def check_simple(self) -> None:
        """Raises CannotDo for a lumen, a start in motion and held regions that move."""
        if self.data["lumen"] is not None:
            raise CannotDo("its adapter knows solid organs, not a wall round a lumen")
        if self.data["start"]["speed"] is not None:
            raise CannotDo("its adapter starts at rest")
        if any(np.any(held["path"]["displacements"]) for held in self.data["held"]):
            raise CannotDo("its adapter knows held regions that do not move")

    @property
    def held(self) -> np.ndarray:
        """Nodes that stay where they are."""
        nodes = [self.marked(held["point_data"]) for held in self.data["held"]]
        return np.unique(np.concatenate(nodes)) if nodes else np.empty(0, np.int64)


def moved(path: dict[str, Any], t: float) -> np.ndarray:
    """Displacement [m] of a path at time t [s], (3,)."""
    return np.array([np.interp(t, path["times"], axis) for axis in np.array(path["displacements"]).T])


def turn_to(normal: list[float]) -> np.ndarray:
    """Quaternion (x, y, z, w) that turns the z axis to a unit normal, (4,)."""
    x, y, z = normal
    # Half-way between both; from one end to the other half a turn about x.
    turn = np.array([-y, x, 0.0, 1.0 + z]) if z > -1.0 + 1e-9 else np.array([1.0, 0.0, 0.0, 0.0])
    return turn / np.linalg.norm(turn)


def hand_in(out: Path, t: np.ndarray, positions: np.ndarray, force: np.ndarray, seconds: float) -> None:
    """Writes what `organbench judge` reads, and the computing time for a simulated second."""
    np.savez(out, t=t, positions=positions, force=force)
    out.with_suffix(".json").write_text(json.dumps({"seconds": seconds}), encoding="utf-8")
