"""What references of real organs can judge: `python -m studies.bench.scan_references FILE ... [--fine]`.

Each organ is held at one end and lifted at the other, pressed by a plane, and palpated by a sphere, all placed by rule.
"""

import argparse
import sys
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np

from massspring import Plane, Trajectory
from studies.base.errors import StudyError
from studies.catalog.population.folder import DURATION, NODES, PLAN, placed_scene
from studies.geometry import HalfSpace, OrganMesh, scan
from studies.geometry.files.units import Source
from studies.geometry.mesh.organ_mesh import triangle_areas
from studies.reference.load import Reference
from studies.scene.chosen_place import vector
from studies.scene.placing import scaled
from studies.scene.proposal import HELD, Proposal, proposal
from studies.scene.scene import ForceOutput, Held, Scene
from studies.scene.scene_file import python_name
from studies.tools.verify.second_judge import reference_of

PRESSED_IN, LIFTED = 0.1, 0.15
"""Travel of a plane, of the depth along its path, and of the free end, of the length of the organ."""
GAP = 0.002
"""Between plane and body at the start, of the depth along the path."""
UNTIL = 0.6 * DURATION
"""When nothing moves any more [s]."""
LOADS = ("lifted", "pressed", "probed")
FINE = 100e3
"""Unknowns of `--fine`, for organs with thin margins."""


def scan_scenes(path: Path, unit: str = "mm") -> dict[str, Scene]:
    """The three scenes of the organ in a file, by load. Raises StudyError where it cannot be meshed or placed."""
    source, name = Source(path.absolute(), unit), python_name(path.stem)
    mesh = scan(source, NODES, fill=False)
    placing = proposal(mesh)
    probed = placed_scene(f"{name}_probed", source, placing)
    scenes = lifted(probed, mesh, placing), pressed(probed, mesh, placing), probed
    return {load: replace(one, name=f"{name}_{load}") for load, one in zip(LOADS, scenes, strict=True)}


def pressed(probed: Scene, mesh: OrganMesh, placing: Proposal) -> Scene:
    """The same organ pressed by a plane that comes as the probe does."""
    inward = scaled(placing.palpation.normal, -1.0)
    ways = mesh.points[: mesh.outer_count] @ np.asarray(inward)
    depth = float(np.ptp(ways))
    path = Trajectory((0.0, UNTIL), ((0.0, 0.0, 0.0), scaled(inward, (PRESSED_IN + GAP) * depth)))
    plane = Plane(scaled(inward, float(ways.min()) - GAP * depth), inward, path)
    title = f"{mesh.name}: held at one end, pressed by a plane from the side"
    plan = replace(PLAN, at_contact=0)
    return replace(probed, title=title, obstacles=(plane,), reference=plan, probed=ForceOutput("obstacle", 0, inward))


def lifted(probed: Scene, mesh: OrganMesh, placing: Proposal) -> Scene:
    """The same organ without a probe, its free end grasped as much as the other is held, and lifted across its length,
    along its shortest axis."""
    centres, areas = mesh.points[mesh.outer_triangles].mean(axis=1), triangle_areas(mesh.points, mesh.outer_triangles)
    assert isinstance(placing.hold, HalfSpace)  # by rule, not at a point
    away = np.asarray(placing.hold.normal)
    order = np.argsort(-(centres @ away))
    last = centres[order[int(np.searchsorted(np.cumsum(areas[order]) / areas.sum(), HELD))]]
    up = placing.axes[2]
    path = Trajectory((0.0, UNTIL), ((0.0, 0.0, 0.0), scaled(up, LIFTED * placing.sides[0])))
    grasp = Held("grasp", HalfSpace(vector(last), vector(-away)), path)
    title, held = f"{mesh.name}: held at one end, lifted at the other", (*probed.held, grasp)
    plan = replace(PLAN, at_contact=0)
    return replace(probed, title=title, obstacles=(), held=held, reference=plan, probed=ForceOutput("held", 1, up))


def row(scene: Scene, reference: Reference) -> str:
    """A reference as a row: its uncertainty [%], force on each mesh [N], unknowns and seconds."""
    family = reference.meshes[::-1]
    forces = " / ".join(f"{one.force[-1]:.4g}" for one in family)
    unknowns = " / ".join(f"{one.unknowns:,}" for one in family)
    bars = reference.total_uncertainty
    shares = f"{100 * bars['force_end']:8.2f} %  {100 * bars['surface_mean']:9.2f} %"
    seconds = float(reference.record.attributes["seconds"])
    return f"{scene.name:28}  {shares}  {forces:28}  {unknowns:24}  {seconds:5.0f}"


def refined(scene: Scene) -> Scene:
    """The scene with its reference on finer meshes."""
    assert scene.reference is not None  # all of these scenes have a plan
    return replace(scene, reference=replace(scene.reference, most=FINE))


def rows(root: Path, paths: list[Path], loads: list[str], fine: bool = False) -> Iterator[str]:
    """A row for every scene, as soon as it is solved; of one that fails, its sentence. fine: on finer meshes."""
    for path in paths:
        try:
            scenes = scan_scenes(path)
        except StudyError as error:
            yield f"{path.stem:28}  {error}"
            continue
        for load in loads:
            scene = refined(scenes[load]) if fine else scenes[load]
            try:
                yield row(scene, reference_of(root, scene))
            except StudyError as error:
                yield f"{scene.name:28}  {error}"


def main(words: list[str]) -> int:
    """Print the table; exit code 2 without a file."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("files", nargs="+", type=Path)
    parser.add_argument("--root", type=Path, default=Path("results"))
    parser.add_argument("--loads", nargs="+", default=list(LOADS), choices=LOADS)
    parser.add_argument("--fine", action="store_true", help=f"references of up to {FINE:g} unknowns")
    given = parser.parse_args(words)
    print(f"{'scene':28}  force_end   mean_error  force [N]                     unknowns                  seconds")
    for line in rows(given.root, given.files, given.loads, given.fine):
        print(line, flush=True)
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
