"""The pages: code runs, commands exist, links lead somewhere, recipes satisfy the contracts, words are plain."""

import re
import shlex
import tokenize
from pathlib import Path
from typing import Any

import pytest
import typer

from studies.catalog import STUDIES
from studies.cli.app import app
from studies.lab.publish.__main__ import EXTRAS

ROOT = Path(__file__).parent.parent
PACKAGES = ("massspring", "reference_fem", "studies")
PAGES = (*(ROOT / name for name in ("README.md", "CHANGELOG.md", "CONTRIBUTING.md", "SECURITY.md")),
         *sorted(ROOT.glob("docs/*.md")))  # fmt: skip
FENCE = re.compile(r"```python\n(.*?)```", re.DOTALL)
HISTORY, LONG = (
    "CHANGELOG.md",
    ("CHANGELOG.md", "CONTRIBUTING.md", "theory.md", "results.md", "cutting.md"),
)
QUOTED = "methods.md"
"""Shows docstrings of the solvers."""


def read(page: Path) -> str:
    return page.read_text(encoding="utf-8")


def code(document: str, heading: str) -> str:
    """The first Python block under a heading."""
    section = read(ROOT / document).split(f"## {heading}\n", 1)[1].split("\n## ", 1)[0]
    blocks = FENCE.findall(section)
    assert blocks, f"{document}, '{heading}': a block of Python expected"
    return blocks[0]


def test_the_example_of_readme_prints_what_is_shown(capsys):
    exec(compile(code("README.md", "In Python"), "README.md", "exec"), {"__name__": "example"})
    shown = read(ROOT / "README.md").split("```text\n")[1].split("```")[0]
    assert capsys.readouterr().out == shown


def test_pages_are_short():
    assert [page.name for page in PAGES if page.name not in LONG and read(page).count("\n") > 250] == []


def test_charts_of_the_pages_are_those_that_are_made():
    linked = {link for page in PAGES for link in re.findall(r"results/published/(\w+)/(\w+\.png)\)", read(page))}
    made = {(study.name, chart.file) for study in STUDIES for chart in study.charts}
    assert len(linked) > 10
    assert {link for link in linked if link[0] not in EXTRAS} <= made


def anchors(page: Path) -> set[str]:
    """The anchors of a page's headings, as GitHub makes them."""
    titles = re.findall(r"^#+ (.*)$", re.sub(r"```.*?```", "", read(page), flags=re.DOTALL), re.M)
    return {re.sub(r"[^\w\- ]", "", title.lower()).replace(" ", "-") for title in titles}


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.name)
def test_links_lead_somewhere(page):
    for link in re.findall(r"\]\(([^)\s]+)\)", read(page)):
        if link.startswith("http"):
            continue
        file, _, anchor = link.partition("#")
        target = page.parent / file if file else page
        assert target.exists(), f"{page.name} links to {link}"
        assert not anchor or anchor in anchors(target), f"{page.name} links to {link}"


def commands(page: Path) -> list[str]:
    """Every line `organbench …` of a page, without a trailing comment."""
    text = read(page)
    lines = re.findall(r"^(?:    |# )organbench (.*)$", text, re.M) + re.findall(r"`organbench ([^`]+)`", text)
    return [re.split(r"\s{2,}|\s#\s", " ".join(line.split("\n")))[0] for line in lines]


NOTEBOOKS = sorted(ROOT.glob("docs/gallery/*.py"))


@pytest.mark.parametrize("page", [p for p in PAGES if p.name != HISTORY] + NOTEBOOKS, ids=lambda page: page.name)
def test_commands_of_a_page_exist(page):
    """Each command, with each option that the line names."""
    for line in commands(page):
        words = [word for word in shlex.split(line) if word not in ("||", "…", "COMMAND")]
        command: Any = typer.main.get_command(app)
        context = command.context_class(command)
        while hasattr(command, "resolve_command") and words and not words[0].startswith("-"):
            _, command, words = command.resolve_command(context, words)
            context = command.context_class(command, parent=context)
        options = {name for option in command.get_params(context) for name in option.opts + option.secondary_opts}
        named = {word.split("=")[0] for word in words if word.startswith("-") and not word.lstrip("-").isdigit()}
        assert named <= options | {"--install-completion"}, f"{page.name}: organbench {line}"


def test_targets_of_make_exist():
    targets = re.findall(r"^([\w%/.-]+(?: [\w%/.-]+)*):", read(ROOT / "Makefile"), re.M)
    names = {name for line in targets for name in line.split()}
    made = {f"study-{study.name}" for study in STUDIES}
    for page in PAGES:
        if page.name != HISTORY:
            for name in re.findall(r"(?:`|^    )make ([\w-]+)", read(page), re.M):
                assert name in names | made or name == "study-NAME", f"{page.name}: make {name}"


FOREIGN = ("anew", "of before", "mend", "mends", "mended", "beside", "told", "untold", "retreat", "dearer",
           "usual wish", "inside out", "drawn middles", "what a scene holds", "tells of", "so it is said",
           "is said when", "and said")  # fmt: skip
"""Words that a reader of today stumbles over, and one-word-per-thing: "next to", "repair", "inverted", "target"."""


@pytest.mark.parametrize(
    "page", [p for p in PAGES if p.name not in (HISTORY, QUOTED)] + NOTEBOOKS, ids=lambda page: page.name
)
def test_words_are_plain(page):
    text = " ".join(re.sub(r"`[^`]*`", "", read(page)).split())
    used = [word for word in FOREIGN if re.search(rf"\b{word}\b", text, re.I)]
    assert not used, f"{page.name}: {', '.join(used)}"


def test_a_message_in_troubleshooting_is_one_that_is_printed():
    """The parts of every heading that quotes a message stand in the sources."""
    page = read(ROOT / "docs/troubleshooting.md")
    sources = "".join(read(file) for package in PACKAGES for file in ROOT.glob(f"{package}/**/*.py"))
    sources += read(ROOT / ".ci/setup")
    quoted = re.findall(r"^## \*(.*)\*$", page, re.M)
    assert len(quoted) >= 8
    for message in quoted:
        for part in message.split(" … "):
            assert part in sources, f"no message contains '{part}'"


NUMBER = r"\d+(?:\.\d+)?"
CITED = re.compile(rf"\b[Ee](?:qs?\.|quations?) \(?((?:{NUMBER}(?:, | ?– ?| to | and )?)+)")
BARE = re.compile(r"(?<!\w)(?<!\d )\((\d{1,2}(?:\.\d+)?)\)(?! \[)")
ELSEWHERE = re.compile(r"Van Oosterom and Strackee \(1983\), equation 8|iparm\(.*")
"""Numbers of other people's equations and arrays."""


def labels() -> list[str]:
    """Numbers of the equations, in the order of docs/theory.md."""
    return re.findall(rf"\*\*\(({NUMBER})\)\*\*", (ROOT / "docs/theory.md").read_text(encoding="utf-8"))


def prose(source: Path) -> str:
    """The comments and docstrings of a file."""
    with tokenize.open(source) as file:
        tokens = list(tokenize.generate_tokens(file.readline))
    kinds = [t.string for t in tokens if t.type == tokenize.COMMENT or t.string.startswith('"""')]
    return ELSEWHERE.sub("", "\n".join(kinds))


def test_every_equation_the_code_cites_is_in_the_theory():
    """Also a number that stands alone in brackets, as (8.5) does where a line breaks after "eq."."""
    numbers, cited = set(labels()), 0
    for package in (*PACKAGES, "tests"):
        for source in ROOT.glob(f"{package}/**/*.py"):
            text = prose(source)
            for group in [*CITED.findall(text), *BARE.findall(text)]:
                for number in re.findall(NUMBER, group):
                    assert number in numbers, f"{source.name} cites equation {number}"
                    cited += 1
    assert cited > 250


def test_equations_are_numbered_in_order_from_one_in_each_section():
    sections = sorted({int(label.split(".")[0]) for label in labels()})
    counts = [sum(label.startswith(f"{section}.") for label in labels()) for section in sections]
    assert labels() == [f"{s}.{k + 1}" for s, count in zip(sections, counts, strict=True) for k in range(count)]


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
