"""A cluster for one command: a scheduler here, and workers from a queueing system or a program, ended with it."""

import json
import logging
import math
import os
import secrets
import shlex
import signal
import subprocess
from collections.abc import Callable, Iterator
from contextlib import closing, contextmanager, suppress
from dataclasses import dataclass, fields
from pathlib import Path
from typing import Annotated, Any, Literal

import yaml
from dask import config
from dask_jobqueue.htcondor import HTCondorCluster
from dask_jobqueue.lsf import LSFCluster
from dask_jobqueue.oar import OARCluster
from dask_jobqueue.pbs import PBSCluster
from dask_jobqueue.sge import SGECluster
from dask_jobqueue.slurm import SLURMCluster
from distributed import Scheduler, SpecCluster, Status
from distributed.utils import get_ip
from pydantic import ConfigDict, Field, TypeAdapter, ValidationError, with_config

from studies.base.atomic import write_whole
from studies.base.errors import StudyError
from studies.base.lookup import lookup
from studies.base.processes import PATIENCE
from studies.sweep.engines.tls import KEY, LONELY_SECONDS, NO_PAGES, make_key, settings_of, words_of

MEMORY_GB = 2.0
"""Of each process by default: a reference of 90,000 unknowns takes 1.4."""
DISK = "1 GB"
"""Request to HTCondor; results go to the shared folder."""
Kind = Literal["slurm", "sge", "pbs", "lsf", "htcondor", "oar", "command"]
QUEUES = {
    "slurm": SLURMCluster,
    "sge": SGECluster,
    "pbs": PBSCluster,
    "lsf": LSFCluster,
    "htcondor": HTCondorCluster,
    "oar": OARCluster,
}
Lines = tuple[str, ...]
Listener = Callable[[str], object]


@with_config(ConfigDict(extra="forbid", strict=False))
@dataclass(frozen=True)
class Settings:
    """Workers that are to be started, and how."""

    kind: Kind
    """The queueing system, or "command": a program that starts one worker and is started for each."""
    workers: Annotated[int, Field(ge=1)]
    """Jobs of the queue, each with one worker."""
    processes: Annotated[int, Field(ge=1)] = 1
    """Cases at a time of each worker, which requests as many cores."""
    hours: Annotated[float, Field(gt=0)] | None = None
    """Time of each; None: as long as the queue allows."""
    memory_gb: Annotated[float, Field(gt=0)] | None = None
    """Of each worker; None: MEMORY_GB for each process."""
    queue: str = ""
    """Partition of SLURM; HTCondor has none."""
    parallel_environment: str = "smp"
    """Of SGE: the one that keeps all cores of a job on one machine."""
    options: Lines = ()
    """Further directives of the job script, as "--account=surgery"; of HTCondor "name = value"."""
    setup: Lines = ()
    """Lines of shell before a worker starts, as "module load python"."""
    command: str = ""
    """Of kind "command": a line of shell; {scheduler_file}, {processes} and {memory} stand for what a worker needs."""
    host: str = ""
    """Name or number under which workers reach this machine; empty: determined here."""
    wait_hours: Annotated[float, Field(gt=0)] = 24.0
    """For the first worker, and whenever there is none."""


def read_settings(path: Path) -> Settings:
    """The settings in a YAML file. Raises StudyError with what is wrong in it."""
    try:
        # Words alone: YAML itself would read 2:00:00 as 7200, and a queue called 12 as a number.
        given = yaml.load(path.read_text(encoding="utf-8"), yaml.BaseLoader)
    except FileNotFoundError:
        raise StudyError(f"there is no file {path}; docs/cluster.md shows how to write one") from None
    except (OSError, UnicodeDecodeError, yaml.YAMLError) as error:
        raise StudyError(f"{path} cannot be read as YAML ({' '.join(str(error).split())})") from error
    if not isinstance(given, dict):
        raise StudyError(f"{path} holds no settings; write lines such as `kind: slurm` (docs/cluster.md)")
    fields_by_name = {field.name: field for field in fields(Settings)}
    for word in given:
        lookup(str(word), fields_by_name, f"setting in {path.name}")
    try:
        settings = TypeAdapter(Settings).validate_python(given)
    except ValidationError as error:
        first = error.errors()[0]
        where = ".".join(str(part) for part in first["loc"])
        raise StudyError(f"{path}: {where}: {first['msg'][0].lower()}{first['msg'][1:]}; correct it") from error
    if (settings.kind == "command") != bool(settings.command):
        raise StudyError(f"{path}: a `command` is given for `kind: command`, and for no other kind")
    for word in ("hours", "queue"):
        if settings.kind == "htcondor" and getattr(settings, word):
            raise StudyError(f"{path}: HTCondor has no `{word}`; leave it out, or give a line in `options`")
    return settings


@contextmanager
def scheduler_with_workers(settings: Settings, root: Path, tell: Listener) -> Iterator[str]:
    """The address of a scheduler of this process, for which workers are started; `tell` reports how. Inside, clients
    of this process hold its key; without it nobody reaches the scheduler.

    Raises StudyError where they cannot be started."""
    logging.getLogger("distributed").setLevel(logging.CRITICAL)
    folder = root.absolute() / "cache" / f"workers-{secrets.token_hex(4)}"
    make_key(folder)
    with config.set(dask_settings(folder)), closing(cluster_of(settings, folder)) as cluster:
        address = cluster.scheduler_address
        write_whole(folder / "scheduler.json", json.dumps({"address": address}).encode())
        try:
            by_program = settings.kind == "command"
            with programs(settings, folder) if by_program else jobs_of_queue(cluster, settings):
                what = "workers" if by_program else f"jobs of {settings.kind}"
                tell(f"{settings.workers} {what} started; what they print is in {folder}")
                yield address
        finally:
            for gone in (folder / "scheduler.json", folder / KEY):
                gone.unlink(missing_ok=True)


def dask_settings(folder: Path) -> dict[str, object]:
    """Inside which a cluster lives: the key, and no limit of time where none is given; dask-jobqueue's is half an
    hour."""
    return settings_of(folder) | {f"jobqueue.{kind}.walltime": None for kind in QUEUES}


def cluster_of(settings: Settings, folder: Path) -> SpecCluster:
    """A scheduler that listens with the key in `folder`, and knows how to start workers; none is started yet."""
    scheduler = {"host": settings.host or get_ip(), "port": 0, "protocol": "tls://"}
    scheduler |= {"dashboard": False, "dashboard_address": "127.0.0.1:0"}
    if settings.kind == "command":
        return SpecCluster(scheduler={"cls": Scheduler, "options": scheduler})
    return QUEUES[settings.kind](**_words(settings, folder), scheduler_options=scheduler)


def _words(settings: Settings, folder: Path) -> dict[str, Any]:
    memory = settings.memory_gb or MEMORY_GB * settings.processes
    words: dict[str, Any] = {
        "cores": settings.processes,
        "processes": 1,
        "memory": f"{memory:g} GB",
        "job_name": "organbench",
        "log_directory": str(folder),
        "shebang": "#!/bin/bash",
        "job_script_prologue": [f"cd {shlex.quote(str(Path.cwd()))}", *settings.setup],
        "job_extra_directives": list(settings.options),
        "worker_extra_args": [shlex.quote(word) for word in (*words_of(folder), *NO_PAGES)],
        "death_timeout": LONELY_SECONDS,
    }
    if settings.kind == "htcondor":
        pairs = (option.partition("=") for option in settings.options)
        return words | {"job_extra_directives": {name.strip(): value.strip() for name, _, value in pairs}, "disk": DISK}
    if settings.kind == "sge":
        cores = [f"-pe {settings.parallel_environment} {settings.processes}"] if settings.processes > 1 else []
        words["job_extra_directives"] = [*cores, *settings.options]
        words["resource_spec"] = f"h_vmem={math.ceil(1000 * memory / settings.processes)}M"
    if settings.kind == "oar":  # the property that holds the memory has another name on each cluster: `options`
        words["memory_per_core_property_name"] = "not_applicable"
    if settings.hours:
        minutes = math.ceil(60 * settings.hours)
        seconds = "" if settings.kind == "lsf" else ":00"
        words["walltime"] = f"{minutes // 60:02d}:{minutes % 60:02d}{seconds}"
    return words | ({"queue": settings.queue} if settings.queue else {})


@contextmanager
def jobs_of_queue(cluster: SpecCluster, settings: Settings) -> Iterator[None]:
    """Inside, the queue has a job for each worker; closing the cluster ends them. Raises StudyError where the queueing
    system refuses, or is not there."""
    try:
        for _ in range(settings.workers):
            cluster.worker_spec.update(cluster.new_worker_spec())
        cluster.sync(cluster._correct_state)  # `scale` would lose the errors
    except (OSError, RuntimeError, ValueError) as error:
        for job in cluster.workers.values():
            job.status = Status.failed  # else closing the cluster fails
        reason, here = " ".join(str(error).split()), "correct `kind`, or run on a machine that has it"
        if isinstance(error, OSError):
            raise StudyError(f"{settings.kind} cannot be used here ({reason}): {here}") from error
        raise StudyError(f"{settings.kind} did not take a job ({reason}): correct the settings") from error
    yield


@contextmanager
def programs(settings: Settings, folder: Path) -> Iterator[None]:
    """Inside, a shell runs for each worker, in a session of its own: Ctrl-C ends this command, which ends all of it."""
    script, started = "\n".join([*settings.setup, settings.command]), list[subprocess.Popen[bytes]]()
    file, memory = folder / "scheduler.json", f"{settings.memory_gb or 0:g}"
    for name, value in {"scheduler_file": file, "processes": settings.processes, "memory": memory}.items():
        script = script.replace(f"{{{name}}}", str(value))  # other braces are the shell's
    try:
        for number in range(settings.workers):
            with open(folder / f"worker-{number}.log", "wb") as log:
                words = ["bash", "-c", script]
                started.append(subprocess.Popen(words, stdout=log, stderr=log, start_new_session=True))
        yield
    finally:
        for process in started:
            for number in (signal.SIGTERM, signal.SIGKILL):
                with suppress(ProcessLookupError, subprocess.TimeoutExpired):
                    os.killpg(process.pid, number)
                    process.wait(PATIENCE)
