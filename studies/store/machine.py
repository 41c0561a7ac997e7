"""Who measured: processor, clock, system and versions. No host name, no user name, no folder."""

import hashlib
import json
import os
import platform
import time
from dataclasses import asdict, dataclass
from functools import cache
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path

from studies.base.atomic import write_whole
from studies.base.errors import StudyError

PACKAGES = ("numpy", "scipy", "numba", "llvmlite", "scikit-fem", "gmsh", "meshio", "h5py", "pypardiso")
CPUINFO = Path("/proc/cpuinfo")
CPUFREQ = Path("/sys/devices/system/cpu/cpu0/cpufreq")


@dataclass(frozen=True)
class Machine:
    """What a time depends on besides the code; only what stays the same from run to run."""

    id: str
    """First 8 hex digits of a hash of the hardware and the system's kind: stays when packages are updated."""
    cpu: str
    """Model name; family and model number tell apart what virtual machines give one name."""
    architecture: str
    cores: int
    """Logical cores of the machine, whether or not this process may use them."""
    virtual: bool | None
    """Whether a hypervisor lies in between (None: not known): other guests may then take time away."""
    clock: dict[str, str | int | None]
    """max_mhz and governor of core 0 (None: the system does not report it); the timer and its resolution [ns]."""
    memory_gb: int | None
    system: str
    python: str
    packages: dict[str, str | None]


@cache
def this_machine() -> Machine:
    cpu, virtual = _cpu()
    architecture, cores, memory = platform.machine(), os.cpu_count() or 1, _memory_gb()
    hardware = json.dumps([cpu, architecture, cores, memory, platform.system()])
    return Machine(
        id=hashlib.sha256(hardware.encode()).hexdigest()[:8],
        cpu=cpu,
        architecture=architecture,
        cores=cores,
        virtual=virtual,
        clock=_clock(),
        memory_gb=memory,
        system=" ".join(filter(None, (platform.system(), platform.release()))),
        python=f"{platform.python_implementation()} {platform.python_version()}",
        packages={name: _version(name) for name in PACKAGES},
    )


def machine_id() -> str:
    """The short id under which this machine's timing files are stored."""
    return this_machine().id


def machine_of(folder: Path, study: str = "") -> str | None:
    """The short id of the machine whose results lie in a folder, or that measured one study there where this was
    another; None where nothing says so. Raises StudyError for a damaged file."""
    own = folder / study / "machine.json"
    path = own if own.is_file() else folder / "machine.json"
    try:
        return json.loads(path.read_text(encoding="utf-8")).get("id") if path.is_file() else None
    except (OSError, ValueError, AttributeError, RecursionError) as error:
        raise StudyError(f"{path} is damaged ({error}): draw the report, or unpack the archive, again") from error


def write_machine(path: Path) -> None:
    """Writes this machine as JSON (results/machine.json); an equal file is left untouched.

    Raises StudyError when it cannot be written.
    """
    content = (json.dumps(asdict(this_machine()), indent=2, sort_keys=True) + "\n").encode()
    path = Path(path)
    if not (path.is_file() and path.read_bytes() == content):
        write_whole(path, content)


def _cpu() -> tuple[str, bool | None]:
    """Name of the first processor, with what tells apart those that virtual machines give one name; Machine.virtual."""
    text = CPUINFO.read_text() if CPUINFO.is_file() else ""
    lines = (line.partition(":") for line in text.split("\n\n")[0].splitlines())
    facts = {name.strip(): value.strip() for name, _, value in lines}
    name = facts.get("model name") or platform.processor() or platform.machine() or "unknown"
    if "cpu family" in facts:
        name += f" (family {facts['cpu family']}, model {facts.get('model', '?')})"
    return name, "hypervisor" in facts["flags"].split() if "flags" in facts else None


def _clock() -> dict[str, str | int | None]:
    paths = (CPUFREQ / name for name in ("cpuinfo_max_freq", "scaling_governor"))
    max_khz, governor = (path.read_text().strip() if path.is_file() else None for path in paths)
    timer = time.get_clock_info("perf_counter")
    return {
        "max_mhz": int(max_khz) // 1000 if max_khz else None,
        "governor": governor,
        "timer": timer.implementation,
        "timer_resolution_ns": round(timer.resolution * 1e9),
    }


def _memory_gb() -> int | None:
    if not hasattr(os, "sysconf") or "SC_PHYS_PAGES" not in os.sysconf_names:
        return None
    return round(os.sysconf("SC_PHYS_PAGES") * os.sysconf("SC_PAGE_SIZE") / 1e9)


def _version(name: str) -> str | None:
    try:
        return version(name)
    except PackageNotFoundError:
        return None
