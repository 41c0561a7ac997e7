"""`python -m studies.tools.silicone.peers`: other programs let the silicone beam go: silicone.csv and its chart.

Each gets the beam as a folder, as it gets a scene: `scene.json` has the masses at the tip too.
"""

import json
import sys
import tempfile
from collections.abc import Sequence
from pathlib import Path
from typing import Annotated, Any

import numpy as np
import typer

from studies.base.errors import StudyError
from studies.base.lookup import lookup
from studies.exchange.peers.contest import PEERS, Attempt, Peer, hand_over
from studies.geometry.files.writing import write_grid_file
from studies.plots.silicone import Point, draw
from studies.scene.library import BALL_CLAMPED
from studies.store.record import Status
from studies.tools.silicone.beam import DENSITY, POISSON, SIDE, Beam, glued, hung, marker_sag, shear_modulus
from studies.tools.silicone.main import bars
from studies.tools.silicone.measured import GRAVITY, LOADS, Load
from studies.tools.silicone.predict import DURATION, FINE, fitted_damping, fitted_youngs
from studies.tools.silicone.swing import swing_of
from studies.tools.silicone.table import read_table, write_table

FRAME = 0.01
"""Between the moments that are handed in [s]."""
MESH = Beam(5, 16)
"""That of our own linear elements."""
STEPS: dict[str, dict[str, Any]] = {"mujoco": {"step": 2e-4}, "newton": {"step": 1e-3, "sweeps": 20}}
"""Shorter than for organs: an implicit step damps as well, and here damping is judged."""
LIMIT = 1800.0
"""Of a run [s]."""


def write_beam(folder: Path, beam: Beam, youngs: float, load: Load, damping: float, duration: float) -> None:
    """The beam with E = `youngs` [Pa] and what hangs at its tip, damped by `damping` [1/s], as an exported scene."""
    points, cells = beam.corners
    where, shares = hung(points, load.mass, SIDE)
    marks = {"outer": np.ones(len(points), int), "held_glued": glued(points).astype(int)}
    folder.mkdir(parents=True, exist_ok=True)
    write_grid_file(folder / "straight.vtu", points, {"tetra": cells}, marks)
    mu, frames = shear_modulus(youngs), round(duration / FRAME)
    stays = {"times": [0.0], "displacements": [[0.0, 0.0, 0.0]]}
    data = {
        "name": "beam_release",
        "meshes": {"straight": {"file": "straight.vtu"}},
        "material": {
            "shear_modulus": mu,
            "bulk_modulus": mu * 2.0 * (1.0 + POISSON) / (3.0 * (1.0 - 2.0 * POISSON)),
            "density": DENSITY,
        },
        "checkpoints": [round(FRAME * number, 9) for number in range(1, frames + 1)],
        "duration": duration,
        "gravity": [0.0, 0.0, -GRAVITY],
        "damping": {"rate": damping},
        "obstacles": [],
        "held": [{"point_data": "held_glued", "path": stays}],
        "masses": [
            {"node": int(node), "mass": float(share)} for node, share in zip(where, shares, strict=True) if share > 0.0
        ],
        "lumen": None,
        "start": {"speed": None},
        "cut": None,
        "force": {"of": "held", "number": 0, "direction": [0.0, 0.0, 1.0]},
    }
    (folder / "scene.json").write_text(json.dumps(data), encoding="utf-8")


def peer_row(peer: Peer, load: Load, youngs: float, folder: Path, environments: Path) -> Point:
    """The result of a program for a load. Raises StudyError with the reason where it has none."""
    if peer.absent:
        raise StudyError(f"{peer.name}: {peer.absent}")
    given, out = folder / load.name.replace(" ", "_"), folder / f"{peer.name}.npz"
    write_beam(given, MESH, youngs, load, fitted_damping(), DURATION)
    contender = Peer(peer.name, peer.module, "straight", peer.packages, dict(peer.settings) | STEPS.get(peer.name, {}))
    status, message = hand_over(Attempt(contender, BALL_CLAMPED, 0), given, out, LIMIT, environments)
    if status != Status.OK:
        raise StudyError(message)
    arrays = np.load(out, allow_pickle=False)
    swing = swing_of(arrays["t"], marker_sag(arrays["positions"][0], arrays["positions"]).mean(axis=1))
    return Point(peer.name, load.newton, 1e3 * swing.sag, swing.frequency, swing.damping)


def main(
    results: Annotated[Path, typer.Option(help="folder of the results")] = Path("results"),
    environments: Annotated[Path | None, typer.Option(help="folder of the programs' environments")] = None,
    youngs: Annotated[float | None, typer.Option(help="E [Pa]; default: fitted to the unloaded beam")] = None,
    only: Annotated[str, typer.Option(help="one program by its name")] = "",
) -> None:
    """Puts the rows of programs into silicone.csv, in place of those they have there, and draws the chart again; what
    fails is reported on standard error. `python -m studies.tools.silicone.main` makes the table first. Raises
    StudyError for an unknown program, without the table, and where no program releases the beam."""
    if only:
        lookup(only, [peer.name for peer in PEERS], "program (--only)")
    table, written = results / "silicone" / "silicone.csv", 0
    if not table.is_file():
        raise StudyError(f"there is no table {table} to add rows to; `python -m studies.tools.silicone.main` makes it")
    rows = read_table(table)
    stiff = youngs if youngs is not None else fitted_youngs(FINE)
    with tempfile.TemporaryDirectory() as folder:
        for peer in (one for one in PEERS if only in ("", one.name)):
            for load in LOADS:
                try:
                    row = peer_row(peer, load, stiff, Path(folder), environments or results / "cache" / "environments")
                except StudyError as problem:
                    print(f"{peer.name}, {load.newton:g} N: {problem}", file=sys.stderr, flush=True)
                    break
                rows = with_row(rows, row)
                write_table(table, rows)
                print(f"{row.who}, {row.newton:g} N: {row.sag:.2f} mm, {row.frequency:.3f} Hz, {row.damping:.4f}")
                written += 1
    if not written:
        raise StudyError("no program released the beam; the lines above say why")
    draw(rows, bars(), table.with_suffix(".png"))


def with_row(rows: Sequence[Point], row: Point) -> list[Point]:
    """`rows` and the row, in place of one of the same program and load."""
    return [*(one for one in rows if (one.who, one.newton) != (row.who, row.newton)), row]


if __name__ == "__main__":
    try:
        typer.run(main)
    except StudyError as problem:
        print(f"silicone: {problem}", file=sys.stderr)
        sys.exit(2)
