"""Resources of the machine: cores, memory, room on the disk, folders that can be written to."""

import os
import shlex
import shutil
import tempfile
from pathlib import Path

from massspring.compile_cache import folder as compiled_folder
from massspring.sources import cache_folder as user_cache
from studies.geometry.mesher.jobs import cache_folder as mesh_folder
from studies.store.machine import this_machine
from studies.tools.doctor.finding import Finding, fault, note, ok

ROOM = 2e9
"""Free bytes on a disk: twice what the main studies write, with meshes and compiled code."""
MEMORY = 4
"""GB: a process that solves a reference takes up to 1.5, and two run at once."""


def machine(root: Path) -> list[Finding]:
    """Cores, memory, settings of the environment, the caches, and room for results below `root`."""
    caches = [
        ("compiled code", compiled_folder(), "NUMBA_CACHE_DIR"),
        ("meshes", mesh_folder(), "ORGANBENCH_CACHE"),
        ("code fingerprints", user_cache(), "XDG_CACHE_HOME"),
    ]
    findings = [cores(), memory(this_machine().memory_gb), compiler()]
    findings += [cache(what, folder, variable) for what, folder, variable in caches]
    return [*findings, room("results", root), room("compiled code", compiled_folder())]


def cores() -> Finding:
    usable = len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1
    there = os.cpu_count() or 1
    sentence = f"{usable} of {there} cores may be used"
    return ok(sentence) if usable > 1 else note(f"{sentence}: other programs disturb the frame times")


def memory(gigabytes: int | None) -> Finding:
    if gigabytes is None:
        return note("the system does not report its memory")
    if gigabytes >= MEMORY:
        return ok(f"{gigabytes} GB of memory")
    return note(f"{gigabytes} GB of memory, two processes use {MEMORY}", "organbench run --jobs 1")


def compiler() -> Finding:
    if os.environ.get("NUMBA_DISABLE_JIT", "0") in ("", "0"):
        return ok("kernels are compiled")
    return fault("NUMBA_DISABLE_JIT is set: nothing is compiled, a step takes a thousand times as long", UNCOMPILED)


UNCOMPILED = "unset NUMBA_DISABLE_JIT"


def cache(what: str, folder: Path, variable: str) -> Finding:
    """Whether a cache can be written to; `variable` of the environment chooses its folder."""
    problem = cannot_write(folder)
    if problem is None:
        return ok(f"cache of {what}: {folder}")
    elsewhere = Path(tempfile.gettempdir()) / "organbench"
    line = f"unset {variable}" if os.environ.get(variable) else f"export {variable}={shlex.quote(str(elsewhere))}"
    return fault(f"cache of {what}: {folder} cannot be written to ({problem}): it is rebuilt every time", line)


def cannot_write(folder: Path) -> str | None:
    """Why no file can be made in a folder, which is made when missing; None when one can."""
    try:
        folder.mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryFile(dir=folder):
            return None
    except OSError as error:
        return error.strerror or str(error)


def room(what: str, folder: Path) -> Finding:
    """Whether the disk of a folder, or of the nearest one above that is there, has room."""
    there = next(place for place in (folder.absolute(), *folder.absolute().parents) if place.is_dir())
    free = shutil.disk_usage(there).free
    sentence = f"{free / 1e9:.1f} GB free for {what} in {folder}"
    if free >= ROOM:
        return ok(sentence)
    return fault(f"{sentence}, {ROOM / 1e9:g} are needed", f"du -xsh {shlex.quote(str(there))}/* | sort -h | tail")
