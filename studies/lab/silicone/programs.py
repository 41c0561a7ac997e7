"""Other programs let the silicone beam go, with the masses at its tip, and press the silicone cylinder: each gets both
as a folder, as it gets a scene."""

import json
from collections.abc import Iterator, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import meshio
import numpy as np

from studies import StudyError
from studies.lab.league.programs import Program, Surroundings, hand_over
from studies.lab.silicone.beam import DENSITY, POISSON, SIDE, Beam, glued, hung, marker_sag, shear_modulus
from studies.lab.silicone.chart import Point
from studies.lab.silicone.cylinder import (
    BULK,
    FINE,
    HEIGHT,
    MODULUS,
    RADIUS,
    Contestant,
    body_curve,
    eighths,
    reference_curves,
    sliding,
    whole,
)
from studies.lab.silicone.measured import GRAVITY, Load, swing_of
from studies.lab.silicone.predict import DURATION, fitted_damping

FRAME = 0.01
"""Between the moments that are handed in [s]."""
MESH = Beam(5, 16)
"""That of our own linear elements."""
STEPS: dict[str, dict[str, Any]] = {"mujoco": {"step": 2e-4}, "newton": {"step": 1e-3, "sweeps": 20}}
"""Shorter than for organs: an implicit step damps as well, and for the beam damping is judged."""
LIMIT = 1800.0
"""Of a run [s]."""
CELLS = {"straight": FINE, "curved": (3, 3)}
"""Bricks of an eighth of the cylinder: 1,089 nodes of linear elements, 2,197 of quadratic ones."""
QUADRATIC = "felupe", "sfepy"
"""Programs with quadratic elements; the second on straight ones."""
PRESSED, PRESS = (0.1, 0.2, 0.3, 0.4), 4.0
"""Compressions that are judged, and time to the last [s]: the cylinder's inertia is 1e-4 of the force."""
SLOW = 10.0
"""Damping of the cylinder [1/s], which takes .1 % of the force."""
TETRAHEDRA = {4: "tetra", 10: "tetra10"}
STILL = {"times": [0.0], "displacements": [[0.0, 0.0, 0.0]]}


def write_scene(
    folder: Path, name: str, points: np.ndarray, cells: np.ndarray, held: dict[str, tuple[np.ndarray, Any]], **rest: Any
) -> None:
    """An exported scene with one mesh, `rest` in its description; held: name -> which points, and their path."""
    mesh = "straight" if cells.shape[1] == 4 else "curved"
    marks: dict[str, Any] = {"outer": np.ones(len(points), int)}
    for one, (which, _) in held.items():
        marks[f"held_{one}"] = which.astype(int)
    folder.mkdir(parents=True, exist_ok=True)
    meshio.write(folder / f"{mesh}.vtu", meshio.Mesh(points, {TETRAHEDRA[cells.shape[1]]: cells}, marks))
    data = {
        "name": name,
        "meshes": {mesh: {"file": f"{mesh}.vtu"}},
        "obstacles": [],
        "held": [{"point_data": f"held_{one}", "path": path} for one, (_, path) in held.items()],
        "lumen": None,
        "start": {"speed": None},
        "cut": None,
    }
    (folder / "scene.json").write_text(json.dumps(data | rest), encoding="utf-8")


def write_beam(folder: Path, beam: Beam, youngs: float, load: Load, damping: float, duration: float) -> None:
    """The beam with E = `youngs` [Pa] and what hangs at its tip, damped by `damping` [1/s]."""
    points, cells = beam.corners
    where, shares = hung(points, load.mass, SIDE)
    weights, mu = zip(where, shares, strict=True), shear_modulus(youngs)
    write_scene(
        folder,
        "beam_release",
        points,
        cells,
        {"glued": (glued(points), STILL)},
        material={
            "shear_modulus": mu,
            "bulk_modulus": mu * 2.0 * (1.0 + POISSON) / (3.0 * (1.0 - 2.0 * POISSON)),
            "density": DENSITY,
        },
        checkpoints=[round(FRAME * number, 9) for number in range(1, round(duration / FRAME) + 1)],
        duration=duration,
        gravity=[0.0, 0.0, -GRAVITY],
        damping={"rate": damping},
        masses=[{"node": int(node), "mass": float(share)} for node, share in weights if share > 0.0],
        force={"of": "held", "number": 0, "direction": [0.0, 0.0, 1.0]},
    )


def write_cylinder(folder: Path, mesh: str, bricks: tuple[int, int]) -> None:
    """The cylinder between bonded plates that close by the last of PRESSED."""
    points, cells = whole(bricks) if mesh == "curved" else eighths(bricks)
    way, held = 0.5 * PRESSED[-1] * HEIGHT, {}
    for name, sign in (("top", 1.0), ("bottom", -1.0)):
        path = {"times": [0.0, PRESS], "displacements": [[0.0, 0.0, 0.0], [0.0, 0.0, -sign * way]]}
        held[name] = (sign * points[:, 2] > 0.5 * HEIGHT - 1e-9, path)
    write_scene(
        folder,
        "cylinder_press",
        points,
        cells,
        held,
        material={"shear_modulus": MODULUS, "bulk_modulus": BULK * MODULUS, "density": DENSITY},
        checkpoints=[PRESS * one / PRESSED[-1] for one in PRESSED],
        duration=PRESS,
        gravity=[0.0, 0.0, 0.0],
        damping={"rate": SLOW},
        force={"of": "held", "number": 0, "direction": [0.0, 0.0, -1.0]},
    )


def arrays_of(program: Program, given: Path, out: Path, at: Surroundings) -> dict[str, np.ndarray]:
    """What a program hands in for a folder. Raises StudyError with the reason where it hands in nothing."""
    end, reason = hand_over(program, given, out, at)
    if end:
        raise StudyError(reason)
    return dict(np.load(out, allow_pickle=False))


def press_rows(programs: Sequence[Program], at: Surroundings) -> Iterator[dict[str, Any]]:
    """Of our quadratic body and of each program: nodes, processor seconds for a simulated one, and the errors of the
    force of the cylinder between bonded plates at PRESSED against the reference [%], or why there are none."""
    moments = np.array(PRESSED)

    def row(name: str, nodes: int, spent: float, factors: np.ndarray) -> dict[str, Any]:
        errors = 100.0 * (factors / exact - 1.0)
        named = {f"at {100 * c:.0f} % [%]": error for c, error in zip(PRESSED, errors, strict=True)}
        return {"who": name, "nodes": nodes, "cost [s/s]": spent} | named

    exact = reference_curves((10, 8), moments, "bonded")[0]
    ours, known = Contestant("quadratic, a volume per vertex", CELLS["curved"], "bonded"), np.linspace(0.02, 0.54, 27)
    own = np.interp(moments, known, body_curve(ours, known))
    yield row(ours.name, len(whole(ours.cells)[0]), np.nan, own)
    for program in programs:
        given, out = at.folder / f"cylinder-{program.name}", at.folder / f"{program.name}.npz"
        write_cylinder(given, program.mesh, CELLS["curved" if program.name in QUADRATIC else program.mesh])
        settings = dict(program.settings) | STEPS.get(program.name, {})
        try:
            arrays = arrays_of(replace(program, settings=settings), given, out, at)
        except StudyError as problem:
            yield {"who": program.name, "message": str(problem)}
            continue
        factors = arrays["force"][1:] / (MODULUS * np.pi * RADIUS**2) / sliding(moments)
        spent = json.loads(out.with_suffix(".json").read_text(encoding="utf-8"))["seconds"]
        yield row(program.name, arrays["positions"].shape[1], spent, factors)


def program_row(program: Program, load: Load, youngs: float, at: Surroundings) -> Point:
    """The result of a program for a load. Raises StudyError with the reason where it has none."""
    given, out = at.folder / load.name.replace(" ", "_"), at.folder / f"{program.name}.npz"
    write_beam(given, MESH, youngs, load, fitted_damping(), DURATION)
    settings = dict(program.settings) | STEPS.get(program.name, {})
    arrays = arrays_of(replace(program, mesh="straight", settings=settings), given, out, at)
    swing = swing_of(arrays["t"], marker_sag(arrays["positions"][0], arrays["positions"]).mean(axis=1))
    return Point(program.name, load.newton, 1e3 * swing.sag, swing.frequency, swing.damping)
