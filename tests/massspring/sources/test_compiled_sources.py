"""Compiled functions: what they may use, and which edit compiles them again."""

import ast
import gc
import re
import subprocess
import sys
from pathlib import Path
from types import ModuleType

import numba
import pytest

from massspring import compile_cache, sources
from massspring.compile_cache import ARGUMENTS as GIVEN
from massspring.compile_cache import COMPILED, kept
from massspring.sources import ROOT, own_file
from tests.massspring.sources.conftest import fresh

DECORATORS = ("compiled", "njit_lean", "njit_inlined", "njit_exposed", "njit_ignoring_nan", "njit_reassociated")
MARK = re.compile(rf"^ *@({'|'.join(DECORATORS)})\b", re.MULTILINE)
"""Where one of them stands: to parse all modules takes every process of the tests some seconds."""


def compiled_modules() -> list[str]:
    """Modules whose functions carry one of the decorators of compiled code."""
    files = [file for package in sources.OWN for file in sorted((ROOT / package).rglob("*.py"))]
    marked = [file for file in files if MARK.search(file.read_text())]
    return [".".join(file.relative_to(ROOT).with_suffix("").parts) for file in marked]


def decorated(node: ast.AST) -> bool:
    """Whether it is a function to compile."""
    marks = getattr(node, "decorator_list", [])
    return any(ast.unparse(mark).split("(")[0] in DECORATORS for mark in marks)


@pytest.mark.parametrize("module", compiled_modules())
def test_compiled_functions_use_nothing_from_where_edits_go_unseen(module):
    """A constant or function of another folder would be compiled in, and its edit would leave stale code in use."""
    file = own_file(module)
    assert file is not None
    tree = ast.parse(file.read_text())
    imported = {
        alias.asname or alias.name: node.module
        for node in ast.walk(tree)
        if isinstance(node, ast.ImportFrom) and node.module
        for alias in node.names
    }
    for function in filter(decorated, ast.walk(tree)):
        for node in ast.walk(function):
            origin = imported.get(node.id) if isinstance(node, ast.Name) else None
            own = origin is not None and origin.split(".")[0] in sources.OWN
            assert not own or origin.startswith(COMPILED) or origin == module, f"{node.id} comes from {origin}"


KERNEL = """from massspring.table import LIMIT


def kernel(x):
    '''Adds the limit [1].'''
    return x + LIMIT
"""


@pytest.fixture(autouse=True)
def no_arguments(monkeypatch):
    """The kernels of the copies take numbers, and `sys.modules` has their module: numba looks it up by name."""
    monkeypatch.setattr(compile_cache, "ARGUMENTS", ())
    monkeypatch.setitem(sys.modules, "massspring.kernel", ModuleType("massspring.kernel"))


def compiled_now(folder: Path):
    """The kernel of the copy, as a new process would import it, called once: nothing of an earlier one is left."""
    fresh("massspring.kernel")
    gc.collect()
    names = vars(sys.modules["massspring.kernel"])
    names["LIMIT"] = 3
    file = folder / "massspring" / "kernel.py"
    body = "\n" + file.read_text().split("\n", 1)[1]  # the import is of the copy, LIMIT is given
    exec(compile(body, file, "exec"), names)
    with kept():
        function = numba.njit(cache=True)(names.pop("kernel"))
    assert function(1) == 4
    return function.stats


def test_rewording_compiles_nothing_again_and_an_edit_does(checkout, monkeypatch):
    monkeypatch.delenv("NUMBA_CACHE_DIR", raising=False)
    monkeypatch.setattr(compile_cache, "COMPILED", ("massspring",))
    file = checkout / "massspring" / "kernel.py"
    file.write_text(KERNEL)
    assert sum(compiled_now(checkout).cache_misses.values()) == 1
    file.write_text(
        KERNEL.replace("Adds the limit", "Plus the limit,\n    as it stands").replace("LIMIT\n\n", "LIMIT\n\n\n")
    )
    assert not compiled_now(checkout).cache_misses
    (checkout / "massspring" / "table.py").write_text("LIMIT = 3.0\n")
    assert sum(compiled_now(checkout).cache_misses.values()) == 1


def test_fields_of_an_argument_that_change_places_compile_again(checkout, monkeypatch):
    """The kernel does not import the named tuple, and numba sees the same name and types as before."""
    monkeypatch.delenv("NUMBA_CACHE_DIR", raising=False)
    monkeypatch.setattr(compile_cache, "COMPILED", ("massspring",))
    (checkout / "massspring" / "kernel.py").write_text(
        KERNEL.replace("from massspring.table import LIMIT", "LIMIT = 3")
    )
    pair = checkout / "massspring" / "pair.py"
    for arguments, misses in (((), 0), (("massspring.pair",), 1)):
        monkeypatch.setattr(compile_cache, "ARGUMENTS", arguments)
        pair.write_text("class Pair(NamedTuple):\n    x: float\n    v: float\n")
        assert sum(compiled_now(checkout).cache_misses.values()) == 1
        pair.write_text("class Pair(NamedTuple):\n    v: float\n    x: float\n")
        assert sum(compiled_now(checkout).cache_misses.values()) == misses


def test_every_named_tuple_of_the_kernels_is_part_of_their_stamps():
    """An edit of any of them must change the number of what every kernel is given."""
    own = {
        ".".join(file.relative_to(ROOT).with_suffix("").parts)
        for file in (ROOT / "massspring" / "kernels").rglob("*.py")
        if "(NamedTuple)" in file.read_text()
    }
    assert len(own) > 5
    waiting, covered = list(GIVEN), set()
    while waiting:
        module = waiting.pop()
        if module not in covered:
            covered.add(module)
            waiting += [other for other in sources._followed(module) if other.startswith(COMPILED)]
    assert own <= covered


def test_numba_keeps_both_packages_in_the_folder_that_the_user_chose(tmp_path):
    code = (
        "from massspring.kernels.forces.springs import spring_forces_into as f\n"
        "from reference_fem.system.assembly import integrate_element as g\n"
        "print(f.stats.cache_path)\nprint(g.stats.cache_path)"
    )
    chosen = str(tmp_path / "chosen")
    environment = {"NUMBA_CACHE_DIR": chosen, "PYTHONPATH": str(ROOT), "PATH": "", "HOME": str(tmp_path)}
    done = subprocess.run([sys.executable, "-c", code], env=environment, capture_output=True, text=True, check=True)
    paths = [Path(line) for line in done.stdout.split()]
    assert all(path.parent == Path(chosen) for path in paths)
    assert [path.name.rsplit("-", 1)[0] for path in paths] == [
        "massspring.kernels.forces.springs",
        "reference_fem.system.assembly",
    ]
