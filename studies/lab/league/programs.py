"""Other programs: their adapters, their environments, and what they hand in for an exported scene.

Each runs in a process and an environment of its own. Every attempt gives an entry of the league: a program that cannot
do a scene is skipped with its reason, and one that crashes or hangs has failed; the others go on.
"""

import json
import os
import subprocess
import sys
import venv
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from studies import Run, Scene, StudyError, export, judge
from studies.exchange.league import SET

ADAPTERS = Path(__file__).parent / "adapters"
CANNOT, MISSING = 3, 4
"""Exit codes of an adapter, as in scene_folder.py: it has no means for the scene; its package is not installed."""
TIME_LIMIT = 600.0
"""Of a run [s]; then its process is ended."""
ADAPTERS_NEED = ("numpy", "meshio")
"""Of what reads a scene in an environment."""
STAMP = "packages.txt"
"""What is installed in an environment, written last."""


@dataclass(frozen=True)
class Program:
    """Another program: its adapter, and the mesh that it computes on; or why it has no adapter."""

    name: str
    adapter: str = ""
    """File of the adapter below ADAPTERS."""
    mesh: str = "straight"
    packages: tuple[str, ...] = ()
    """What pip installs into its environment, the program itself first; without any it runs in that of organbench."""
    settings: Mapping[str, object] = field(default_factory=dict)
    """Keywords of its adapter: the best of the sweep (studies.lab.league.sweep)."""
    ours: bool = False
    absent: str = ""
    """The reason with which it is skipped."""

    @property
    def version(self) -> str:
        """Of the program, as it is asked for."""
        return self.packages[0].partition("==")[2] if self.packages else ""


PROGRAMS: tuple[Program, ...] = (
    Program("mujoco", "mujoco_flex.py", packages=("mujoco-core==4.0.1",), settings={"poisson": 0.45}),
    Program("felupe", "felupe_quadratic.py", "curved", packages=("felupe==11.3.0", "pypardiso")),
    Program("newton", "newton_vbd.py", packages=("newton==1.8.0", "warp-lang==1.19.0"), settings={"lame": 1.5}),
    Program("bullet", "bullet.py", packages=("pybullet==3.2.7",), settings={"lame": 1.5}),
    Program("drake", "drake_deformable.py", packages=("drake==1.51.1",), settings={"poisson": 0.4}),
    Program("sfepy", "sfepy_mixed.py", packages=("sfepy==2026.3",)),
    Program("sofa", absent="no wheel on PyPI; it comes as binaries of its own or by conda"),
    Program(
        "genesis",
        absent="genesis-world 1.4.5 meshes a surface itself; tetrahedra of a scene can only be put into its inner code",
    ),
    Program("torch-fem", absent="torch-fem 0.14.0 has no contact"),
)
OURS: tuple[Program, ...] = (
    Program("ours-quadratic", "own.py", "curved", (), {"method": "implicit_volume", "mass": "stiffness"}, ours=True),
    Program(
        "ours-corotated",
        "own.py",
        settings={"method": "implicit_elements", "law": "corotated", "dt": 0.02},
        ours=True,
    ),
    Program("ours-xpbd", "own.py", settings={"method": "xpbd_neo_hookean"}, ours=True),
)


@dataclass(frozen=True)
class Surroundings:
    """Where programs run, and how long."""

    folder: Path
    """For exported scenes and what is handed in."""
    environments: Path
    limit: float = TIME_LIMIT
    """[s]."""


def exported(scene: Scene, nodes: int, folder: Path) -> Path:
    """The exported scene in `folder`, which is written when it is first asked for."""
    given = folder / f"{scene.name}-{nodes}"
    if not given.exists():
        export(scene, given, nodes)
    return given


def entered(program: Program, scene: Scene, nodes: int, at: Surroundings, results: Path) -> Run:
    """Runs a program on a scene, and enters what it hands in, or why it hands in nothing, into the league of
    `results`. What does not fit the scene is a failure of the program."""
    given = exported(scene, nodes, at.folder)
    out = given / f"{program.name}.npz"
    end, reason = hand_over(program, given, out, at)
    entry = entry_of(program, nodes, given, out, {end: reason} if end else {"result": out.name})
    file = out.with_suffix(".entry.json")
    file.write_text(json.dumps(entry), encoding="utf-8")
    try:
        return judge(scene, file, results)
    except StudyError as problem:
        if end:
            raise
        entry = entry_of(program, nodes, given, out, {"failed": str(problem)})
        file.write_text(json.dumps(entry), encoding="utf-8")
        return judge(scene, file, results)


def entry_of(program: Program, nodes: int, given: Path, out: Path, end: dict[str, str]) -> dict[str, Any]:
    """The entry by file, with what the adapter wrote of itself, where it did."""
    report, data = out.with_suffix(".json"), json.loads((given / "scene.json").read_text(encoding="utf-8"))
    reported = json.loads(report.read_text(encoding="utf-8")) if report.is_file() else {}
    about = {
        "set": SET,
        "scene": data["name"],
        "engine": program.name,
        "version": program.version,
        "mesh": program.mesh,
        "nodes": nodes,
        "mesh_sha256": data["meshes"][program.mesh]["sha256"],
        "seconds": reported.pop("seconds", None),
        "evaluations": reported.pop("evaluations", None),
        "settings": dict(program.settings),
        "command": f"run.py {program.adapter} SCENE OUT {program.mesh} {json.dumps(dict(program.settings))}",
        "ours": program.ours,
    }
    return about | {"environment": reported} | end


def hand_over(program: Program, given: Path, out: Path, at: Surroundings) -> tuple[str, str]:
    """Runs the adapter on the folder of a scene: ("", ""), or "skipped" or "failed" and the reason."""
    name = program.name
    if program.absent:
        return "skipped", f"{name}: {program.absent}"
    try:
        python, path = python_of(name, program.packages, at.environments)
    except StudyError as problem:
        return "skipped", f"{name}: {problem}"
    out.with_suffix(".json").unlink(missing_ok=True)
    words = [ADAPTERS / program.adapter, given.resolve(), out.resolve(), program.mesh]
    try:
        ended = subprocess.run(
            [python, ADAPTERS / "run.py", *words, json.dumps(dict(program.settings))],
            capture_output=True,
            text=True,
            timeout=at.limit,
            cwd=given,  # programs write their logs where they run
            env=os.environ | {"PYTHONPATH": path, "OMP_NUM_THREADS": "1"},
        )
    except subprocess.TimeoutExpired:
        return "failed", f"{name} took longer than {at.limit:g} s"
    if ended.returncode == 0:
        return "", ""
    last = ([line for line in ended.stderr.splitlines() if line.strip()] or ["without a message"])[-1]
    if ended.returncode in (CANNOT, MISSING):
        return "skipped", f"{name}: {last}"
    return "failed", f"{name} ended with exit code {ended.returncode}: {last}"


def python_of(name: str, packages: Sequence[str], folder: Path) -> tuple[str, str]:
    """The interpreter for a program, made by venv and pip when it is first needed, and the PYTHONPATH of its adapter:
    nothing of ours may be found there. Without packages ours, and our path.

    Raises StudyError, with the last line of pip, where they cannot be installed.
    """
    if not packages:
        return sys.executable, os.pathsep.join(path or os.getcwd() for path in sys.path)
    home = (folder / name).resolve()
    python, stamp, listing = home / "bin" / "python", home / STAMP, "\n".join(packages)
    if not (stamp.is_file() and stamp.read_text(encoding="utf-8").strip() == listing):
        venv.create(home, with_pip=True)
        pip = [python, "-m", "pip", "install", "-q", *packages, *ADAPTERS_NEED]
        ended = subprocess.run(pip, capture_output=True, text=True)
        if ended.returncode != 0:
            last = ([line for line in ended.stderr.splitlines() if line.startswith("ERROR")] or ["no reason given"])[-1]
            raise StudyError(f"pip cannot install {' '.join(packages)} ({last.removeprefix('ERROR: ')})")
        stamp.write_text(listing, encoding="utf-8")
    return str(python), ""
