"""What is installed: Python packages, those of the extras, and the system libraries that gmsh loads."""

import os
import platform
import shlex
import shutil
import subprocess
import sys
from collections.abc import Sequence
from importlib.metadata import PackageNotFoundError, metadata, packages_distributions, requires, version

from packaging.requirements import Requirement

from studies.base.install import pip_install
from studies.tools.doctor.finding import Finding, fault, note, ok

DISTRIBUTION = "organbench"
OURS = ("massspring", "reference_fem", "studies")
GMSH_LIBRARIES = (
    "libglu1-mesa", "libgl1", "libxft2", "libxcursor1", "libxinerama1", "libxrender1", "libxfixes3", "libxext6",
    "libfontconfig1", "libx11-6", "libgomp1",
)  # fmt: skip
"""Debian packages with the X and GL libraries that the wheel of gmsh lacks; .ci/setup installs the same."""
NATIVE = ("numba", "h5py", "gmsh", "mmgpy")
"""Modules of required packages that load libraries of the system."""
PURPOSE = {
    "fast": "references in a fifth to a twentieth of the time (MKL, .9 GB)",
    "masks": "label masks of scans (NIfTI, NRRD)",
    "view": "reads the files of `organbench view` without ParaView",
    "crosscheck": "the second finite-element code of `python -m studies.lab.verify`",
    "parquet": "`organbench table --parquet`",
    "cluster": "`organbench run --on` workers of other machines",
}
"""What an extra is for; those of developers (tests, documentation) are not listed."""
PATIENCE = 60.0
"""Seconds that a module may take to load."""


def software() -> list[Finding]:
    """Python, the required packages, the extras, and whether what is installed also loads."""
    try:
        needed = required()
    except PackageNotFoundError:
        what = f"{DISTRIBUTION} itself is not installed, so its requirements are unknown"
        return [fault(what, pip_install("--editable", "."))]
    findings = [ok(f"{DISTRIBUTION} {version(DISTRIBUTION)}, Python {platform.python_version()}"), packages(needed)]
    findings += foreign()
    findings += [loads(module) for module in NATIVE if is_installed(module)]
    return findings + [extra(name, required(name)) for name in extras()]


def foreign() -> list[Finding]:
    """A finding for each of our packages that another distribution brings too: the last one installed has replaced the
    files of the other."""
    owners = packages_distributions()
    others = {name: sorted({*owners.get(name, [])} - {DISTRIBUTION}) for name in OURS}
    found = [fault(f"{name} is also a package of {', '.join(o)}", replaced(o)) for name, o in others.items() if o]
    return found or [ok(f"{', '.join(OURS)} are ours alone")]


def replaced(others: Sequence[str]) -> str:
    """The line that removes other distributions; what they have replaced comes back with ours."""
    remove = shlex.join([sys.executable, "-m", "pip", "uninstall", *others])
    return f"{remove}  # and install {DISTRIBUTION} again, or use an environment for it alone"


def required(extra: str = "") -> list[Requirement]:
    """What the distribution requires of others, or what an extra adds. Raises PackageNotFoundError."""
    every = map(Requirement, requires(DISTRIBUTION) or [])
    plain = {"extra": ""}
    return [
        one
        for one in every
        if one.name != DISTRIBUTION
        and (one.marker is None or one.marker.evaluate({"extra": extra}))
        and (not extra or (one.marker is not None and not one.marker.evaluate(plain)))
    ]


def extras() -> list[str]:
    return [name for name in metadata(DISTRIBUTION).get_all("Provides-Extra") or [] if name in PURPOSE]


def packages(needed: Sequence[Requirement]) -> Finding:
    wrong = [(one, what) for one in needed if (what := lacking(one)) is not None]
    if not wrong:
        return ok(f"all {len(needed)} required packages are installed")
    words = ", ".join(f"{one.name} {what}" for one, what in wrong)
    return fault(f"required packages: {words}", install([one for one, _ in wrong]))


def extra(name: str, needed: Sequence[Requirement]) -> Finding:
    wrong = [one for one in needed if lacking(one) is not None]
    what = f"extra {name}, {PURPOSE[name]}"
    return note(f"{what}: not installed", install(wrong)) if wrong else ok(what)


def lacking(one: Requirement) -> str | None:
    try:
        there = version(one.name)
    except PackageNotFoundError:
        return "is not installed"
    return None if one.specifier.contains(there, prereleases=True) else f"is {there}, but {one.specifier} is required"


def install(needed: Sequence[Requirement]) -> str:
    return pip_install(*(f"{one.name}{one.specifier}" for one in needed))


def is_installed(package: str) -> bool:
    """Whether there is a package of that name; another finding says so when there is none."""
    try:
        version(package)
    except PackageNotFoundError:
        return False
    return True


def loads(module: str) -> Finding:
    """Whether a module can be imported, tried in a process of its own: a missing library may end it."""
    command = [sys.executable, "-c", f"import {module}"]
    try:
        done = subprocess.run(command, capture_output=True, text=True, timeout=PATIENCE, check=False)
    except subprocess.TimeoutExpired:
        return fault(f"{module} takes more than {PATIENCE:g} s to load", reinstall(module))
    if done.returncode == 0:
        return ok(f"{module} loads")
    why = (done.stderr.strip().splitlines() or [f"exit code {done.returncode}"])[-1]
    missing = "cannot open shared object file" in why
    return fault(f"{module} does not load: {why}", system_libraries() if missing else reinstall(module))


def reinstall(package: str) -> str:
    return pip_install("--force-reinstall", "--no-deps", f"{package}=={version(package)}")


def system_libraries() -> str:
    """The line that installs the libraries of X and GL; elsewhere than on Debian, the packages that hold them there."""
    names = " ".join(GMSH_LIBRARIES)
    if shutil.which("apt-get") is None:
        return f"# install the equivalents of these Debian packages: {names}"
    sudo = "" if os.name == "posix" and os.geteuid() == 0 else "sudo "
    return f"{sudo}apt-get update && {sudo}apt-get install -y --no-install-recommends {names}"
