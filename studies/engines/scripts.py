"""Job scripts: an array of workers for each queueing system, and the words that hand it in and end it."""

import math
import re
import shlex
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

from studies.engines.settings import Settings


@dataclass(frozen=True)
class Queue:
    """A queueing system."""

    lines: Callable[[Settings, Path], list[str]]
    """Of the head of a script: what it asks for; the folder is for what workers print."""
    submit: tuple[str, ...]
    """Followed by the script; prints the job's id."""
    job: re.Pattern[str]
    """The id in what that prints."""
    end: str
    """Followed by the id."""


def slurm(settings: Settings, folder: Path) -> list[str]:
    """See https://slurm.schedmd.com/sbatch.html."""
    asked = [
        f"--array=1-{settings.workers}",
        "--nodes=1",
        "--ntasks=1",
        f"--cpus-per-task={settings.processes}",
        f"--output={folder}/worker-%a.log",
    ]
    if settings.hours:
        asked.append(f"--time={math.ceil(60 * settings.hours)}")
    if settings.memory_gb:
        asked.append(f"--mem={math.ceil(1000 * settings.memory_gb)}M")
    if settings.queue:
        asked.append(f"--partition={settings.queue}")
    return [f"#SBATCH {line}" for line in ("--job-name=organbench", *asked, *settings.options)]


def sge(settings: Settings, folder: Path) -> list[str]:
    """qsub(1) of Grid Engine; memory is asked for each slot."""
    asked = ["-S /bin/bash", f"-t 1-{settings.workers}", "-j y", f"-o {folder}/worker-$TASK_ID.log"]
    if settings.processes > 1:
        asked.append(f"-pe {settings.parallel_environment} {settings.processes}")
    if settings.hours:
        asked.append(f"-l h_rt={math.ceil(3600 * settings.hours)}")
    if settings.memory_gb:
        asked.append(f"-l h_vmem={math.ceil(1000 * settings.memory_gb / settings.processes)}M")
    if settings.queue:
        asked.append(f"-q {settings.queue}")
    return [f"#$ {line}" for line in ("-N organbench", *asked, *settings.options)]


def pbs(settings: Settings, folder: Path) -> list[str]:
    """qsub of OpenPBS; an array has two jobs at least."""
    memory = f":mem={math.ceil(1000 * settings.memory_gb)}mb" if settings.memory_gb else ""
    asked = [f"-l select=1:ncpus={settings.processes}{memory}", "-j oe", f"-o {folder}"]
    if settings.workers > 1:
        asked.append(f"-J 1-{settings.workers}")
    if settings.hours:
        minutes = math.ceil(60 * settings.hours)
        asked.append(f"-l walltime={minutes // 60:02d}:{minutes % 60:02d}:00")
    if settings.queue:
        asked.append(f"-q {settings.queue}")
    return [f"#PBS {line}" for line in ("-N organbench", *asked, *settings.options)]


QUEUES = {
    "slurm": Queue(slurm, ("sbatch", "--parsable"), re.compile(r"\d+"), "scancel"),
    "sge": Queue(sge, ("qsub", "-terse"), re.compile(r"\d+"), "qdel"),
    "pbs": Queue(pbs, ("qsub",), re.compile(r"\S+"), "qdel"),
}


def script(settings: Settings, folder: Path, worker: list[str], here: Path) -> str:
    """The job script: what it asks for, the user's lines, and a worker that is started in the folder `here`."""
    head = QUEUES[settings.kind].lines(settings, folder)
    return "\n".join(
        ["#!/bin/bash", *head, f"cd {shlex.quote(str(here))}", *settings.setup, f"exec {shlex.join(worker)}", ""]
    )
