"""The versions that results were made with: organbench and all that it requires, as pip's `-c` option reads them."""

import platform
from importlib.metadata import PackageNotFoundError, requires, version

from packaging.requirements import Requirement
from packaging.utils import canonicalize_name


def pins() -> str:
    """A line for each package that organbench requires, directly or not, with the version that is installed."""
    found: dict[str, str] = {}
    waiting = [Requirement("organbench")]
    while waiting:
        one = waiting.pop()
        name = canonicalize_name(one.name)
        if name in found or (one.marker is not None and not one.marker.evaluate({"extra": ""})):
            continue
        try:
            found[name] = version(name)
        except PackageNotFoundError:  # of another platform, or replaced by its user
            continue
        waiting += map(Requirement, requires(name) or [])
    lines = [f"{name}=={found[name]}" for name in sorted(found) if name != "organbench"]
    head = f"# organbench {found.get('organbench', 'of the folder code')}, Python {platform.python_version()}"
    return "\n".join([head, *lines, ""])
