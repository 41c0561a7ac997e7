"""What to write instead of an import that worked in version 0.1."""

import ast
from importlib import import_module
from importlib.util import find_spec
from typing import NamedTuple

from studies.base.moved import MODULES, NAMES, RENAMED


class Moved(NamedTuple):
    """One name of an import statement, and where it is now."""

    old: str
    """The module that the statement names."""
    home: str
    name: str | None
    """None for `import module`."""
    alias: str | None
    asked: str | None = None
    """The name that the statement asks for, where it is another one now."""

    @property
    def is_there(self) -> bool:
        """Whether the new home has it."""
        if self.name in (None, "*"):
            return True
        return hasattr(import_module(self.home), str(self.name)) or _is_module(f"{self.home}.{self.name}")


def advice(source: str | bytes, line: int) -> str | None:
    """The sentence "studies.case is now studies.runs.case; write `…`" for the import in a line of `source`.

    None where the line imports nothing that has moved, or from a module that is still there a name that it lacks.
    """
    asked = _asked(source, line)
    moved = [each for each in asked if each.home != each.old or each.asked]
    if not moved:
        return None
    found, lost = [each for each in asked if each.is_there], [each for each in asked if not each.is_there]
    if lost and _is_module(lost[0].old):
        return None
    first = moved[0]
    homes = " and ".join(dict.fromkeys(each.home for each in moved))
    if first.home == first.old:
        first, homes = first._replace(old=f"{first.old}.{first.asked}"), f"{first.home}.{first.name}"
    write = " and ".join(f"`{statement}`" for statement in _statements(found))
    gone = ", ".join(str(each.name) for each in lost)
    parts = [
        f"{first.old} is now {homes}",
        *([f"write {write}"] if write else []),
        *([f"{gone} is gone"] * bool(gone)),
    ]
    return "; ".join(parts)


def _asked(source: str | bytes, line: int) -> list[Moved]:
    for node in ast.walk(ast.parse(source)):
        if not isinstance(node, ast.Import | ast.ImportFrom) or not node.lineno <= line <= (node.end_lineno or line):
            continue
        if isinstance(node, ast.Import):
            return [Moved(a.name, MODULES.get(a.name, a.name), None, a.asname) for a in node.names]
        return [_named(node.module or "", a.name, a.asname) for a in node.names if not node.level]
    return []


def _named(module: str, name: str, alias: str | None) -> Moved:
    """Of `from module import name`, which may itself be a module."""
    full = f"{module}.{name}"
    if full in MODULES:
        home, _, last = MODULES[full].rpartition(".")
        return Moved(full, home, last, alias or (name if last != name else None))
    home = NAMES.get(full, MODULES.get(module, module))
    new = RENAMED.get(f"{home.split('.')[0]}.{name}")
    if new is None or not _is_module(home) or hasattr(import_module(home), name):
        return Moved(module, home, name, alias)
    return Moved(module, home, new, alias or name, name)


def _statements(found: list[Moved]) -> list[str]:
    """One import statement per home."""
    words: dict[str, list[str]] = {}
    for each in found:
        word = each.home if each.name is None else each.name
        words.setdefault("" if each.name is None else each.home, []).append(
            word + (f" as {each.alias}" if each.alias else "")
        )
    return [f"from {home} import {', '.join(w)}" if home else f"import {', '.join(w)}" for home, w in words.items()]


def _is_module(name: str) -> bool:
    """Whether a module of this name can be imported."""
    try:
        return find_spec(name) is not None
    except ModuleNotFoundError:  # its package is gone, or is a module now
        return False
