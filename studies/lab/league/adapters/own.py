"""Adapter for our methods on the same exported meshes, with results evaluated as those of other programs."""

import time
from dataclasses import replace
from pathlib import Path
from typing import Any, Literal

import numpy as np
from scene_folder import SceneFolder, hand_in

from massspring import METHODS, simulate
from studies import SCENES, Case, QuadraticBody, TetrahedralBody
from studies.runs.prepare import prepare


def run(
    scene: SceneFolder,
    out: Path,
    *,
    method: str,
    dt: float | None = None,
    mass: Literal["lumped", "stiffness"] = "lumped",
    **settings: object,
) -> None:
    """Runs the scene by a method with its settings and hands it in.

    mass: as in studies.QuadraticBody. dt: length of steps and frames [s]; default: the usual share of the stability
    limit.
    """
    own_scene = {one.name: one for one in SCENES}[scene.data["name"]]
    own_scene = replace(own_scene, checkpoints=tuple(float(t) for t in scene.times[1:]))
    kind = {one.name: one for one in METHODS}[method](**settings)
    body = QuadraticBody if scene.mesh == "curved" else TetrahedralBody
    chosen: dict[str, Any] = {} if mass == "lumped" else {"mass": mass}
    if kind.capabilities.keeps == "elements":
        chosen |= {"law": "cotangent", "volumes": "nodal"}  # springs without length, one volume per node
    recipe = body(int(scene.data["meshes"][scene.mesh]["outer_nodes"]), **chosen)
    case = Case(own_scene, recipe, kind)
    if dt is not None:
        case = replace(case, dt=dt, frames=round(own_scene.duration / dt))
    prepared = prepare(case)
    simulate(prepared.setup, time_limit=0.0)  # compiles, and ends after a frame
    clock = prepared.setup.clock
    at = [min(clock.frames, max(1, round(t / clock.frame))) for t in own_scene.checkpoints]
    started = time.process_time()
    history = simulate(prepared.setup, at)
    spent = time.process_time() - started
    if history.outcome != "finished":
        raise RuntimeError(history.message)
    force = own_scene.output_force(history.contact_force, history.held_force)
    positions = np.concatenate([prepared.body.rest[None], history.snapshots])
    forces = np.concatenate([[0.0], force[[frame - 1 for frame in at]]])
    count = None if "implicit_elements" in method else clock.steps * clock.frames  # passes of a step are not counted
    hand_in(out, scene.times, positions, forces, spent / own_scene.duration, count)
