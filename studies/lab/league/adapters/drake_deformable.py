"""Drake: deformable bodies of linear tetrahedra, implicit steps, contact of whole facets by a convex solver.

Volume is kept by a Poisson ratio near ½; the shear modulus is that of the tissue, the damping that of the scene.
Obstacles are bodies on locked joints that are moved by hand; planes are boxes, for it knows no contact of a deformable
body with a half-space. The force is the sum of the contact forces that it reports. Held nodes are tied to bodies that
are moved in the same way; that force is computed from the stresses of its law.
"""

# Checked alike where the package is not installed.
# pyright: reportAttributeAccessIssue=false, reportMissingImports=false

import tempfile
from pathlib import Path
from typing import Any

import numpy as np
from pydrake.common.eigen_geometry import Quaternion
from pydrake.geometry import AddRigidHydroelasticProperties, Box, GeometryInstance, Mesh, ProximityProperties, Sphere
from pydrake.math import RigidTransform
from pydrake.multibody.fem import DeformableBodyConfig, MaterialModel
from pydrake.multibody.plant import AddMultibodyPlant, CoulombFriction, MultibodyPlantConfig
from pydrake.multibody.tree import QuaternionFloatingJoint, SpatialInertia, UnitInertia
from pydrake.systems.analysis import Simulator
from pydrake.systems.framework import DiagramBuilder
from scene_folder import CannotDo, SceneFolder, march, moved, place, turn_to, vtk_text
from stable_neo_hookean import StableNeoHookean

STEP = 1e-2
"""[s]."""
POISSON = 0.49
LAW = "kNeoHookean"
BOX = 0.25
"""Half the edge of what stands for a plane [m]."""
TINY = 1e-6
"""Half the reach in which a node is held [m]."""
FINEST = 2e-3
"""Edge of the triangles that stand for a sphere [m]."""
FORCES = 5
"""Forces are means over so many steps before a checkpoint."""

INERTIA = SpatialInertia(1.0, np.zeros(3), UnitInertia.SolidSphere(1.0))
"""Of what is moved by hand: any will do."""


class Deformable:
    """A scene in Drake."""

    def __init__(self, scene: SceneFolder, dt: float, poisson: float, law: str, finest: float) -> None:
        """finest: edge of the triangles that stand for a sphere [m]. Raises CannotDo."""
        scene.check_simple()
        self.scene, self.obstacles, self.probed = scene, scene.obstacles("plane", "sphere"), scene.probed_obstacle
        builder = DiagramBuilder()
        config = MultibodyPlantConfig(time_step=dt, discrete_contact_approximation="lagged")
        self.plant, self.graph = AddMultibodyPlant(config, builder)
        self.plant.mutable_gravity_field().set_gravity_vector(scene.data["gravity"])
        self.geometries: list[Any] = []
        self.holds: list[tuple[dict[str, Any], Any]] = []
        self.joints = [self._shape(number, one, finest) for number, one in enumerate(self.obstacles)]
        self.organ = self._organ(poisson, law)
        if self.probed is None and law != LAW:
            raise CannotDo("its adapter computes the force of a held region for its neo-Hookean law alone")
        self.law = StableNeoHookean(
            scene.points, scene.cells, scene.mu, 2.0 * scene.mu * poisson / (1.0 - 2.0 * poisson)
        )
        self.plant.Finalize()
        diagram = builder.Build()
        self.simulator = Simulator(diagram)
        self.context = self.plant.GetMyMutableContextFromRoot(self.simulator.get_mutable_context())
        for joint in (*self.joints, *(joint for _, joint in self.holds)):
            joint.Lock(self.context)

    def _organ(self, poisson: float, law: str) -> Any:
        scene, config = self.scene, DeformableBodyConfig()
        config.set_youngs_modulus(2.0 * scene.mu * (1.0 + poisson))
        config.set_poissons_ratio(poisson)
        config.set_mass_density(scene.density)
        config.set_mass_damping_coefficient(scene.data["damping"]["rate"])
        config.set_material_model(getattr(MaterialModel, law))
        with tempfile.TemporaryDirectory() as folder:
            file = Path(folder) / "organ.vtk"
            file.write_text(vtk_text(scene.points, scene.cells), encoding="ascii")
            shape = GeometryInstance(RigidTransform(), Mesh(str(file)), "organ")
            touch = ProximityProperties()
            touch.AddProperty("material", "coulomb_friction", CoulombFriction(0.0, 0.0))
            shape.set_proximity_properties(touch)
            model = self.plant.mutable_deformable_model()
            organ = model.RegisterDeformableBody(shape, config, 1.0)
        for number, held in enumerate(scene.data["held"]):
            body = self.plant.AddRigidBody(f"hold{number}", INERTIA)
            self.holds.append((held["path"], self._way(f"held{number}", body)))
            for node in scene.marked(held["point_data"]):
                at = RigidTransform(scene.points[node])
                model.AddFixedConstraint(organ, body, RigidTransform(), Sphere(TINY), at)
        return organ

    def _way(self, name: str, body: Any) -> Any:
        """The joint by which a body is moved by hand."""
        return self.plant.AddJoint(QuaternionFloatingJoint(name, self.plant.world_frame(), body.body_frame()))

    def _shape(self, number: int, obstacle: dict[str, Any], finest: float) -> Any:
        body = self.plant.AddRigidBody(f"obstacle{number}", INERTIA)
        touch = ProximityProperties()
        touch.AddProperty("material", "coulomb_friction", CoulombFriction(0.0, 0.0))
        AddRigidHydroelasticProperties(finest if obstacle["kind"] == "sphere" else BOX, touch)
        if obstacle["kind"] == "sphere":
            shape, middle = Sphere(obstacle["radius"]), np.zeros(3)
        else:
            shape, middle = Box(2 * BOX, 2 * BOX, 2 * BOX), np.array([0.0, 0.0, -BOX])
        self.geometries.append(
            self.plant.RegisterCollisionGeometry(body, RigidTransform(middle), shape, f"shape{number}", touch)
        )
        return self._way(f"way{number}", body)

    def step(self, t: float) -> None:
        """To time t [s], the obstacles where they are then."""
        for joint, one in zip(self.joints, self.obstacles, strict=True):
            x, y, z, w = turn_to(one["normal"]) if one["kind"] == "plane" else (0.0, 0.0, 0.0, 1.0)
            joint.SetPose(self.context, RigidTransform(Quaternion(w, x, y, z), place(one, t)))
        for path, joint in self.holds:
            joint.SetPose(self.context, RigidTransform(moved(path, t)))
        self.simulator.AdvanceTo(t)

    def positions(self) -> np.ndarray:
        """Of all nodes [m], (n, 3)."""
        return self.plant.deformable_model().GetPositions(self.context, self.organ).T

    def force(self) -> float:
        """The probed force [N]: the sum of the contact forces between the body and the obstacle that is asked for, or
        what holds a region against the stresses."""
        if self.probed is None:
            return self.scene.along(-self.law.forces(self.positions())[self.scene.probed_nodes].sum(axis=0))
        results = self.plant.get_contact_results_output_port().Eval(self.context)
        contacts = [results.deformable_contact_info(number) for number in range(results.num_deformable_contacts())]
        touching = [one for one in contacts if self.geometries[self.probed] in (one.id_A(), one.id_B())]
        return abs(self.scene.along(sum((one.F_Ac_W().translational() for one in touching), np.zeros(3))))


def run(
    scene: SceneFolder,
    out: Path,
    *,
    step: float = STEP,
    poisson: float = POISSON,
    law: str = LAW,
    finest: float = FINEST,
) -> None:
    """Runs the scene with steps of `step` and hands it in."""
    body = Deformable(scene, step, poisson, law, finest)
    march(scene, out, step, body.step, lambda t: body.force(), body.positions, None, FORCES)
