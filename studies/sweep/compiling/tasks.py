"""Everything that is compiled beforehand, by name, and whether that is done for the present state of the code."""

import hashlib
import platform
from collections.abc import Callable
from functools import partial
from importlib.metadata import version
from pathlib import Path
from time import perf_counter
from typing import NamedTuple

import llvmlite.binding as llvm

from massspring.compile_cache import folder
from massspring.sources import source_fingerprint
from studies.base.atomic import write_whole
from studies.base.compile_watch import Compiled, watching
from studies.sweep.compiling import elements, frames


class Done(NamedTuple):
    """What a task took."""

    name: str
    seconds: float
    """Wall time, with running [s]."""
    compiled: list[Compiled]


def tasks() -> dict[str, Callable[[], None]]:
    """Name -> what compiles it, in the order to begin them.

    One process begins with the kernels that all frames share, the other with those of the reference.
    """
    frame_tasks = {variant.name: partial(frames.advance, variant) for variant in frames.variants()}
    first, *rest = frame_tasks
    order = [first, *elements.TASKS, *rest]
    return {name: elements.TASKS.get(name) or frame_tasks[name] for name in order}


ESSENTIAL: tuple[str, ...] = (
    "implicit_volume, whole, float64",
    "free, whole, float64",
    "implicit_volume, quadratic, float64",
)
"""What `make study` begins with; its first chart does not wait for the rest. References of the catalogue are published,
so none is solved."""


def perform(name: str) -> Done:
    """Does one task of `tasks()`, in a process that may have done others."""
    begin = perf_counter()
    with watching() as watch:
        tasks()[name]()
    return Done(name, perf_counter() - begin, watch.compiled)


def stamp(whole: bool) -> Path:
    """The file that is there when the whole is compiled, or what is essential: one for each state of the code, of the
    compiler and kind of processor."""
    state = [source_fingerprint(__name__), platform.python_version(), llvm.get_host_cpu_name()]
    state += [version(package) for package in ("numba", "llvmlite", "numpy")]
    key = hashlib.sha256("\0".join(state).encode()).hexdigest()[:16]
    return folder() / f"{'complete' if whole else 'essential'}-{key}"


def is_done(whole: bool) -> bool:
    """Whether all of it was compiled before."""
    return stamp(True).is_file() or (not whole and stamp(False).is_file())


def set_done(whole: bool) -> None:
    """Remembers that all of it is compiled. Raises StudyError when the folder of compiled code cannot be written."""
    write_whole(stamp(whole), b"")
