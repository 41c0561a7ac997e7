"""Names and first lines as they stand in the sources: `list` has to be quick, and loading numba is not."""

import ast
from collections.abc import Iterator
from importlib.util import find_spec
from pathlib import Path

from studies.base.errors import StudyError


def studies() -> list[tuple[str, str]]:
    """(name, question) of each of STUDIES, the name of its module and the first line there, and of the population."""
    homes = _registered("studies.catalog", "STUDIES")
    catalogue = [(module.rsplit(".", 1)[1], _first_line(_parsed(module))) for _, module in homes]
    return [*catalogue, ("population", _first_line(_parsed("studies.population.study")))]


def methods() -> list[tuple[str, str]]:
    """(name, first line) of each of METHODS and of LITERATURE."""
    found = []
    homes = [home for registry in ("METHODS", "LITERATURE") for home in _registered("massspring.methods", registry)]
    for name, module in homes:
        (node,) = [n for n in _parsed(module).body if isinstance(n, ast.ClassDef) and n.name == name]
        (word,) = [
            n.value.value
            for n in node.body
            if isinstance(n, ast.AnnAssign) and _named(n.target, "name") and isinstance(n.value, ast.Constant)
        ]
        found.append((str(word), _first_line(node)))
    return found


def metrics() -> list[tuple[str, str]]:
    """(name, description) of each of METRICS: calls of a name, a unit, a direction and a function."""
    tree = _parsed("studies.metrics.metrics")
    functions = {n.name: _first_line(n) for n in tree.body if isinstance(n, ast.FunctionDef)}
    found = []
    for item in _tuple(tree, "METRICS"):
        if not (isinstance(item, ast.Call) and isinstance(item.args[0], ast.Constant)):
            raise StudyError("METRICS is no tuple of calls; list its metrics one by one")
        function = item.args[3]
        found.append((str(item.args[0].value), functions[function.id] if isinstance(function, ast.Name) else ""))
    return found


def _registered(module: str, registry: str) -> Iterator[tuple[str, str]]:
    """(name, module it is imported from) of the items of a tuple. Raises StudyError where there is none."""
    tree = _parsed(module)
    homes = {alias.name: node.module for node in tree.body if isinstance(node, ast.ImportFrom) for alias in node.names}
    for item in _tuple(tree, registry):
        if not (isinstance(item, ast.Name) and item.id in homes):
            raise StudyError(f"{registry} of {module} is no tuple of imported names; import and list them one by one")
        yield item.id, str(homes[item.id])


def _tuple(tree: ast.Module, name: str) -> list[ast.expr]:
    for node in tree.body:
        if isinstance(node, ast.AnnAssign) and _named(node.target, name) and isinstance(node.value, ast.Tuple):
            return node.value.elts
    raise StudyError(f"there is no tuple {name} with its type; write NAME: tuple[...] = (...)")


def _named(node: ast.expr, name: str) -> bool:
    return isinstance(node, ast.Name) and node.id == name


def _parsed(module: str) -> ast.Module:
    """The syntax tree of a module of this project; neither it nor the packages round it are run."""
    top, *parts = module.split(".")
    spec = find_spec(top)
    assert spec is not None and spec.origin is not None  # the packages of the project are installed together
    path = Path(spec.origin).parent.joinpath(*parts)
    source = path / "__init__.py" if path.is_dir() else path.with_suffix(".py")
    return ast.parse(source.read_bytes())


def _first_line(node: ast.Module | ast.ClassDef | ast.FunctionDef) -> str:
    return (ast.get_docstring(node) or "").strip().split("\n")[0]
