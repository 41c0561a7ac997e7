"""Newton (Warp on the CPU): vertex block descent on linear tetrahedra, stable neo-Hookean, single precision.

Volume is kept as its documentation has it, by the second Lame constant; here 49 mu, for stiffer ones need more sweeps.
Planes are static shapes that are moved by hand and push by a penalty; the force is read off its depth. Damping is that
of the scene, on every velocity after a step.
"""

# Checked alike where the package is not installed.
# pyright: reportAttributeAccessIssue=false, reportArgumentType=false

import time
from itertools import pairwise
from pathlib import Path
from typing import Any

import newton  # pyright: ignore[reportMissingImports]
import numpy as np
import warp as wp  # pyright: ignore[reportMissingImports]

from studies.exchange.peers.scene_folder import SceneFolder, hand_in, moved, turn_to

STEP, SWEEPS = 5e-3, 10
"""[s]; sweeps over all vertices in a step."""
LAME = 49.0
"""lambda over mu: a Poisson ratio of 0.49."""
PENALTY = 2e3
"""Of a plane on a particle [N/m]."""
RADIUS = 1e-4
"""Of a particle [m]: the surface is so far off the planes."""
FORCES = 20
"""Forces are means over so many steps before a checkpoint."""


def model_of(scene: SceneFolder) -> tuple[Any, list[int]]:
    """The scene as Newton's model, and the numbers of its planes. Raises CannotDo."""
    scene.check_simple()
    builder = newton.ModelBuilder(gravity=tuple(scene.data["gravity"]))
    config = newton.ModelBuilder.ShapeConfig(ke=PENALTY, kd=0.0, mu=0.0)
    planes = [builder.add_shape_plane(plane=None, xform=_placed(plane, 0.0), width=0.0, length=0.0, cfg=config)
              for plane in scene.planes]  # fmt: skip
    builder.add_soft_mesh(
        pos=wp.vec3(0.0, 0.0, 0.0),
        rot=wp.quat_identity(),
        scale=1.0,
        vel=wp.vec3(0.0, 0.0, 0.0),
        vertices=[wp.vec3(*point) for point in scene.points.tolist()],
        indices=scene.cells.ravel().tolist(),
        density=scene.density,
        k_mu=scene.mu,
        k_lambda=LAME * scene.mu,
        k_damp=0.0,
        particle_radius=RADIUS,
    )
    for node in scene.held.tolist():
        builder.particle_mass[node] = 0.0
        builder.particle_flags[node] &= ~int(newton.ParticleFlags.ACTIVE)
    builder.color()
    model = builder.finalize(device="cpu")
    model.soft_contact_ke, model.soft_contact_kd, model.soft_contact_mu = PENALTY, 0.0, 0.0
    return model, planes


def run(scene: SceneFolder, out: Path, shorter: float = 1.0) -> None:
    """Runs the scene with steps of STEP × shorter and hands it in."""
    wp.config.quiet = True
    dt = STEP * shorter
    model, planes = model_of(scene)
    solver = newton.solvers.SolverVBD(model, iterations=SWEEPS, particle_enable_tile_solve=False)
    pipeline = newton.CollisionPipeline(model)
    contacts, now, after, control = pipeline.contacts(), model.state(), model.state(), model.control()
    kept = 1.0 / (1.0 + dt * scene.data["damping"]["rate"])
    positions, forces, sampled, spent = [scene.points], [0.0], [], 0.0
    steps = np.round(scene.times / dt).astype(int)
    _step(solver, pipeline, contacts, now, after, control, dt)  # compiles; the body is at rest
    for begin, end in pairwise(steps):
        started = time.process_time()
        for step in range(begin + 1, end + 1):
            _place(model, planes, scene, step * dt)
            _step(solver, pipeline, contacts, now, after, control, dt)
            after.particle_qd.numpy()[:] *= kept
            now, after = after, now
            if end - step < FORCES:
                sampled.append(_force(scene, now.particle_q.numpy(), step * dt))
        spent += time.process_time() - started
        positions.append(now.particle_q.numpy().astype(np.float64))
        forces.append(float(np.mean(sampled[-FORCES:])))
    hand_in(out, scene.times, np.array(positions), np.array(forces), spent / scene.data["duration"])


def _step(solver: Any, pipeline: Any, contacts: Any, now: Any, after: Any, control: Any, dt: float) -> None:
    now.clear_forces()
    pipeline.collide(now, contacts)
    solver.step(now, after, control, contacts, dt)


def _placed(plane: dict[str, Any], t: float) -> Any:
    """A plane's place and turn at time t [s]: Newton's has its normal along z."""
    place = np.array(plane["point"]) + moved(plane["path"], t)
    return wp.transform(wp.vec3(*place.tolist()), wp.quat(*turn_to(plane["normal"]).tolist()))


def _place(model: Any, planes: list[int], scene: SceneFolder, t: float) -> None:
    transforms = model.shape_transform.numpy()
    for number, plane in zip(planes, scene.planes, strict=True):
        transforms[number] = np.array(_placed(plane, t))
    model.shape_transform.assign(transforms)


def _force(scene: SceneFolder, x: np.ndarray, t: float) -> float:
    """The probed force [N]: the penalty times the depths of all particles in the plane that is asked for."""
    plane = scene.planes[scene.data["force"]["number"]]
    gap = (x - np.array(plane["point"]) - moved(plane["path"], t)) @ np.array(plane["normal"])
    return PENALTY * float(np.maximum(0.0, RADIUS - gap).sum())
