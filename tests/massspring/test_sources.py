"""What is stale after which edit: on copies of small packages, and on the compiled functions of this distribution."""

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
from massspring.errors import MassSpringError
from massspring.sources import ROOT, own_file, read_source, source_fingerprint

FILES = {
    "massspring/__init__.py": "from massspring.light import light\nfrom massspring.heavy import heavy\n",
    "massspring/light.py": "'''Light.'''\nfrom massspring.table import LIMIT\n\n\ndef light():\n    return LIMIT\n",
    "massspring/heavy.py": "def heavy():\n    from massspring.late import late\n    return late()\n",
    "massspring/late.py": "def late():\n    return 1\n",
    "massspring/table.py": "LIMIT = 3\n'''[1].'''\n",
    "studies/__init__.py": "import lazy_loader\n",
    "studies/__init__.pyi": "from .ask import ask as ask\nfrom .more import *\n",
    "studies/more.py": "from studies.other import other\nfrom studies.ask import ask\n",
    "studies/other.py": "def other():\n    return 5\n",
    "studies/starred.py": "from studies import other\n",
    "studies/ask.py": "from massspring import light\n\n\ndef ask():\n    return light()\n",
    "studies/user.py": "from studies import ask\n",
    "studies/typed.py": "from typing import TYPE_CHECKING\nif TYPE_CHECKING:\n    from massspring import heavy\n",
}


@pytest.fixture
def checkout(tmp_path, monkeypatch):
    for name, text in FILES.items():
        (tmp_path / name).parent.mkdir(exist_ok=True)
        (tmp_path / name).write_text(text)
    monkeypatch.setattr(sources, "ROOT", tmp_path)
    return tmp_path


def fresh(*modules: str, **within) -> str:
    """As another process would find it."""
    for function in (source_fingerprint, sources._followed, sources._source):
        function.cache_clear()
    return source_fingerprint(*modules, **within)


@pytest.fixture(autouse=True)
def forget():
    yield
    for function in (source_fingerprint, sources._followed, sources._source):
        function.cache_clear()


EDITS = {
    # (file, before, after): the modules whose number changes
    ("massspring/table.py", "3", "4"): {"massspring.light", "studies.ask", "studies.user"},
    ("massspring/late.py", "1", "2"): {"massspring.heavy"},
    ("studies/other.py", "5", "6"): {"studies.starred"},
    ("massspring/heavy.py", "return", "yield"): {"massspring.heavy"},
    ("studies/ask.py", "ask()", "ask(x=1)"): {"studies.ask", "studies.user"},
    ("massspring/light.py", "Light", "Lighter"): {"massspring.light", "studies.ask", "studies.user"},
    ("massspring/__init__.py", "from massspring.heavy import heavy\n", ""): set(),
}


@pytest.mark.parametrize("edit", EDITS, ids=lambda edit: f"{edit[0]}: {edit[1]!r} -> {edit[2]!r}")
def test_an_edit_makes_stale_what_imports_it_and_nothing_else(checkout, edit):
    modules = [
        "massspring.light",
        "massspring.heavy",
        "studies.ask",
        "studies.user",
        "studies.typed",
        "studies.starred",
    ]
    before = {module: fresh(module) for module in modules}
    file, old, new = edit
    text = (checkout / file).read_text()
    assert old in text
    (checkout / file).write_bytes(text.replace(old, new).encode())
    assert {module for module in modules if fresh(module) != before[module]} == EDITS[edit]


def test_within_leaves_the_rest_out(checkout):
    before = fresh("studies.ask", within=("studies",))
    (checkout / "massspring" / "table.py").write_text("LIMIT = 4\n")
    assert fresh("studies.ask", within=("studies",)) == before != fresh("studies.ask")


def test_how_files_are_written_makes_no_result_stale(checkout, monkeypatch):
    """A record has a schema number of its own."""
    before = fresh("studies.ask")
    with (checkout / "studies" / "ask.py").open("a") as file:
        file.write("\nfrom studies.store import record\n")
    (checkout / "studies" / "store").mkdir()
    for name in ("__init__", "record"):
        (checkout / "studies" / "store" / f"{name}.py").write_text("x = 1\n")
    first = fresh("studies.ask")
    (checkout / "studies" / "store" / "record.py").write_text("x = 2\n")
    assert fresh("studies.ask") == first != before


def test_refusals(checkout):
    with pytest.raises(MassSpringError, match=r"no module 'studies.nothing' in massspring"):
        fresh("studies.nothing")
    (checkout / "studies" / "user.py").write_text("x = = 1\n")
    with pytest.raises(MassSpringError, match=r"user\.py is not valid Python \(.*, line 1\)"):
        fresh("studies.user")


def test_relative_imports_are_followed():
    source = read_source(b"from .b import c\nfrom .. import d\nimport massspring.e\n", "massspring.x.a", Path("a.py"))
    assert source.imports == [("massspring", "d"), ("massspring.e", ""), ("massspring.x.b", "c")]


def statements(tree: ast.Module) -> list[ast.stmt]:
    """Statements of a module, those below `if TYPE_CHECKING` or `if not TYPE_CHECKING` included."""
    body = []
    for node in tree.body:
        apart = isinstance(node, ast.If) and ast.unparse(node.test) in ("TYPE_CHECKING", "not TYPE_CHECKING")
        body += node.body if apart else [node]
    return body


def test_a_stub_leads_to_the_code_behind_a_name(checkout):
    (checkout / "studies/__init__.pyi").write_text("from .table import FIVE as FIVE\n")
    (checkout / "studies/table.py").write_text("FIVE = 5\n")
    (checkout / "studies/user.py").write_text("from studies import FIVE\n")
    before = fresh("studies.user")
    (checkout / "studies/table.py").write_text("FIVE = 6\n")
    assert fresh("studies.user") != before
    (checkout / "studies/user.py").write_text("from studies import SIX\n")
    with pytest.raises(MassSpringError, match="studies has no public name 'SIX': add it to"):
        fresh("studies.user")


def test_all_code_can_be_read():
    """It raises for a name whose module cannot be determined."""
    assert len(source_fingerprint(*sources.own_modules())) == 64


def faces() -> list[Path]:
    return [file for package in sources.OWN for file in (ROOT / package).rglob("__init__.py")]


def is_words(node: ast.stmt) -> bool:
    return isinstance(node, ast.Expr) and isinstance(node.value, ast.Constant)


@pytest.mark.parametrize("file", faces(), ids=lambda file: str(file.relative_to(ROOT)))
def test_a_package_computes_nothing_when_it_is_loaded(file):
    """The number of a module leaves out the packages around it; a function that it imports from one is followed."""
    for node in statements(ast.parse(file.read_text())):
        plain = isinstance(node, ast.Import | ast.ImportFrom | ast.Assign | ast.AnnAssign | ast.FunctionDef)
        assert plain or is_words(node), node.lineno


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


def test_an_edit_of_what_it_imports_compiles_it_again(checkout, monkeypatch):
    monkeypatch.setenv("NUMBA_CACHE_DIR", str(checkout / "compiled"))
    monkeypatch.setattr(compile_cache, "COMPILED", ("massspring",))
    (checkout / "massspring" / "kernel.py").write_text(KERNEL)
    assert sum(compiled_now(checkout).cache_misses.values()) == 1
    assert not compiled_now(checkout).cache_misses
    (checkout / "massspring" / "table.py").write_text("LIMIT = 3.0\n")
    assert sum(compiled_now(checkout).cache_misses.values()) == 1


def test_fields_of_an_argument_that_change_places_compile_again(checkout, monkeypatch):
    """The kernel does not import the named tuple, and numba sees the same name and types as before."""
    monkeypatch.setenv("NUMBA_CACHE_DIR", str(checkout / "compiled"))
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
