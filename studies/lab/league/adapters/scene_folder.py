"""Access of an adapter to a scene: it uses only the exported folder, and no other code of this program.

Adapters are started as files in the environment of the other program, where numpy and meshio are installed and nothing
of ours is: they import each other as neighbours in one folder.
"""

import json
import time
from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any

import meshio
import numpy as np

FORCES = 20
"""Forces are means over so many steps before a checkpoint."""
CANNOT, MISSING = 3, 4
"""Exit codes of run.py: a program has no means for the scene; its package is not installed."""
CELLS = {"straight": "tetra", "curved": "tetra10"}


class CannotDo(Exception):
    """A program does not support something that the scene needs; the message names it."""


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
    def _grid(self) -> meshio.Mesh:
        return meshio.read(self.folder / self.data["meshes"][self.mesh]["file"])

    @cached_property
    def points(self) -> np.ndarray:
        """Rest positions [m], (n, 3)."""
        return np.asarray(self._grid.points, np.float64)

    @cached_property
    def cells(self) -> np.ndarray:
        """Tetrahedra in VTK's order, (k, 4) or (k, 10)."""
        return self._grid.cells_dict[CELLS[self.mesh]].astype(np.int64)

    def marked(self, name: str) -> np.ndarray:
        """The nodes whose point data `name` is 1."""
        return np.flatnonzero(self._grid.point_data[name] == 1)

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

    def obstacles(self, *kinds: str) -> list[dict[str, Any]]:
        """All of them. Raises CannotDo for one that is none of these kinds, and for one with friction."""
        for obstacle in self.data["obstacles"]:
            if obstacle["kind"] not in kinds or obstacle["friction"] != 0:
                plurals = " and ".join(f"{kind}s" for kind in kinds)
                raise CannotDo(f"its adapter knows frictionless {plurals}, not: {obstacle['words']}")
        return self.data["obstacles"]

    @property
    def probed_obstacle(self) -> int | None:
        """Number of the obstacle whose force is asked for; None where it is that of a held region."""
        force = self.data["force"]
        return int(force["number"]) if force["of"] == "obstacle" else None

    @property
    def probed_nodes(self) -> np.ndarray:
        """Nodes of the held region whose force is asked for, (k,); none where it is that of an obstacle."""
        if self.probed_obstacle is not None:
            return np.empty(0, np.int64)
        return self.marked(self.data["held"][self.data["force"]["number"]]["point_data"])

    def along(self, push: np.ndarray) -> float:
        """The probed force [N] of a push on the body (3,) [N]."""
        return float(push @ np.array(self.data["force"]["direction"]))

    @property
    def hung(self) -> np.ndarray:
        """Additional point mass at every node [kg], (n,); only the silicone beam has any."""
        masses = np.zeros(len(self.points))
        for entry in self.data.get("masses", ()):
            masses[entry["node"]] += entry["mass"]
        return masses

    def check_simple(self, masses: bool = False) -> None:
        """Raises CannotDo for a lumen, a start in motion, a cut whose faces touch and, unless `masses`, something that
        hangs at nodes."""
        if not masses and self.data.get("masses"):
            raise CannotDo("its adapter hangs no masses at nodes")
        if self.data["lumen"] is not None:
            raise CannotDo("its adapter knows solid organs, not a wall round a lumen")
        if self.data["start"]["speed"] is not None:
            raise CannotDo("its adapter starts at rest")
        if self.data["cut"] is not None and self.data["cut"]["contact"]:
            raise CannotDo("its adapter lets the faces of a cut pass through each other")

    @cached_property
    def _regions(self) -> list[tuple[dict[str, Any], np.ndarray]]:
        """Path and nodes of each held region; a node of two counts for the first."""
        regions, seen = [], np.empty(0, np.int64)
        for held in self.data["held"]:
            nodes = np.setdiff1d(self.marked(held["point_data"]), seen)
            regions, seen = [*regions, (held["path"], nodes)], np.union1d(seen, nodes)
        return regions

    @cached_property
    def held(self) -> np.ndarray:
        """Nodes of all held regions, (k,), region by region."""
        return np.concatenate([np.empty(0, np.int64), *(nodes for _, nodes in self._regions)])

    def held_at(self, t: float) -> np.ndarray:
        """Where the held nodes are at time t [s] [m], (k, 3), in the order of `held`."""
        ways = [np.broadcast_to(moved(path, t), (len(nodes), 3)) for path, nodes in self._regions]
        return self.points[self.held] + np.concatenate([np.empty((0, 3)), *ways])


def moved(path: dict[str, Any], t: float) -> np.ndarray:
    """Displacement [m] of a path at time t [s], (3,)."""
    return np.array([np.interp(t, path["times"], axis) for axis in np.array(path["displacements"]).T])


def place(obstacle: dict[str, Any], t: float) -> np.ndarray:
    """A point of a plane, or the centre of a sphere, at time t [s] [m], (3,)."""
    return np.array(obstacle["point" if obstacle["kind"] == "plane" else "centre"]) + moved(obstacle["path"], t)


def gap(obstacle: dict[str, Any], x: np.ndarray, t: float) -> tuple[np.ndarray, np.ndarray]:
    """Of points x (n, 3) at time t [s]: signed distance [m], (n,), and the direction away from the obstacle, (n, 3)."""
    away = x - place(obstacle, t)
    if obstacle["kind"] == "plane":
        normal = np.array(obstacle["normal"])
        return away @ normal, np.broadcast_to(normal, x.shape)
    distance = np.linalg.norm(away, axis=1)
    return distance - obstacle["radius"], away / np.maximum(distance, 1e-12)[:, None]


def turn_to(normal: list[float]) -> np.ndarray:
    """Quaternion (x, y, z, w) that turns the z axis to a unit normal, (4,)."""
    x, y, z = normal
    # Half-way between both; from one end to the other half a turn about x.
    turn = np.array([-y, x, 0.0, 1.0 + z]) if z > -1.0 + 1e-9 else np.array([1.0, 0.0, 0.0, 0.0])
    return turn / np.linalg.norm(turn)


def vtk_text(points: np.ndarray, cells: np.ndarray) -> str:
    """Points (n, 3) and tetrahedra (k, 4) as a legacy VTK file, a line for each: Bullet reads line by line."""
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


def march(
    scene: SceneFolder,
    out: Path,
    dt: float,
    step: Callable[[float], None],
    force: Callable[[float], float],
    positions: Callable[[], np.ndarray],
    evaluations: int | None = 1,
    averaged: int = FORCES,
) -> None:
    """Steps a program through the scene and hands it in: step(t) advances it by `dt` to time t [s], force(t) is the
    probed force then [N], of which the mean of the last `averaged` steps before each checkpoint counts.

    evaluations: number of evaluations of all element forces in a step, if known."""
    snapshots, forces, spent, begin = [scene.points], [0.0], 0.0, 0
    steps = np.round(scene.times / dt).astype(int)
    for end in steps[1:]:
        sampled: list[float] = []
        started = time.process_time()
        for number in range(begin + 1, end + 1):
            step(number * dt)
            if end - number < averaged:
                sampled.append(force(number * dt))
        spent += time.process_time() - started
        begin = end
        snapshots.append(positions())
        forces.append(float(np.mean(sampled)))
    count = None if evaluations is None else int(steps[-1]) * evaluations
    hand_in(out, scene.times, np.array(snapshots), np.array(forces), spent / scene.data["duration"], count)


def hand_in(
    out: Path, t: np.ndarray, positions: np.ndarray, force: np.ndarray, seconds: float, evaluations: int | None = None
) -> None:
    """Writes what `organbench judge` reads, and what it cost: the computing time for a simulated second, and how often
    the forces of all elements were evaluated in the whole run, where that is known."""
    np.savez(out, t=t, positions=positions, force=force)
    out.with_suffix(".json").write_text(json.dumps({"seconds": seconds, "evaluations": evaluations}), encoding="utf-8")
