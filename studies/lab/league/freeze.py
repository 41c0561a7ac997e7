"""`python -m studies.lab.league.freeze SECRET`: the frozen set: hashes of its open and its held-back scenes.

SECRET is a folder outside of this repository. The held-back scenes are drawn there with seeds that nobody can guess,
and their references are solved, minutes each; the set holds only hashes. A folder that already has them is used as it
is.
"""

import hashlib
import json
import secrets
import sys
import tempfile
from pathlib import Path
from typing import Any

from studies import BALL_CLAMPED, BALL_SQUEEZE, KIDNEY_PROBE, LIVER_PRESS, LIVER_PROBE, Scene, export
from studies.exchange.league import FILE, SET
from studies.lab.population.draw import member
from studies.lab.references import write_file
from studies.reference.load import load_reference
from studies.reference.published import FOLDER, INDEX, physics
from studies.reference.reference_solves import ReferenceSolve
from studies.reference.solve import solve
from studies.scene.as_json import scene_to_json

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


def meshes_of(scene: Scene, least: int = 0) -> dict[str, str]:
    """ "straight-150" -> SHA-256, of all meshes that can be made."""
    hashes = {}
    for count in sorted({max(count, least) for count in NODES}):
        with tempfile.TemporaryDirectory() as folder:
            export(scene, Path(folder) / "scene", count)
            data = json.loads((Path(folder) / "scene" / "scene.json").read_text(encoding="utf-8"))
        hashes |= {f"{kind}-{count}": mesh["sha256"] for kind, mesh in data["meshes"].items()}
    return hashes


def open_scene(scene: Scene) -> dict[str, Any]:
    """Its entry in the set, by its published reference."""
    one = json.loads((FOLDER / INDEX).read_text(encoding="utf-8"))["references"][scene.name]
    bars = {
        name: round(100.0 * one["relative bars"][quantity], 6)
        for name, quantity in JUDGED_BY.items()
        if quantity in one["relative bars"]
    }
    return {"reference": one["sha256"], "physics": one["physics"], "bars": bars, "meshes": meshes_of(scene)}


def held_back(organ: str, folder: Path) -> dict[str, Any]:
    """Draws and solves the scene below `folder`, where it is missing; its entry in the set."""
    place = folder / organ
    place.mkdir(parents=True, exist_ok=True)
    seed, file = place / "seed.txt", place / "reference.h5"
    if not seed.exists():
        seed.write_text(str(secrets.randbits(SEED_BITS)), encoding="utf-8")
    scene = member(organ, int(seed.read_text(encoding="utf-8")), 0)
    (place / "scene.json").write_text(scene_to_json(scene), encoding="utf-8")
    if not file.exists():
        solve(place / "solved", ReferenceSolve(scene))
        reference = load_reference(place / "solved", scene)
        assert reference is not None  # members have a plan
        write_file(file, reference.record)
    digest = hashlib.sha256(file.read_bytes()).hexdigest()
    return {"reference": digest, "physics": physics(scene), "meshes": meshes_of(scene, LEAST.get(organ, 0))}


def main(secret: Path) -> None:
    """Writes the set into the package."""
    data = {
        "set": SET,
        "open": {scene.name: open_scene(scene) for scene in OPEN},
        "held back": {f"held_{organ}": held_back(organ, secret) for organ in HELD_BACK},
    }
    FILE.write_text(json.dumps(data, indent=1) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main(Path(sys.argv[1]))
