"""Names and descriptions, read from the sources: importing what `organbench list` shows takes longer than a second.

A test holds them equal to what the modules say.
"""

import ast
from pathlib import Path
from typing import Any

import studies as package

ROOT = Path(package.__file__).parents[1]
Rows = list[tuple[str, str]]


def studies() -> Rows:
    """(name, question) of each of STUDIES, the name of its module and its first paragraph, and of the population."""
    modules = [module for module, _ in _registered("studies.catalog", "STUDIES")]
    rows = [(module.rsplit(".", 1)[1], _summary(_parsed(module))) for module in modules]
    return [*rows, ("population", _summary(_parsed("studies.catalog.population.study")))]


def methods() -> Rows:
    """(name, first paragraph) of each of METHODS and of LITERATURE."""
    homes = [home for registry in ("METHODS", "LITERATURE") for home in _registered("massspring.methods", registry)]
    classes = [_defined(_parsed(module), name) for module, name in homes]
    return [(_assigned(one, "name").value, _summary(one)) for one in classes]


def metrics() -> Rows:
    """(name, first paragraph) of each of METRICS: calls of a name, a unit, a direction and a function, which is of
    the same module or, as cutting.cut_ms, of one next to it."""
    package = "studies.metrics"
    tree = _parsed(f"{package}.metrics")
    calls = [item.args for item in _assigned(tree, "METRICS").elts]

    def documented(function: Any) -> str:
        if isinstance(function, ast.Attribute):
            return _summary(_defined(_parsed(f"{package}.{ast.unparse(function.value)}"), function.attr))
        return _summary(_defined(tree, function.id))

    return [(name.value, documented(function)) for name, _, _, function, *_ in calls]


def _registered(module: str, registry: str) -> list[tuple[str, str]]:
    """(module it is imported from, name) of the items of a tuple."""
    tree = _parsed(module)
    homes = {alias.name: node.module for node in tree.body if isinstance(node, ast.ImportFrom) for alias in node.names}
    return [(str(homes[item.id]), item.id) for item in _assigned(tree, registry).elts]


def _assigned(node: Any, name: str) -> Any:
    """The value of NAME: type = value in a module or class."""
    assignments = (one for one in node.body if isinstance(one, ast.AnnAssign) and ast.unparse(one.target) == name)
    return next(assignments).value


def _defined(tree: ast.Module, name: str) -> Any:
    """The class or function of this name."""
    return next(one for one in tree.body if getattr(one, "name", None) == name)


def _parsed(module: str) -> ast.Module:
    """The syntax tree of a module of this project; neither it nor the packages around it are run."""
    path = ROOT.joinpath(*module.split("."))
    return ast.parse((path / "__init__.py" if path.is_dir() else path.with_suffix(".py")).read_bytes())


def _summary(node: Any) -> str:
    """The first paragraph of the docstring."""
    return " ".join((ast.get_docstring(node) or "").split("\n\n")[0].split())
