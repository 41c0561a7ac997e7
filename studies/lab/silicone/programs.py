"""Other programs let the silicone beam go: each gets it as a folder, as it gets a scene, with the masses at its tip."""

import json
from pathlib import Path
from typing import Any

import meshio
import numpy as np

from studies import StudyError
from studies.lab.league.programs import Program, Surroundings, hand_over
from studies.lab.silicone.beam import DENSITY, POISSON, SIDE, Beam, glued, hung, marker_sag, shear_modulus
from studies.lab.silicone.chart import Point
from studies.lab.silicone.measured import GRAVITY, Load, swing_of
from studies.lab.silicone.predict import DURATION, fitted_damping

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
    meshio.write(folder / "straight.vtu", meshio.Mesh(points, {"tetra": cells}, marks))
    mu, frames = shear_modulus(youngs), round(duration / FRAME)
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
        "held": [{"point_data": "held_glued", "path": {"times": [0.0], "displacements": [[0.0, 0.0, 0.0]]}}],
        "masses": [
            {"node": int(node), "mass": float(share)} for node, share in zip(where, shares, strict=True) if share > 0.0
        ],
        "lumen": None,
        "start": {"speed": None},
        "cut": None,
        "force": {"of": "held", "number": 0, "direction": [0.0, 0.0, 1.0]},
    }
    (folder / "scene.json").write_text(json.dumps(data), encoding="utf-8")


def program_row(program: Program, load: Load, youngs: float, at: Surroundings) -> Point:
    """The result of a program for a load. Raises StudyError with the reason where it has none."""
    given, out = at.folder / load.name.replace(" ", "_"), at.folder / f"{program.name}.npz"
    write_beam(given, MESH, youngs, load, fitted_damping(), DURATION)
    settings = dict(program.settings) | STEPS.get(program.name, {})
    contender = Program(program.name, program.adapter, "straight", program.packages, settings, absent=program.absent)
    end, reason = hand_over(contender, given, out, at)
    if end:
        raise StudyError(reason)
    arrays = np.load(out, allow_pickle=False)
    swing = swing_of(arrays["t"], marker_sag(arrays["positions"][0], arrays["positions"]).mean(axis=1))
    return Point(program.name, load.newton, 1e3 * swing.sag, swing.frequency, swing.damping)
