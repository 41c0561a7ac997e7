"""Adapter for our methods on the same exported meshes, with results evaluated as those of other programs."""

import time
from dataclasses import replace
from pathlib import Path
from typing import Literal

import numpy as np

from massspring import METHODS, simulate
from studies.base.lookup import lookup
from studies.exchange.meshes import given_mesh
from studies.exchange.peers.scene_folder import SceneFolder, hand_in
from studies.runs.case import Case
from studies.runs.prepare import prepare
from studies.runs.run import checkpoint_frames
from studies.scene.library import CUT, SCENES


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

    mass: of a quadratic body (studies.runs.case.BodyRecipe). dt: length of steps and frames [s]; default: the usual
    share of the stability limit.
    """
    own_scene = lookup(scene.data["name"], {one.name: one for one in (*SCENES, *CUT)}, "scene")
    own_scene = replace(own_scene, checkpoints=tuple(float(t) for t in scene.times[1:]))
    kind = lookup(method, {one.name: one for one in METHODS}, "method")(**settings)
    recipe = given_mesh(own_scene, int(scene.data["meshes"]["straight"]["outer_nodes"]), scene.mesh).recipe
    recipe = replace(recipe, mass=mass)
    if kind.capabilities.keeps == "elements":
        recipe = replace(recipe, law="cotangent", volumes="nodal")  # springs without length, one volume per node
    case = Case(own_scene, recipe, kind)
    if dt is not None:
        case = replace(case, dt=dt, frames=round(own_scene.duration / dt))
    if own_scene.cut is not None:  # our bodies are cut in a run: after its first frame
        first = own_scene.duration / (case.frames or own_scene.frames)
        case = case.replaced(scene=replace(own_scene, cuts=(replace(own_scene.cut, at=first),)))
    prepared = prepare(case)
    simulate(prepared.setup, time_limit=0.0)  # compiles, and ends after a frame
    at = checkpoint_frames(case, prepared)
    started = time.process_time()
    history = simulate(prepared.setup, at)
    spent = time.process_time() - started
    if history.outcome != "finished":
        raise RuntimeError(history.message)
    force = own_scene.output_force(history.contact_force, history.held_force)
    positions = np.concatenate([prepared.body.rest[None], history.snapshots])
    forces = np.concatenate([[0.0], force[[frame - 1 for frame in at]]])
    clock = prepared.setup.clock
    count = None if "implicit_elements" in method else clock.steps * clock.frames  # passes of a step are not counted
    hand_in(out, scene.times, positions, forces, spent / own_scene.duration, count)
