"""The exported scene in this folder for SOFA 23.06 or newer with SofaPython3, numpy and meshio.

    python sofa_scene.py

writes sofa.npz and sofa.json. Hand in sofa.json for a scene and a mesh of the league, sofa.npz for any other:
`organbench judge SCENE sofa.npz`. Corotated linear tetrahedra, implicit Euler steps, a sparse direct solver, penalty
contact at nodes. The file stands alone, so it has its own copy of what the other adapters share. The authors of
organbench could not run it: SOFA is not on PyPI.
"""

# SOFA is not installed where this file is checked.
# pyright: reportMissingImports=false, reportAttributeAccessIssue=false

import json
import platform
import sys
import time
from pathlib import Path
from typing import Any

import meshio
import numpy as np
import Sofa
import Sofa.Core
import Sofa.Simulation

STEP = 0.01
"""[s]."""
POISSON = 0.49
"""Near ½ linear tetrahedra lock, far from it they lose volume."""
STIFFNESS = 20.0
"""Of the contact at a node, over mu times the cube root of the volume per node [1]."""
AVERAGED = 20
"""The force is the mean over so many steps before a checkpoint."""
SET = "OB-2027.1"
"""Of the league, which takes no entry of other scenes."""
PLUGINS = (
    "Constraint.Projective",
    "LinearSolver.Direct",
    "Mass",
    "MechanicalLoad",
    "ODESolver.Backward",
    "SolidMechanics.FEM.Elastic",
    "StateContainer",
    "Topology.Container.Dynamic",
)
FOLDER = Path(__file__).parent


def moved(path: dict[str, Any], t: float) -> np.ndarray:
    """Displacement of an obstacle or a held region at time t [s] [m], (3,)."""
    return np.array([np.interp(t, path["times"], axis) for axis in np.array(path["displacements"]).T])


def place(obstacle: dict[str, Any], t: float) -> np.ndarray:
    """A point of a plane or the centre of a sphere at time t [s] [m], (3,)."""
    return np.array(obstacle["point" if obstacle["kind"] == "plane" else "centre"]) + moved(obstacle["path"], t)


def contact_force(obstacle: dict[str, Any], stiffness: float, x: np.ndarray, t: float) -> np.ndarray:
    """Force of an obstacle on nodes x (n, 3) [m] by the law of PlaneForceField and SphereForceField [N], (3,)."""
    away = x - place(obstacle, t)
    if obstacle["kind"] == "plane":
        normal = np.broadcast_to(obstacle["normal"], x.shape)
        gap = np.einsum("ni,ni->n", away, normal)
    else:
        distance = np.linalg.norm(away, axis=1)
        gap, normal = distance - obstacle["radius"], away / np.maximum(distance, 1e-12)[:, None]
    return stiffness * np.minimum(gap, 0.0) @ -normal


def element_forces(rest: np.ndarray, cells: np.ndarray, x: np.ndarray, mu: float, poisson: float) -> np.ndarray:
    """Forces of corotated linear tetrahedra on their nodes [N], (n, 3), as TetrahedronFEMForceField's "polar" has them.

    P = 2 mu (F - R) + lambda tr(RᵀF - 1) R with R the rotation of F.
    """
    before, after = (np.swapaxes(at[cells[:, 1:]] - at[cells[:, :1]], 1, 2) for at in (rest, x))
    inverse, volume = np.linalg.inv(before), np.abs(np.linalg.det(before)) / 6.0
    F = after @ inverse
    u, _, v = np.linalg.svd(F)
    u[:, :, 2] *= np.linalg.det(u @ v)[:, None]
    R = u @ v
    lame = 2.0 * mu * poisson / (1.0 - 2.0 * poisson)
    trace = np.einsum("kij,kij->k", R, F) - 3.0
    P = 2.0 * mu * (F - R) + lame * trace[:, None, None] * R
    pull = -volume[:, None, None] * P @ np.swapaxes(inverse, 1, 2)
    forces = np.zeros_like(rest)
    for corner in range(3):
        np.add.at(forces, cells[:, corner + 1], pull[:, :, corner])
    np.add.at(forces, cells[:, 0], -pull.sum(axis=2))
    return forces


def why_not(scene: dict[str, Any]) -> str:
    """What this file cannot do of a scene; "" where it can."""
    odd = [o for o in scene["obstacles"] if o["kind"] not in ("plane", "sphere") or o["friction"] != 0.0]
    if odd:
        return f"it knows frictionless planes and spheres, not: {odd[0]['words']}"
    if scene["lumen"] is not None:
        return "it knows solid organs, not a wall round a lumen"
    if scene["start"]["speed"] is not None:
        return "it starts at rest"
    if scene["cut"] is not None and scene["cut"]["contact"]:
        return "it lets the faces of a cut pass through each other"
    return ""


class Run(Sofa.Core.Controller):
    """Moves what is moved before each step, and keeps what is handed in after it."""

    def __init__(self, scene: dict[str, Any], mesh: meshio.Mesh, parts: dict[Any, Any], stiffness: float) -> None:
        """parts: the MechanicalObject "dofs" and the force field of each obstacle, by its number."""
        Sofa.Core.Controller.__init__(self, name="run")
        self.scene, self.parts, self.stiffness = scene, parts, stiffness
        self.rest, self.cells = np.array(mesh.points, float), mesh.cells[0].data.astype(int)
        self.held = [(np.flatnonzero(mesh.point_data[h["point_data"]] == 1), h["path"]) for h in scene["held"]]
        self.ends = {round(t / STEP): t for t in scene["checkpoints"]}
        self.done, self.sampled, self.started = 0, list[float](), time.process_time()
        self.t, self.positions, self.force = [0.0], [self.rest], [0.0]

    def onAnimateBeginEvent(self, _event: object) -> None:
        """Obstacles and held nodes go where they are at the end of the step."""
        t = (self.done + 1) * STEP
        for number, obstacle in enumerate(self.scene["obstacles"]):
            here, field = place(obstacle, t), self.parts[number]
            if obstacle["kind"] == "plane":
                field.d.value = float(here @ np.array(obstacle["normal"]))
            else:
                field.sphereCenter.value = here.tolist()
        with self.parts["dofs"].position.writeable() as x:
            for nodes, path in self.held:
                x[nodes] = self.rest[nodes] + moved(path, t)

    def onAnimateEndEvent(self, _event: object) -> None:
        """Samples the force, and at a checkpoint keeps the positions; after the last one hands in."""
        self.done += 1
        x = np.array(self.parts["dofs"].position.value, float)
        following = min((end for end in self.ends if end >= self.done), default=0)
        if following - self.done < AVERAGED:
            self.sampled.append(self.probed(x, self.done * STEP))
        if self.done in self.ends:
            self.t.append(self.ends[self.done])
            self.positions.append(x)
            self.force.append(float(np.mean(self.sampled)))
            self.sampled = []
        if self.done == max(self.ends):
            self.hand_in()

    def probed(self, x: np.ndarray, t: float) -> float:
        """The force that is asked for [N]: of an obstacle, or of a held region, which balances the elements there."""
        quantity = self.scene["force"]
        if quantity["of"] == "obstacle":
            force = contact_force(self.scene["obstacles"][quantity["number"]], self.stiffness, x, t)
        else:
            mu = self.scene["material"]["shear_modulus"]
            forces = element_forces(self.rest, self.cells, x, mu, POISSON)
            force = -forces[self.held[quantity["number"]][0]].sum(axis=0)
        return float(force @ np.array(quantity["direction"]))

    def hand_in(self) -> None:
        """Writes what `organbench judge` reads."""
        spent = (time.process_time() - self.started) / self.scene["duration"]
        np.savez(FOLDER / "sofa.npz", t=self.t, positions=self.positions, force=self.force)
        given, version = self.scene["meshes"]["straight"], str(getattr(Sofa, "__version__", "unknown"))
        entry = {
            "set": SET,
            "scene": self.scene["name"],
            "engine": "sofa",
            "version": version,
            "mesh": "straight",
            "nodes": given["outer_nodes"],
            "mesh_sha256": given["sha256"],
            "result": "sofa.npz",
            "seconds": spent,
            "settings": {"step": STEP, "poisson": POISSON, "stiffness": STIFFNESS},
            "environment": {"python": platform.python_version(), "machine": platform.machine(), "sofa": version},
            "command": "python sofa_scene.py",
        }
        (FOLDER / "sofa.json").write_text(json.dumps(entry, indent=1), encoding="utf-8")


def createScene(root: Any) -> Any:
    """What SOFA calls. Ends with a sentence for a scene that this file cannot do."""
    scene = json.loads((FOLDER / "scene.json").read_text(encoding="utf-8"))
    reason = why_not(scene)
    if reason:
        sys.exit(f"sofa_scene.py: {reason}")
    mesh = meshio.read(FOLDER / scene["meshes"]["straight"]["file"])
    rest, cells = np.array(mesh.points, float), mesh.cells[0].data
    mu, density = scene["material"]["shear_modulus"], scene["material"]["density"]
    edges = rest[cells[:, 1:]] - rest[cells[:, :1]]
    volume = float(np.abs(np.linalg.det(edges)).sum() / 6.0)
    stiffness = STIFFNESS * mu * (volume / len(rest)) ** (1.0 / 3.0)
    for name in PLUGINS:
        root.addObject("RequiredPlugin", name=f"Sofa.Component.{name}")
    root.dt, root.gravity = STEP, scene["gravity"]
    body = root.addChild("body")
    body.addObject("EulerImplicitSolver", rayleighMass=scene["damping"]["rate"], rayleighStiffness=0.0)
    body.addObject("SparseLDLSolver", template="CompressedRowSparseMatrixMat3x3d")
    body.addObject("TetrahedronSetTopologyContainer", position=rest.tolist(), tetrahedra=cells.tolist())
    body.addObject("TetrahedronSetGeometryAlgorithms", template="Vec3d")
    parts: dict[Any, Any] = {"dofs": body.addObject("MechanicalObject", template="Vec3d", position=rest.tolist())}
    body.addObject("MeshMatrixMass", massDensity=density, lumping=True)
    young = 2.0 * mu * (1.0 + POISSON)
    body.addObject("TetrahedronFEMForceField", method="polar", youngModulus=young, poissonRatio=POISSON)
    held = sorted({int(n) for h in scene["held"] for n in np.flatnonzero(mesh.point_data[h["point_data"]] == 1)})
    if held:
        body.addObject("FixedProjectiveConstraint", indices=held)
    for number, obstacle in enumerate(scene["obstacles"]):
        here = place(obstacle, 0.0)
        if obstacle["kind"] == "plane":
            normal = obstacle["normal"]
            where = {"normal": normal, "d": float(here @ np.array(normal))}
            parts[number] = body.addObject("PlaneForceField", stiffness=stiffness, damping=0.0, **where)
        else:
            where = {"sphereCenter": here.tolist(), "sphereRadius": obstacle["radius"]}
            parts[number] = body.addObject("SphereForceField", stiffness=stiffness, damping=0.0, **where)
    root.addObject(Run(scene, mesh, parts, stiffness))
    return root


def main() -> None:
    """Runs the scene to its last checkpoint."""
    import SofaRuntime  # noqa: F401  # without runSofa this makes its components known

    root = Sofa.Core.Node("root")
    createScene(root)
    Sofa.Simulation.init(root)
    scene = json.loads((FOLDER / "scene.json").read_text(encoding="utf-8"))
    for _ in range(round(max(scene["checkpoints"]) / STEP)):
        Sofa.Simulation.animate(root, STEP)


if __name__ == "__main__":
    main()
