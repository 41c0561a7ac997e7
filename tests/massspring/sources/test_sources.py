"""What is stale after which edit: on copies of small packages, and on the compiled functions of this distribution."""

import ast
from pathlib import Path

import pytest

from massspring import sources
from massspring.errors import MassSpringError
from massspring.sources import ROOT, read_source, source_fingerprint
from tests.massspring.sources.conftest import fresh

EDITS = {
    # (file, before, after): the modules whose number changes
    ("massspring/table.py", "3", "4"): {"massspring.light", "studies.ask", "studies.user"},
    ("massspring/late.py", "1", "2"): {"massspring.heavy"},
    ("studies/other.py", "5", "6"): {"studies.starred"},
    ("massspring/heavy.py", "return", "yield"): {"massspring.heavy"},
    ("studies/ask.py", "ask()", "ask(x=1)"): {"studies.ask", "studies.user"},
    ("massspring/light.py", "Light", "Lighter"): set(),
    ("massspring/table.py", "[1]", "[m]"): set(),
    ("massspring/late.py", "def", "\n\n# a comment\ndef"): set(),
    ("massspring/__init__.py", "from massspring.heavy import heavy\n", ""): set(),
    ("massspring/table.py", "LIMIT = 3\n", "LIMIT = 3\r\n"): set(),
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


def test_a_damaged_or_unwritable_memory_costs_time_only(checkout):
    before = fresh("studies.ask")
    memory = checkout / "cache" / "organbench" / "sources.json"
    assert memory.is_file() and not list(memory.parent.glob("*.part"))
    for damage in ("{", "[]", ""):
        memory.write_text(damage)
        assert fresh("studies.ask") == before
    memory.unlink()
    memory.mkdir()
    assert fresh("studies.ask") == before


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


@pytest.mark.parametrize("file", faces(), ids=lambda file: str(file.relative_to(ROOT)))
def test_a_package_passes_names_on_and_computes_nothing(file):
    """The number of a module leaves out the packages around it: they must hold nothing that could change a result."""
    for node in statements(ast.parse(file.read_text())):
        plain = isinstance(node, ast.Import | ast.ImportFrom | ast.Assign | ast.AnnAssign)
        assert plain or sources._is_remark(node) or getattr(node, "name", "") in ("__getattr__", "__dir__"), node.lineno
