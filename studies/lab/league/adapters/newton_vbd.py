"""Newton (Warp on the CPU): vertex block descent on linear tetrahedra, stable neo-Hookean, single precision.

Volume is kept as its documentation has it, by the second Lame constant; here 49 mu, for stiffer ones need more sweeps.
Obstacles are static shapes that are moved by hand and push by a penalty, on nodes, edges and whole facets; the force is
the sum of the contact forces that it reports. Held nodes have no mass and are put where they are held before each step;
the force of a held region is computed from the stresses of its law. Damping is that of the scene, on every velocity
after a step.
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
from scene_folder import SceneFolder, hand_in, place, turn_to
from stable_neo_hookean import PlainStableNeoHookean

STEP, SWEEPS = 5e-3, 10
"""[s]; sweeps over all vertices in a step."""
LAME = 49.0
"""lambda over mu: a Poisson ratio of 0.49."""
PENALTY = 2e3
"""Of an obstacle on a contact [N/m]."""
RADIUS = 1e-4
"""Of a particle [m]: the surface is so far off the obstacles."""
FORCES = 20
"""Forces are means over so many steps before a checkpoint."""


def model_of(scene: SceneFolder, lame: float, penalty: float) -> tuple[Any, list[int]]:
    """The scene as Newton's model, and the numbers of its obstacles. Raises CannotDo."""
    scene.check_simple(masses=True)
    builder = newton.ModelBuilder(gravity=tuple(scene.data["gravity"]))
    config = newton.ModelBuilder.ShapeConfig(ke=penalty, kd=0.0, mu=0.0)
    shapes = [
        builder.add_shape_plane(plane=None, xform=_placed(one, 0.0), width=0.0, length=0.0, cfg=config)
        if one["kind"] == "plane"
        else builder.add_shape_sphere(-1, xform=_placed(one, 0.0), radius=one["radius"], cfg=config)
        for one in scene.obstacles("plane", "sphere")
    ]
    builder.add_soft_mesh(
        pos=wp.vec3(0.0, 0.0, 0.0),
        rot=wp.quat_identity(),
        scale=1.0,
        vel=wp.vec3(0.0, 0.0, 0.0),
        vertices=[wp.vec3(*point) for point in scene.points.tolist()],
        indices=scene.cells.ravel().tolist(),
        density=scene.density,
        k_mu=scene.mu,
        k_lambda=lame * scene.mu,
        k_damp=0.0,
        particle_radius=RADIUS,
    )
    for node in np.flatnonzero(scene.hung).tolist():
        builder.particle_mass[node] += float(scene.hung[node])
    for node in scene.held.tolist():
        builder.particle_mass[node] = 0.0
        builder.particle_flags[node] &= ~int(newton.ParticleFlags.ACTIVE)
    builder.color()
    model = builder.finalize(device="cpu")
    model.soft_contact_ke, model.soft_contact_kd, model.soft_contact_mu = penalty, 0.0, 0.0
    return model, shapes


def run(
    scene: SceneFolder,
    out: Path,
    *,
    step: float = STEP,
    sweeps: int = SWEEPS,
    lame: float = LAME,
    penalty: float = PENALTY,
    facets: bool = True,
) -> None:
    """Runs the scene with steps of `step` and hands it in; facets: whole facets touch, not nodes alone."""
    wp.config.quiet = True
    held = scene.held
    law = PlainStableNeoHookean(scene.points, scene.cells, scene.mu, lame * scene.mu)
    model, shapes = model_of(scene, lame, penalty)
    solver = newton.solvers.SolverVBD(model, iterations=sweeps, particle_enable_tile_solve=False)
    pipeline = newton.CollisionPipeline(model, enable_rigid_soft_full_surface_contact=facets)
    contacts, now, after, control = pipeline.contacts(), model.state(), model.state(), model.control()
    observed = solver.observables({solver.ObservableKind.CONTACT_F}, contacts=contacts)
    kept = 1.0 / (1.0 + step * scene.data["damping"]["rate"])
    positions, forces, sampled, spent = [scene.points], [0.0], [], 0.0
    steps = np.round(scene.times / step).astype(int)
    _step(solver, pipeline, contacts, now, after, control, step, observed)  # compiles; the body is at rest
    for begin, end in pairwise(steps):
        started = time.process_time()
        for step_number in range(begin + 1, end + 1):
            _place(model, shapes, scene, step_number * step)
            now.particle_q.numpy()[held] = after.particle_q.numpy()[held] = scene.held_at(step_number * step)
            watched = end - step_number < FORCES
            _step(solver, pipeline, contacts, now, after, control, step, observed if watched else None)
            after.particle_qd.numpy()[:] *= kept
            now, after = after, now
            if watched:
                sampled.append(_force(scene, contacts, observed, shapes, law, now))
        spent += time.process_time() - started
        positions.append(now.particle_q.numpy().astype(np.float64))
        forces.append(float(np.mean(sampled[-FORCES:])))
    cost = int(steps[-1]) * sweeps
    hand_in(out, scene.times, np.array(positions), np.array(forces), spent / scene.data["duration"], cost)


def _step(
    solver: Any, pipeline: Any, contacts: Any, now: Any, after: Any, control: Any, step: float, observed: Any
) -> None:
    now.clear_forces()
    pipeline.collide(now, contacts)
    solver.step(now, after, control, contacts, step, observables=observed)


def _placed(obstacle: dict[str, Any], t: float) -> Any:
    """An obstacle's place and turn at time t [s]: Newton's planes have their normal along z."""
    turn = turn_to(obstacle["normal"]) if obstacle["kind"] == "plane" else np.array([0.0, 0.0, 0.0, 1.0])
    return wp.transform(wp.vec3(*place(obstacle, t).tolist()), wp.quat(*turn.tolist()))


def _place(model: Any, shapes: list[int], scene: SceneFolder, t: float) -> None:
    transforms = model.shape_transform.numpy()
    for number, obstacle in zip(shapes, scene.data["obstacles"], strict=True):
        transforms[number] = np.array(_placed(obstacle, t))
    model.shape_transform.assign(transforms)


def _force(scene: SceneFolder, contacts: Any, observed: Any, shapes: list[int], law: Any, now: Any) -> float:
    """The probed force [N]: the sum of the contact forces between the body and the obstacle that is asked for, or what
    holds a region against the stresses."""
    if scene.probed_obstacle is None:
        inside = law.forces(now.particle_q.numpy().astype(np.float64))
        return scene.along(-inside[scene.probed_nodes].sum(axis=0))
    count = int(contacts.soft_contact_count.numpy()[0])
    first = contacts.rigid_contact_max
    wrenches = observed.contact_f.numpy()[first : first + count, :3]
    touching = contacts.soft_contact_shape.numpy()[:count] == shapes[scene.probed_obstacle]
    return abs(scene.along(wrenches[touching].sum(axis=0)))
