"""The YAML file of a job array: what it may say, and what is wrong with what it says."""

from dataclasses import dataclass, fields
from functools import cache
from pathlib import Path
from typing import Annotated, Literal

import yaml
from pydantic import ConfigDict, Field, TypeAdapter, ValidationError, with_config

from studies.base.errors import StudyError
from studies.base.lookup import lookup

Kind = Literal["slurm", "sge", "pbs", "command"]
Lines = tuple[str, ...]


@with_config(ConfigDict(extra="forbid", strict=False))
@dataclass(frozen=True)
class Settings:
    """Workers that are to be started, and how."""

    kind: Kind
    """The queueing system, or "command": a program that starts one worker and is started for each."""
    workers: Annotated[int, Field(ge=1)]
    """Jobs of the array."""
    processes: Annotated[int, Field(ge=1)] = 1
    """Pieces at a time that each of them does: as many cores are asked for."""
    hours: Annotated[float, Field(gt=0)] | None = None
    """Time of each; None: as long as the queue allows."""
    memory_gb: Annotated[float, Field(gt=0)] | None = None
    """Of each; None: what the queue gives."""
    queue: str = ""
    """Of SGE and PBS, partition of SLURM."""
    parallel_environment: str = "smp"
    """Of SGE: the one that keeps all cores of a job on one machine."""
    options: Lines = ()
    """Further options of the job script, each a line, as "--account=surgery"."""
    setup: Lines = ()
    """Lines of shell before a worker starts, as "module load python"."""
    command: str = ""
    """Of kind "command": a line of shell; {scheduler_file}, {processes} and {memory} stand for what a worker needs."""
    host: str = ""
    """Name or number under which workers reach this machine; empty: found."""
    wait_hours: Annotated[float, Field(gt=0)] = 24.0
    """For the first worker, and whenever there is none."""
    portable: bool = False
    """As `--portable`."""


def read_settings(path: Path) -> Settings:
    """The settings in a YAML file. Raises StudyError with what is wrong in it."""
    try:
        # Words alone: YAML itself would read 2:00:00 as 7200, and a queue called 12 as a number.
        given = yaml.load(path.read_text(encoding="utf-8"), yaml.BaseLoader)
    except FileNotFoundError:
        raise StudyError(f"there is no file {path}; write one as docs/cluster.md shows") from None
    except (OSError, UnicodeDecodeError, yaml.YAMLError) as error:
        raise StudyError(f"{path} cannot be read as YAML ({' '.join(str(error).split())})") from error
    if not isinstance(given, dict):
        raise StudyError(f"{path} holds no settings; write lines such as `kind: slurm` (docs/cluster.md)")
    known = {field.name: field for field in fields(Settings)}
    for word in given:
        lookup(str(word), known, f"setting in {path.name}")
    return _checked(path, given)


def _checked(path: Path, given: dict) -> Settings:
    try:
        settings = _adapter().validate_python(given)
    except ValidationError as error:
        first = error.errors()[0]
        where = ".".join(str(part) for part in first["loc"])
        raise StudyError(f"{path}: {where}: {first['msg'][0].lower()}{first['msg'][1:]}; correct it") from error
    if (settings.kind == "command") != bool(settings.command):
        raise StudyError(f"{path}: a `command` is given for `kind: command`, and for no other kind")
    return settings


@cache
def _adapter() -> TypeAdapter[Settings]:
    return TypeAdapter(Settings)
