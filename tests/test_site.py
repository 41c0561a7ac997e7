"""The documentation site: every page and module is in it, and nothing is loaded from another host."""

import importlib.util
import re
from collections import Counter
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]


@pytest.fixture
def build(tmp_path, monkeypatch):
    """docs/site/build.py, writing into a folder of its own."""
    spec = importlib.util.spec_from_file_location("build_site", ROOT / "docs/site/build.py")
    assert spec is not None and spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    monkeypatch.setattr(module, "STAGE", tmp_path)
    return module


def test_every_page_is_in_the_menu_and_what_it_shows_is_copied(build, tmp_path):
    first, *parts = build.copy_pages()
    menu = [file for part in parts for entries in part.values() for entry in entries for file in entry.values()]
    pages = {f"docs/{page.name}" for page in ROOT.glob("docs/*.md")} | {
        "CONTRIBUTING.md",
        "SECURITY.md",
        "CHANGELOG.md",
    }
    assert first == {"organbench": "README.md"}
    assert set(menu) == pages and len(menu) == len(pages)
    assert [part for entry in parts for part in entry] == ["Tutorial", "How-to", "Theory", "Reference"]
    assert menu[0] == "docs/first-study.md"
    shown = [
        file
        for page in ("README.md", "docs/findings.md")
        for file in re.findall(r"\]\((?:\.\./)?(results/[^)]+)\)", (ROOT / page).read_text(encoding="utf-8"))
    ]
    assert len(shown) > 10 and all((tmp_path / file).is_file() for file in shown)


def test_every_module_has_its_docstrings_on_one_page(build, tmp_path):
    build.api_pages()
    written = Counter(
        name for page in tmp_path.glob("api/*.md") for name in re.findall(r"^::: (\S+)$", page.read_text(), re.M)
    )
    modules = {
        ".".join(file.relative_to(ROOT).with_suffix("").parts)
        for package in build.PACKAGES
        for file in ROOT.glob(f"{package}/**/*.py")
        if not file.stem.startswith("__")
    }
    assert modules <= set(written) and set(written.values()) == {1}


@pytest.mark.parametrize(
    ("page", "loaded"),
    [
        ('<script src="https://cdn.example/a.js"></script>', ["https://cdn.example/a.js"]),
        ('<link rel="stylesheet" href="//fonts.example/css">', ["//fonts.example/css"]),
        ('<img alt="" src="http://pictures.example/a.png">', ["http://pictures.example/a.png"]),
        ('<a href="https://elsewhere.example">read</a><script src="assets/a.js"></script>', []),
    ],
)
def test_what_a_page_loads_from_other_hosts_is_found(build, tmp_path, page, loaded):
    (tmp_path / "index.html").write_text(page)
    assert build.foreign(tmp_path) == [f"index.html loads {address}" for address in loaded]
