"""Runs other programs on exported scenes, each in a separate process and environment, and evaluates their results.

Every attempt gives an entry: a program that cannot do a scene is skipped with its reason, and one that crashes or hangs
has a row with that status; the others continue.
"""

import json
import os
import subprocess
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path

from massspring.sources import own_file, source_fingerprint
from studies.base.errors import StudyError
from studies.exchange.entry import entry_path, outside
from studies.exchange.export import export
from studies.exchange.judge import unfinished_record
from studies.exchange.league.entry_file import LEAGUE, EntryFile, judged_file, write_entry_file
from studies.exchange.league.frozen import SET
from studies.exchange.meshes import given_mesh
from studies.exchange.peers.environment import python_of
from studies.exchange.peers.scene_folder import CANNOT, MISSING
from studies.exchange.precut import given_scene
from studies.runs.case import Case
from studies.scene.scene import Scene
from studies.store.record import Record, Status, read_record, write_record

TIME_LIMIT = 600.0
"""Of a run [s]; then its process is ended."""


@dataclass(frozen=True)
class Peer:
    """Another program: its adapter, and the mesh that it computes on; or why it has no adapter."""

    name: str
    module: str = ""
    mesh: str = "straight"
    packages: tuple[str, ...] = ()
    """What pip installs into its environment, the program itself first; without any it runs in that of organbench."""
    settings: Mapping[str, object] = field(default_factory=dict)
    """Keywords of its adapter: the best of the sweep (studies.exchange.peers.sweep)."""
    ours: bool = False
    absent: str = ""
    """The reason with which it is skipped."""

    @property
    def version(self) -> str:
        """Of the program, as it is asked for."""
        return self.packages[0].partition("==")[2] if self.packages else ""


ADAPTERS = "studies.exchange.peers."
PEERS: tuple[Peer, ...] = (
    Peer("mujoco", ADAPTERS + "mujoco_flex", packages=("mujoco-core==4.0.1",), settings={"poisson": 0.45}),
    Peer("felupe", ADAPTERS + "felupe_quadratic", "curved", packages=("felupe==11.3.0", "pypardiso")),
    Peer(
        "newton",
        ADAPTERS + "newton_vbd",
        packages=("newton==1.8.0", "warp-lang==1.19.0"),
        settings={"lame": 1.5},
    ),
    Peer("bullet", ADAPTERS + "bullet", packages=("pybullet==3.2.7",), settings={"lame": 1.5}),
    Peer("drake", ADAPTERS + "drake_deformable", packages=("drake==1.51.1",), settings={"poisson": 0.4}),
    Peer("sfepy", ADAPTERS + "sfepy_mixed", packages=("sfepy==2026.3",)),
    Peer("sofa", absent="no wheel on PyPI; it comes as binaries of its own or by conda"),
    Peer(
        "genesis",
        absent="genesis-world 1.4.5 meshes a surface itself; tetrahedra of a scene can only be put into its inner code",
    ),
    Peer("torch-fem", absent="torch-fem 0.14.0 has no contact"),
)
OURS: tuple[Peer, ...] = (
    Peer(
        "ours-quadratic",
        ADAPTERS + "own",
        "curved",
        settings={"method": "implicit_volume", "mass": "stiffness"},
        ours=True,
    ),
    Peer(
        "ours-corotated",
        ADAPTERS + "own",
        settings={"method": "implicit_elements", "law": "corotated", "dt": 0.02},
        ours=True,
    ),
    Peer("ours-xpbd", ADAPTERS + "own", settings={"method": "xpbd_neo_hookean"}, ours=True),
)


@dataclass(frozen=True)
class Attempt:
    """A program on a scene."""

    peer: Peer
    scene: Scene
    nodes: int

    @property
    def name(self) -> str:
        """Of the entry."""
        return self.peer.name

    @property
    def words(self) -> list[str]:
        """Command-line arguments of its adapter after the module, besides the folders."""
        return [self.peer.mesh, json.dumps(dict(self.peer.settings))]


def contest(
    root: Path,
    attempts: Sequence[Attempt],
    folder: Path,
    limit: float = TIME_LIMIT,
    environments: Path | None = None,
    again: bool = False,
) -> Iterator[Record]:
    """Makes all attempts, in a `folder` for exported scenes and what is handed in, and stores each below `root`; what
    is current there is kept, unless `again`.

    environments: where those of the programs are kept; default: in the cache below `root`. Raises StudyError where a
    scene cannot be exported or a record cannot be written.
    """
    for attempt in attempts:
        mesh = given_mesh(given_scene(attempt.scene), attempt.nodes, attempt.peer.mesh)
        path = entry_path(root, Case(mesh.scene, mesh.recipe, outside(attempt.name)))
        stored = None if again else current(path, attempt, mesh.digest)
        if stored is not None:
            yield stored
            continue
        given = folder / f"{attempt.scene.name}-{attempt.nodes}"
        if not given.exists():
            export(attempt.scene, given, attempt.nodes)
        record = judged(attempt, given, limit, environments or root / "cache" / "environments")
        write_record(path, record)
        yield record


def fingerprint_of(peer: Peer) -> str:
    """Hash of the code that gives a scene away, runs a program on it and judges what comes back."""
    own = [peer.module] if peer.module and own_file(peer.module) is not None else []
    return source_fingerprint("studies.exchange.export", "studies.exchange.judge", "studies.exchange.peers.run", *own)


def fingerprints() -> set[str]:
    """Those that entries of the present code have: of the programs here, and of what others hand in."""
    return {source_fingerprint("studies.exchange.judge"), *map(fingerprint_of, (*PEERS, *OURS))}


def current(path: Path, attempt: Attempt, digest: str) -> Record | None:
    """The stored record of an attempt, where the present code and settings made it on this mesh; None for one that was
    skipped, for what it lacked may be there now."""
    if not path.is_file():
        return None
    record = read_record(path)
    entry = json.loads(str(record.attributes.get(LEAGUE) or "{}"))
    made = entry.get("set"), entry.get("version"), entry.get("mesh_sha256"), entry.get("settings")
    same = made == (SET, attempt.peer.version, digest, dict(attempt.peer.settings))
    fresh = record.fingerprint == fingerprint_of(attempt.peer) and record.status != Status.SKIPPED
    return record if same and fresh else None


def judged(attempt: Attempt, given: Path, limit: float, environments: Path) -> Record:
    """The record of an attempt on an exported scene."""
    out = given / f"{attempt.name}.npz"
    status, message = hand_over(attempt, given, out, limit, environments)
    mesh = given_mesh(attempt.scene, attempt.nodes, attempt.peer.mesh)
    entry = entry_of(attempt, out, mesh.digest)
    if status == Status.OK:
        try:
            write_entry_file(out.with_suffix(".entry.json"), entry)
            return replace(judged_file(attempt.scene, entry, out.parent), fingerprint=fingerprint_of(attempt.peer))
        except StudyError as problem:
            status, message = Status.FAILED, str(problem)
    case = Case(given_scene(attempt.scene), mesh.recipe, outside(attempt.name))
    record = unfinished_record(case, status, message)
    attributes = record.attributes | {LEAGUE: entry.model_dump_json()}
    return replace(record, attributes=attributes, fingerprint=fingerprint_of(attempt.peer))


def entry_of(attempt: Attempt, out: Path, digest: str) -> EntryFile:
    """The attempt as an entry by file, with what its adapter wrote of itself, where it did."""
    report = out.with_suffix(".json")
    reported = json.loads(report.read_text(encoding="utf-8")) if report.is_file() else {}
    peer = attempt.peer
    return EntryFile(
        set=SET,
        scene=attempt.scene.name,
        engine=attempt.name,
        version=peer.version,
        mesh=peer.mesh,
        nodes=attempt.nodes,
        mesh_sha256=digest,
        result=out.name,
        seconds=reported.pop("seconds", None),
        evaluations=reported.pop("evaluations", None),
        settings=dict(peer.settings),
        environment=reported,
        command=" ".join(["python -m studies.exchange.peers.run", peer.module, "SCENE OUT", *attempt.words]),
        ours=peer.ours,
    )


def hand_over(
    attempt: Attempt, given: Path, out: Path, limit: float, environments: Path = Path("environments")
) -> tuple[Status, str]:
    """Runs the adapter in a separate process, in the folder, in which programs write their logs. Returns how it
    ended."""
    peer = attempt.peer
    if peer.absent:
        return Status.SKIPPED, f"{peer.name}: {peer.absent}"
    try:
        python, path = python_of(peer.name, peer.packages, environments)
    except StudyError as problem:
        return Status.SKIPPED, f"{peer.name}: {problem}"
    out.with_suffix(".json").unlink(missing_ok=True)
    words = [peer.module, str(given.resolve()), str(out.resolve()), *attempt.words]
    try:
        ended = subprocess.run(
            [python, "-m", "studies.exchange.peers.run", *words],
            capture_output=True,
            text=True,
            timeout=limit,
            cwd=given,
            env=os.environ | {"PYTHONPATH": path, "OMP_NUM_THREADS": "1"},
        )
    except subprocess.TimeoutExpired:
        return Status.FAILED, f"{peer.name} took longer than {limit:g} s"
    if ended.returncode == 0:
        return Status.OK, ""
    last = ([line for line in ended.stderr.splitlines() if line.strip()] or ["without a message"])[-1]
    if ended.returncode in (CANNOT, MISSING):
        return Status.SKIPPED, f"{peer.name}: {last}"
    return Status.FAILED, f"{peer.name} ended with exit code {ended.returncode}: {last}"
