"""README and CONTRIBUTING say what is true: code runs, recipes satisfy the contracts, the table is the stored one."""

import re
import unicodedata
from pathlib import Path

import pytest

from studies.catalog import STUDIES
from studies.peers.study import STUDY as PEERS
from studies.report.publish import EXTRAS, PUBLISHED
from studies.report.summary import SUMMARIES

ROOT = Path(__file__).parent.parent
PACKAGES = ("massspring", "reference_fem", "studies")
PROSE = ("README.md", "CHANGELOG.md", "CONTRIBUTING.md", "SECURITY.md", "docs/how-a-run-works.md", "docs/theory.md",
         "docs/notation.md", "docs/equations.md", "docs/meshes.md", "docs/own-organ.md", "docs/paper.md",
         "docs/breaking.md", "docs/cluster.md", "docs/population.md", "docs/results.md",
         "docs/methods.md", "docs/accuracy.md")  # fmt: skip
FENCE = re.compile(r"```python\n(.*?)```", re.DOTALL)


def code(document: str, heading: str) -> str:
    """The Python block under a heading."""
    text = (ROOT / document).read_text(encoding="utf-8")
    section = text.split(f"## {heading}\n", 1)[1].split("\n## ", 1)[0]
    found = FENCE.findall(section)
    assert len(found) == 1, f"{document}, '{heading}': one block of Python expected"
    return found[0]


def executed(document: str, heading: str) -> dict:
    """What the block under a heading defines."""
    scope: dict = {"__name__": "recipe"}
    exec(compile(code(document, heading), f"{document}#{heading}", "exec"), scope)
    return scope


def test_the_example_of_readme_runs(capsys):
    executed("README.md", "In Python")
    free, kept = capsys.readouterr().out.strip().split("\n")
    assert float(free.split()[-1]) < 0.95
    assert float(kept.split()[-1]) == pytest.approx(1.0, abs=1e-5)


@pytest.mark.parametrize("summary", SUMMARIES, ids=lambda summary: summary.name)
def test_the_tables_of_the_pages_are_the_stored_ones(summary):
    begin, end = summary.marks
    shown = (ROOT / summary.page).read_text(encoding="utf-8").split(begin)[1].split(end)[0].strip()
    assert shown == (ROOT / PUBLISHED / summary.file).read_text(encoding="utf-8").strip()


def test_readme_names_only_charts_that_are_made():
    linked = set(
        re.findall(r"\(results/published/(\w+)/(\w+\.png)\)", (ROOT / "README.md").read_text(encoding="utf-8"))
    )
    made = {(study.name, chart.file) for study in (*STUDIES, PEERS) for chart in study.charts}
    assert {link for link in linked if link[0] not in (*EXTRAS, "reference")} <= made
    for folder, file in linked:
        assert (ROOT / PUBLISHED / folder / file).is_file()


NUMBER = r"\d+(?:\.\d+)?"
CITED = re.compile(rf"\beqs?\. ((?:{NUMBER}(?:, | ?– ?| to | and )?)+)")


def labels() -> list[str]:
    """Numbers of the equations, in the order of docs/theory.md."""
    return re.findall(rf"\*\*\(({NUMBER})\)\*\*", (ROOT / "docs/theory.md").read_text(encoding="utf-8"))


def test_every_equation_the_code_cites_is_in_the_theory():
    known, cited = set(labels()), 0
    for package in (*PACKAGES, "tests"):
        for source in ROOT.glob(f"{package}/**/*.py"):
            for group in CITED.findall(source.read_text(encoding="utf-8")):
                for number in re.findall(NUMBER, group):
                    assert number in known, f"{source.name} cites equation {number}"
                    cited += 1
    assert cited > 250


def test_equations_are_numbered_once_and_the_table_of_old_numbers_is_complete():
    rows = re.findall(r"^\| (\S+) \| (\d+\.\d+) \|", (ROOT / "docs/equations.md").read_text(encoding="utf-8"), re.M)
    old, new = [old for old, _ in rows if old != "–"], [new for _, new in rows]
    assert labels() in (old, new)
    assert len(set(old)) == len(old)
    for section in range(1, 15):
        assert [n for n in new if n.startswith(f"{section}.")] == [
            f"{section}.{k + 1}" for k in range(sum(n.startswith(f"{section}.") for n in new))
        ]


def test_how_a_run_works_names_what_is_there():
    """Each step's folder, each name with its file; the drawing shows the same folders, and types that are defined."""
    page = (ROOT / "docs/how-a-run-works.md").read_text(encoding="utf-8")
    rows = re.findall(r"^\| (\d+) ([\w -]+) \| (\S+) \|", page, re.M)
    assert [int(number) for number, _, _ in rows] == list(range(1, len(rows) + 1))
    assert all((ROOT / folder / "__init__.py").is_file() for _, _, folder in rows)
    named = re.findall(r"`(\w+)` \(([\w/]+\.py)\)", page)
    assert len(named) > 20
    for name, file in named:
        source = (ROOT / file).read_text(encoding="utf-8")
        assert re.search(rf"^(?:class|def) {name}\b", source, re.M), f"{file} defines no {name}"
    drawing = (ROOT / "docs/how-a-run-works.svg").read_text(encoding="utf-8")
    shown = re.findall(r'class="title"[^>]*>(\d+) ([^<]+)</text>\n<text class="room"[^>]*>([^<]+)<', drawing)
    assert sorted(shown, key=lambda row: int(row[0])) == rows
    types = set(re.findall(r'class="type"[^>]*>(\w+)<', drawing))
    assert len(types) > 8 and types <= {name for name, _ in named}
    assert len(drawing) < 40_000


def test_names_of_the_notation_stand_in_the_code():
    code = "".join(file.read_text(encoding="utf-8") for package in PACKAGES for file in ROOT.glob(f"{package}/**/*.py"))
    table = (ROOT / "docs/notation.md").read_text(encoding="utf-8").split("## Names in the code")[1]
    names = {name for row in re.findall(r"^\| ([^|]+) \|", table, re.M) for name in re.findall(r"`(\w+)`", row)}
    assert len(names) > 10
    gone = sorted(name for name in names if not re.search(rf"\b{name}\b", code))
    assert not gone, f"docs/notation.md names what the code does not have: {', '.join(gone)}"


def test_prose_of_the_docs_fits_a_screen():
    """At most 120 columns, but for tables and lines that hold a link."""
    for page in map(ROOT.joinpath, PROSE):
        for line in page.read_text(encoding="utf-8").split("\n"):
            width = sum(not unicodedata.combining(letter) for letter in line)
            assert width <= 120 or line.startswith(("|", "    ")) or "](" in line, f"{page.name}: {line[:60]}"


def test_the_first_link_of_readme_is_the_way_of_a_run():
    text = (ROOT / "README.md").read_text(encoding="utf-8")
    assert re.findall(r"(?<!!)\[[^\]]*\]\(([^)]+)\)", text)[0] == "docs/how-a-run-works.md"
