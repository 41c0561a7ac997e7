"""Bullet (PyBullet): deformable bodies of linear tetrahedra, stable neo-Hookean, explicit in stiffness.

Volume is kept by the second Lame constant; here 49 mu, for stiffer ones need shorter steps. Planes are boxes whose
positions are set in each step. Bullet reports no force between a shape and a deformable body, so the force is computed
from the forces of the elements there. Damping is Bullet's, on rates of strain; all nodes have equal masses, since
Bullet takes only the mass of the body.
"""

# Checked alike where the package is not installed.
# pyright: reportAttributeAccessIssue=false

import tempfile
from pathlib import Path
from typing import Any

import numpy as np
import pybullet  # pyright: ignore[reportMissingImports]
from scene_folder import CannotDo, SceneFolder, gap, march, moved, place, turn_to, vtk_text
from stable_neo_hookean import StableNeoHookean

STEP = 2.5e-4
"""[s]."""
LAME = 49.0
"""lambda over mu: a Poisson ratio of 0.49."""
DAMPING = 0.01
"""Of rates of strain, over the stiffness [s]."""
MARGIN = 1e-4
"""Of collisions [m]: the surface is so far off the obstacles."""
BOX = 0.5
"""Half the edge of what stands for a plane [m]."""


class Deformable:
    """A scene in Bullet: the organ, its obstacles, and the forces of its elements."""

    def __init__(self, scene: SceneFolder, dt: float, lame: float, damping: float) -> None:
        """Raises CannotDo."""
        scene.check_simple()
        if np.any(scene.data["gravity"]):
            raise CannotDo("its adapter reads the force where there is no weight")
        self.scene, self.obstacles, self.probed = scene, scene.obstacles("plane", "sphere"), scene.probed_obstacle
        self.damping = damping
        pybullet.connect(pybullet.DIRECT)
        pybullet.resetSimulation(pybullet.RESET_USE_DEFORMABLE_WORLD)
        pybullet.setGravity(*scene.data["gravity"])
        pybullet.setTimeStep(dt)
        self.law = StableNeoHookean(scene.points, scene.cells, scene.mu, lame * scene.mu)
        self.organ = self._organ()
        self.bodies = [self._shape(one) for one in self.obstacles]
        awake = pybullet.ACTIVATION_STATE_DISABLE_SLEEPING  # the loads are slower than Bullet's threshold for rest
        pybullet.changeDynamics(self.organ, -1, activationState=awake)
        self.holds = [self._hold(held) for held in scene.data["held"]]

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
                NeoHookeanLambda=self.law.k,
                NeoHookeanDamping=self.damping,
                useSelfCollision=0,
                collisionMargin=MARGIN,
                frictionCoeff=0.0,
            )

    def _hold(self, held: dict[str, Any]) -> tuple[dict[str, Any], int]:
        """The path of a held region, and the body without a shape that its nodes are anchored to; -1 where it stays."""
        body, nodes = -1, self.scene.marked(held["point_data"])
        if np.any(held["path"]["displacements"]):
            body = pybullet.createMultiBody(0.0)
        for node in nodes.tolist():
            at = () if body < 0 else (self.scene.points[node].tolist(),)
            pybullet.createSoftBodyAnchor(self.organ, node, body, -1, *at)
        return held["path"], body

    def _shape(self, obstacle: dict[str, Any]) -> int:
        """A sphere, or a box for a plane: its distance field knows no half-spaces."""
        if obstacle["kind"] == "sphere":
            shape = pybullet.createCollisionShape(pybullet.GEOM_SPHERE, radius=obstacle["radius"])
        else:
            shape = pybullet.createCollisionShape(pybullet.GEOM_BOX, halfExtents=[BOX] * 3)
        body = pybullet.createMultiBody(0.0, shape)
        pybullet.changeDynamics(body, -1, lateralFriction=0.0, collisionMargin=MARGIN)
        return body

    def step(self, t: float) -> None:
        """To time t [s], the obstacles where they are then."""
        for body, one in zip(self.bodies, self.obstacles, strict=True):
            middle, turn = place(one, t), [0.0, 0.0, 0.0, 1.0]
            if one["kind"] == "plane":
                middle, turn = middle - BOX * np.array(one["normal"]), turn_to(one["normal"]).tolist()
            pybullet.resetBasePositionAndOrientation(body, middle.tolist(), turn)
        for path, body in self.holds:
            if body >= 0:
                pybullet.resetBasePositionAndOrientation(body, moved(path, t).tolist(), [0.0, 0.0, 0.0, 1.0])
        pybullet.stepSimulation()

    def positions(self) -> np.ndarray:
        """Of all nodes [m], (n, 3)."""
        return np.array(pybullet.getMeshData(self.organ, -1, flags=pybullet.MESH_DATA_SIMULATION_MESH)[1])

    def force(self, t: float) -> float:
        """The probed force [N] at time t [s]: what the elements push back at the held region, or at all free nodes that
        are nearer to the probed obstacle than to any other. At rest only touched nodes push."""
        x, nodes = self.positions(), self.scene.probed_nodes
        if self.probed is not None:
            nearest = np.argmin([gap(one, x, t)[0] for one in self.obstacles], axis=0)
            nodes = np.setdiff1d(np.flatnonzero(nearest == self.probed), self.scene.held)
        return self.scene.along(-self.law.forces(x)[nodes].sum(axis=0))


def run(
    scene: SceneFolder,
    out: Path,
    *,
    step: float = STEP,
    lame: float = LAME,
    damping: float = DAMPING,
) -> None:
    """Runs the scene with steps of `step` and hands it in."""
    body = Deformable(scene, step, lame, damping)
    march(scene, out, step, body.step, body.force, body.positions)
