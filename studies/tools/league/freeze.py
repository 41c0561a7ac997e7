"""`python -m studies.tools.league.freeze SECRET`: the frozen set: hashes of its open and its held-back scenes.

SECRET is a folder outside of this repository. The held-back scenes are drawn there with seeds that nobody can guess,
and their references are solved; the set holds only hashes. A folder that already has them is used as it is.
"""

import hashlib
import json
import secrets
from pathlib import Path
from typing import Annotated, Any

import typer

from studies.base.errors import StudyError
from studies.catalog.population.draw import member
from studies.exchange.league.frozen import FILE, SET, mesh_key
from studies.exchange.meshes import given_meshes
from studies.reference.load import load_reference
from studies.reference.published import FOLDER, INDEX, physics, published, write_file
from studies.reference.reference_solves import ReferenceSolve
from studies.reference.solve import solve
from studies.scene.as_json import scene_to_json
from studies.scene.library import BALL_CLAMPED, BALL_SQUEEZE, KIDNEY_PROBE, LIVER_PRESS, LIVER_PROBE
from studies.scene.scene import Scene

OPEN = (BALL_SQUEEZE, BALL_CLAMPED, LIVER_PRESS, LIVER_PROBE, KIDNEY_PROBE)
HELD_BACK = ("liver", "kidney", "stomach")
"""Organs of populations whose scenes are held back."""
NODES = (150, 300)
"""Vertices on the outer surface of the meshes on which results are handed in."""
LEAST = {"stomach": 400}
"""Of organs that cannot be meshed with fewer."""
JUDGED_BY = {"force_end": "force_end", "mean_error": "surface_mean"}
"""Metric of the profiles -> quantity of the reference."""
SEED_BITS = 64


def meshes_of(scene: Scene, nodes: tuple[int, ...] = NODES) -> dict[str, str]:
    """ "straight-150" -> digest, of all meshes that can be made."""
    made = [(count, mesh) for count in nodes for mesh in given_meshes(scene, count)[0]]
    return {mesh_key(mesh.kind, count): mesh.digest for count, mesh in made}


def open_scene(scene: Scene) -> dict[str, Any]:
    """Its entry in the set. Raises StudyError for a scene without a published reference."""
    entry = published(scene)
    if entry is None:
        raise StudyError(f"{scene.name} has no published reference")
    relative = json.loads((FOLDER / INDEX).read_text(encoding="utf-8"))["references"][scene.name]["relative bars"]
    bars = {name: round(100.0 * relative[quantity], 6) for name, quantity in JUDGED_BY.items() if quantity in relative}
    return {"reference": entry.sha256, "physics": physics(scene), "bars": bars, "meshes": meshes_of(scene)}


def held_back(organ: str, folder: Path, solved: bool) -> dict[str, Any]:
    """Draws and, if `solved`, solves the scene below `folder`, where it is missing; its entry in the set."""
    place = folder / organ
    place.mkdir(parents=True, exist_ok=True)
    seed, file = place / "seed.txt", place / "reference.h5"
    if not seed.exists():
        seed.write_text(str(secrets.randbits(SEED_BITS)), encoding="utf-8")
    scene = member(organ, int(seed.read_text(encoding="utf-8")), 0)
    (place / "scene.json").write_text(scene_to_json(scene), encoding="utf-8")
    if solved and not file.exists():
        solve(place / "solved", ReferenceSolve(scene))
        reference = load_reference(place / "solved", scene)
        assert reference is not None  # members have a plan
        write_file(file, reference.record)
    digest = hashlib.sha256(file.read_bytes()).hexdigest() if file.exists() else ""
    nodes = tuple(max(count, LEAST.get(organ, 0)) for count in NODES)
    return {"reference": digest, "physics": physics(scene), "meshes": meshes_of(scene, nodes)}


def main(
    secret: Path,
    solved: Annotated[bool, typer.Option(help="solve the references that are missing, minutes each")] = True,
) -> None:
    """Writes the set into the package; a reference that is not solved has no hash in it."""
    data = {
        "set": SET,
        "open": {scene.name: open_scene(scene) for scene in OPEN},
        "held back": {f"held_{organ}": held_back(organ, secret, solved) for organ in HELD_BACK},
    }
    FILE.write_text(json.dumps(data, indent=1) + "\n", encoding="utf-8")
    typer.echo(f"{FILE}: {len(OPEN)} open scenes, {len(HELD_BACK)} held back")


if __name__ == "__main__":
    typer.run(main)
