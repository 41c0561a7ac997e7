"""FElupe: quadratic tetrahedra with one pressure each (mean dilatation), neo-Hookean, a path of equilibria by Newton.

The volume is kept by the bulk modulus of the scene. Planes and spheres touch nodes by a penalty, scaled to the
stiffness of the body; the sphere is that of FElupe's example for ContactRigidBase. Load steps that fail are halved.
Inertia and damping are left out, as the scene allows: the loads are slow. A body that nothing holds is held at three
nodes so that it cannot turn or drift, which takes no force.
"""

import time
from pathlib import Path
from typing import Any

import felupe  # pyright: ignore[reportMissingImports]
import numpy as np
from pypardiso import spsolve
from scene_folder import CannotDo, SceneFolder, hand_in, moved, place

INCREMENTS = 4
"""Load steps between two checkpoints."""
PENALTY = 1.0
"""Of the stiffness of the body at a node. Ten times that gives the same force within 0.1 % on kidney_probe, at eleven
times the cost."""


def run(scene: SceneFolder, out: Path, *, increments: int = INCREMENTS, penalty: float = PENALTY) -> None:
    """Runs the scene with `increments` load steps to a checkpoint and hands it in."""
    scene.check_simple()
    if np.any(scene.data["gravity"]):
        raise CannotDo("its adapter knows no weight")
    started = time.process_time()
    count, obstacles = len(scene.points), scene.obstacles("plane", "sphere")
    centres = [place(one, 0.0)[None] for one in obstacles]
    mesh = felupe.Mesh(np.vstack([scene.points, *centres]), scene.cells, "tetra10")
    mesh.points_without_cells = np.empty(0, np.int64)  # the reference points of the obstacles are moved in each step
    displacement = felupe.Field(felupe.RegionQuadraticTetra(mesh), dim=3)
    field = felupe.FieldContainer([displacement])
    bulk = scene.data["material"]["bulk_modulus"]
    body = felupe.SolidBodyNearlyIncompressible(felupe.NeoHooke(mu=scene.mu), field, bulk=bulk)
    contacts = [_contact(scene, field, body, k, penalty) for k in range(len(obstacles))]
    paths = [(one["path"], [count + k]) for k, one in enumerate(obstacles)]
    paths += [(held["path"], scene.marked(held["point_data"])) for held in scene.data["held"]]
    driven = [(path, axis, _fixed(displacement, nodes, axis)) for path, nodes in paths for axis in range(3)]
    tied = {} if scene.data["held"] else _tied(scene, displacement)
    boundaries = tied | {f"driven{number}": boundary for number, (_, _, boundary) in enumerate(driven)}
    positions, forces = [scene.points], [0.0]
    for before, now in zip(scene.times[:-1], scene.times[1:], strict=True):
        ends = [(moved(path, before)[axis], moved(path, now)[axis], boundary) for path, axis, boundary in driven]
        ramp = {boundary: np.linspace(begin, end, increments + 1) for begin, end, boundary in ends}
        step = felupe.Step(items=[body, *contacts], ramp=ramp, boundaries=boundaries)
        job = felupe.Job(steps=[step], plugins=[felupe.CutbackPlugin()])
        job.evaluate(x0=field, verbose=0, solver=spsolve)
        positions.append(scene.points + displacement.values[:count])
        forces.append(_force(scene, body, contacts, count))
    spent = time.process_time() - started
    hand_in(out, scene.times, np.array(positions), np.array(forces), spent / scene.data["duration"])


class ContactRigidSphere(felupe.mechanics.ContactRigidBase):
    """Nodes stay outside a sphere round the centre point."""

    def __init__(self, field: Any, points: Any, centerpoint: int, radius: float, **options: Any) -> None:
        self.radius = radius
        super().__init__(field, points, centerpoint, **options)

    def _kinematics(self, dx: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        distance = np.linalg.norm(dx, axis=1)
        normal = dx / distance[:, None]
        across = np.eye(3) - np.einsum("ai,aj->aij", normal, normal)
        return distance - self.radius, normal, across / distance[:, None, None]


def _contact(scene: SceneFolder, field: Any, body: Any, number: int, penalty: float) -> Any:
    obstacle, point = scene.data["obstacles"][number], len(scene.points) + number
    options: dict[str, Any] = {"centerpoint": point, "items": [body], "multiplier": penalty}
    if obstacle["kind"] == "sphere":
        return ContactRigidSphere(field, points=scene.outer, radius=obstacle["radius"], **options)
    return felupe.ContactRigidPlane(field, points=scene.outer, normal=np.array(obstacle["normal"]), **options)


def _force(scene: SceneFolder, body: Any, contacts: list[Any], count: int) -> float:
    """The probed force [N]: minus the force on the reference point of the obstacle, or the force that moves the held
    region."""
    probed = scene.probed_obstacle
    result = (body if probed is None else contacts[probed]).results.force
    of_points = np.asarray(result.todense()).ravel()[: 3 * (count + len(contacts))].reshape(-1, 3)
    nodes = scene.probed_nodes if probed is None else [count + probed]
    return scene.along(of_points[nodes].sum(axis=0))


def _fixed(displacement: Any, nodes: Any, *axes: int) -> Any:
    mask = np.zeros(displacement.region.mesh.npoints, bool)
    mask[nodes] = True
    return felupe.Boundary(displacement, mask=mask, skip=tuple(int(axis not in axes) for axis in range(3)))


def _tied(scene: SceneFolder, displacement: Any) -> dict[str, Any]:
    """The constraints of a free body: a node, a direction from it, and a plane through both."""
    x = scene.points - scene.points.mean(axis=0)
    reach = np.abs(x).max()
    middle, one, other = (
        int(np.linalg.norm(x - place, axis=1).argmin()) for place in reach * np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0]])
    )
    return {
        "middle": _fixed(displacement, [middle], 0, 1, 2),
        "direction": _fixed(displacement, [one], 1, 2),
        "plane": _fixed(displacement, [other], 2),
    }
