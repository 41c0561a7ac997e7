"""Bullet (PyBullet): deformable bodies of linear tetrahedra, stable neo-Hookean, explicit in stiffness.

Volume is kept by the second Lame constant; here 49 mu, for stiffer ones need shorter steps. Planes are boxes that are
moved by hand. It reports no force between a box and a deformable body: the force is read off the stresses at the nodes
that touch the plane. Damping is its own, on rates of strain; masses are equal, for it takes one for the whole body.
"""

# Checked alike where the package is not installed.
# pyright: reportAttributeAccessIssue=false

import tempfile
import time
from pathlib import Path
from typing import Any

import numpy as np
import pybullet  # pyright: ignore[reportMissingImports]

from studies.exchange.peers.scene_folder import SceneFolder, hand_in, moved, turn_to
from studies.exchange.peers.stable_neo_hookean import StableNeoHookean

STEP = 2.5e-4
"""[s]."""
LAME = 49.0
"""lambda over mu: a Poisson ratio of 0.49."""
DAMPING = 0.01
"""Of rates of strain, over the stiffness [s]."""
MARGIN = 1e-4
"""Of collisions [m]: the surface is so far off the planes."""
BOX = 0.5
"""Half the edge of what stands for a plane [m]."""
FORCES = 20
"""Forces are means over so many steps before a checkpoint."""


class Deformable:
    """A scene in Bullet: the organ, its planes, and what its elements answer."""

    def __init__(self, scene: SceneFolder, dt: float) -> None:
        """Raises CannotDo."""
        scene.check_simple()
        self.scene, self.planes = scene, scene.planes
        pybullet.connect(pybullet.DIRECT)
        pybullet.resetSimulation(pybullet.RESET_USE_DEFORMABLE_WORLD)
        pybullet.setGravity(*scene.data["gravity"])
        pybullet.setTimeStep(dt)
        self.law = StableNeoHookean(scene.points, scene.cells, scene.mu, LAME * scene.mu)
        self.organ = self._organ()
        self.bodies = [self._plane(plane) for plane in self.planes]
        awake = pybullet.ACTIVATION_STATE_DISABLE_SLEEPING  # the loads are slower than what it takes for rest
        pybullet.changeDynamics(self.organ, -1, activationState=awake)
        for node in scene.held.tolist():
            pybullet.createSoftBodyAnchor(self.organ, node, -1, -1)

    def _organ(self) -> int:
        with tempfile.TemporaryDirectory() as folder:
            file = Path(folder) / "organ.vtk"
            file.write_text(vtk_text(self.scene.points, self.scene.cells), encoding="ascii")
            return pybullet.loadSoftBody(
                str(file),
                simFileName=str(file),
                mass=self.scene.density * float(self.law.volume.sum()),
                useNeoHookean=1,
                NeoHookeanMu=self.law.m,
                NeoHookeanLambda=self.law.l,
                NeoHookeanDamping=DAMPING,
                useSelfCollision=0,
                collisionMargin=MARGIN,
                frictionCoeff=0.0,
            )

    def _plane(self, plane: dict[str, Any]) -> int:
        """A box, for its distance field knows no half-spaces."""
        shape = pybullet.createCollisionShape(pybullet.GEOM_BOX, halfExtents=[BOX] * 3)
        body = pybullet.createMultiBody(0.0, shape)
        pybullet.changeDynamics(body, -1, lateralFriction=0.0, collisionMargin=MARGIN)
        return body

    def step(self, t: float) -> None:
        """To time t [s], the planes where they are then."""
        for body, plane in zip(self.bodies, self.planes, strict=True):
            place = np.array(plane["point"]) + moved(plane["path"], t) - BOX * np.array(plane["normal"])
            pybullet.resetBasePositionAndOrientation(body, place.tolist(), turn_to(plane["normal"]).tolist())
        pybullet.stepSimulation()

    def positions(self) -> np.ndarray:
        """Of all nodes [m], (n, 3)."""
        return np.array(pybullet.getMeshData(self.organ, -1, flags=pybullet.MESH_DATA_SIMULATION_MESH)[1])

    def force(self, t: float) -> float:
        """The probed force [N] at time t [s]: what the elements push back at the nodes that touch the plane."""
        plane = self.planes[self.scene.data["force"]["number"]]
        x, normal = self.positions(), np.array(plane["normal"])
        gap = (x - np.array(plane["point"]) - moved(plane["path"], t)) @ normal
        touching = gap < 3.0 * MARGIN
        return -float((self.law.forces(x)[touching] @ normal).sum())


def vtk_text(points: np.ndarray, cells: np.ndarray) -> str:
    """A legacy VTK file of tetrahedra, which Bullet reads line by line."""
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


def run(scene: SceneFolder, out: Path, shorter: float = 1.0) -> None:
    """Runs the scene with steps of STEP × shorter and hands it in."""
    dt = STEP * shorter
    body = Deformable(scene, dt)
    positions, forces, spent = [scene.points], [0.0], 0.0
    begin, steps = 0, np.round(scene.times / dt).astype(int)
    for end in steps[1:]:
        sampled: list[float] = []
        started = time.process_time()
        for step in range(begin + 1, end + 1):
            body.step(step * dt)
            if end - step < FORCES:
                sampled.append(body.force(step * dt))
        spent += time.process_time() - started
        begin = end
        positions.append(body.positions())
        forces.append(float(np.mean(sampled)))
    hand_in(out, scene.times, np.array(positions), np.array(forces), spent / scene.data["duration"])
