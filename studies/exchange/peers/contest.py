"""Runs other programs on exported scenes, each in a process of its own, and judges what they hand in.

Whatever happens is an entry: a program that cannot do a scene is skipped with its reason, one that crashes or hangs has
a row that says so, and the rest goes on.
"""

import json
import os
import subprocess
import sys
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

from studies.base.errors import StudyError
from studies.exchange.entry import HALF_STEP, entry_path, outside
from studies.exchange.export import export
from studies.exchange.judge import entry_record, unfinished_record
from studies.exchange.meshes import given_mesh
from studies.exchange.peers.scene_folder import CANNOT, MISSING
from studies.runs.case import Case
from studies.scene.scene import Scene
from studies.store.record import Record, Status, write_record

TIME_LIMIT = 600.0
"""Of a run [s]; then its process is ended."""


@dataclass(frozen=True)
class Peer:
    """Another program: its adapter, and the mesh that it computes on; or why it has no adapter."""

    name: str
    module: str = ""
    mesh: str = "straight"
    absent: str = ""
    """The reason with which it is skipped."""


PEERS: tuple[Peer, ...] = (
    Peer("mujoco", "studies.exchange.peers.mujoco_flex"),
    Peer("felupe", "studies.exchange.peers.felupe_quadratic", "curved"),
    Peer("newton", "studies.exchange.peers.newton_vbd"),
    Peer("bullet", "studies.exchange.peers.bullet"),
    Peer("sofa", absent="no wheel on PyPI, from which the extra installs; it comes as binaries of its own or by conda"),
)


@dataclass(frozen=True)
class Attempt:
    """A program on a scene."""

    peer: Peer
    scene: Scene
    nodes: int
    shorter: float = 1.0

    @property
    def name(self) -> str:
        """Of the entry."""
        return self.peer.name if self.shorter == 1.0 else self.peer.name + HALF_STEP


def contest(root: Path, attempts: Sequence[Attempt], folder: Path, limit: float = TIME_LIMIT) -> Iterator[Record]:
    """Makes all attempts, in a `folder` for exported scenes and what is handed in, and stores each below `root`.

    Raises StudyError where a scene cannot be exported or a record cannot be written.
    """
    for attempt in attempts:
        given = folder / f"{attempt.scene.name}-{attempt.nodes}"
        if not given.exists():
            export(attempt.scene, given, attempt.nodes)
        record = judged(attempt, given, limit)
        recipe = given_mesh(attempt.scene, attempt.nodes, attempt.peer.mesh).recipe
        write_record(entry_path(root, Case(attempt.scene, recipe, outside(attempt.name))), record)
        yield record


def judged(attempt: Attempt, given: Path, limit: float) -> Record:
    """What came of an attempt on an exported scene."""
    out = given / f"{attempt.name}.npz"
    status, message = hand_over(attempt, given, out, limit)
    if status == Status.OK:
        seconds = float(json.loads(out.with_suffix(".json").read_text(encoding="utf-8"))["seconds"])
        try:
            return entry_record(attempt.scene, out, attempt.name, attempt.nodes, seconds=seconds)
        except StudyError as problem:
            status, message = Status.FAILED, str(problem)
    recipe = given_mesh(attempt.scene, attempt.nodes, attempt.peer.mesh).recipe
    return unfinished_record(Case(attempt.scene, recipe, outside(attempt.name)), status, message)


def hand_over(attempt: Attempt, given: Path, out: Path, limit: float) -> tuple[Status, str]:
    """Runs the adapter in a process of its own, in the folder, where programs leave their logs; how it ended."""
    if attempt.peer.absent:
        return Status.SKIPPED, f"{attempt.peer.name}: {attempt.peer.absent}"
    words = [attempt.peer.module, str(given.resolve()), str(out.resolve()), attempt.peer.mesh, repr(attempt.shorter)]
    surroundings = os.environ | {"PYTHONPATH": os.pathsep.join(path or os.getcwd() for path in sys.path)}
    try:
        ended = subprocess.run(
            [sys.executable, "-m", "studies.exchange.peers.run", *words],
            capture_output=True,
            text=True,
            timeout=limit,
            cwd=given,
            env=surroundings,
        )
    except subprocess.TimeoutExpired:
        return Status.FAILED, f"{attempt.peer.name} took longer than {limit:g} s"
    if ended.returncode == 0:
        return Status.OK, ""
    last = ([line for line in ended.stderr.splitlines() if line.strip()] or ["without a message"])[-1]
    if ended.returncode in (CANNOT, MISSING):
        return Status.SKIPPED, f"{attempt.peer.name}: {last}"
    return Status.FAILED, f"{attempt.peer.name} ended with exit code {ended.returncode}: {last}"
