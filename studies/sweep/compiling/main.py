"""`python -m studies.sweep.compiling.main`: compiles what `make study` and `make test` need; silent when done.

Two processes that run the studies at once would both compile what they share, in twice the time.
"""

import argparse
import hashlib
import platform
import sys
from collections.abc import Callable, Iterator
from functools import partial
from importlib.metadata import version
from pathlib import Path
from time import perf_counter
from typing import NamedTuple

import llvmlite.binding as llvm

from massspring.compile_cache import folder
from massspring.sources import source_fingerprint
from studies.base.atomic import write_whole
from studies.base.compile_watch import Compiled, summary, watching
from studies.base.errors import StudyError
from studies.base.interrupts import exit_code, listening
from studies.base.processes import run_each
from studies.sweep.compiling import elements, frames

PROCESSES = 2
OWN_NAME = "studies.sweep.compiling.main"
"""Of this module, also where it is the program."""
ESSENTIAL: tuple[str, ...] = (
    "implicit_volume, whole, float64",
    "free, whole, float64",
    "implicit_volume, quadratic, float64",
)
"""What `make study` begins with; its first chart does not wait for the rest. References of the catalogue are published,
so none is solved."""


class Done(NamedTuple):
    """What a task compiled."""

    name: str
    compiled: list[Compiled]


def tasks() -> dict[str, Callable[[], None]]:
    """Name -> what compiles it, in the order to begin them.

    One process begins with the kernels that all frames share, the other with those of the reference.
    """
    frame_tasks = {variant.name: partial(frames.advance, variant) for variant in frames.variants()}
    first, *rest = frame_tasks
    order = [first, *elements.TASKS, *rest]
    return {name: elements.TASKS.get(name) or frame_tasks[name] for name in order}


def stamp(whole: bool) -> Path:
    """The file that is there when the whole is compiled, or what is essential: one for each state of the code, of the
    compiler and kind of processor."""
    state = [source_fingerprint(OWN_NAME), platform.python_version(), llvm.get_host_cpu_name()]
    state += [version(package) for package in ("numba", "llvmlite", "numpy")]
    key = hashlib.sha256("\0".join(state).encode()).hexdigest()[:16]
    return folder() / f"{'complete' if whole else 'essential'}-{key}"


def is_done(whole: bool) -> bool:
    return stamp(True).is_file() or (not whole and stamp(False).is_file())


def compile_one(name: str) -> Done:
    """In a process, which may have done others: does one of `tasks`. Raises StudyError where it fails."""
    try:
        with watching() as watch:
            tasks()[name]()
    except MemoryError:
        raise
    except Exception as error:  # numba raises errors of many types
        words = " ".join(str(error).split())
        raise StudyError(f"{name} could not be compiled: {type(error).__name__}: {words}") from error
    return Done(name, watch.compiled)


def compile_all(names: list[str]) -> Iterator[Done]:
    """Does the tasks in two processes; yields each as it is done. Raises StudyError for one that fails."""
    for name, done, cause in run_each(names, PROCESSES, compile_one):
        if cause is not None:
            raise StudyError(f"{name} could not be compiled: {cause}; run the command again")
        yield done


def bring_up_to_date(whole: bool) -> None:
    """Compiles what is missing of all, or of what is essential, with a line for each task that had to; nothing where
    that was done before. Raises StudyError."""
    if is_done(whole):
        return
    names = list(tasks()) if whole else list(ESSENTIAL)
    print(
        f"compiling: up to {len(names)} forms of the kernels in {PROCESSES} processes, once for this code", flush=True
    )
    begin, compiled = perf_counter(), []
    for number, done in enumerate(compile_all(names), 1):
        if done.compiled:
            own = sum(entry.seconds for entry in done.compiled)
            what = f"{done.name}: {len(done.compiled)} functions, {own:.1f} s"
            print(f"compiling {number}/{len(names)}: {what}", flush=True)
        compiled += done.compiled
    write_whole(stamp(whole), b"")
    print(f"compiling: {summary(compiled, 0)[0]}; {perf_counter() - begin:.0f} s in all", flush=True)


def main() -> None:
    """Exit codes: 0 all is compiled; 1 something could not be; 130 interrupted."""
    parser = argparse.ArgumentParser(prog="python -m studies.sweep.compiling.main", description=__doc__)
    parser.add_argument("--essential", action="store_true", help="only what the main studies need first")
    options = parser.parse_args()
    try:
        with listening():
            bring_up_to_date(not options.essential)
    except StudyError as error:
        print(f"organbench: {error}", file=sys.stderr)
        sys.exit(1)
    except KeyboardInterrupt:
        print("organbench: interrupted; compiled functions are kept", file=sys.stderr)
        sys.exit(exit_code())


if __name__ == "__main__":
    main()
