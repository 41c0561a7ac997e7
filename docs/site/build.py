"""Builds the documentation site: `python docs/site/build.py`, then open site/index.html (no network needed).

With --links the notebooks are shown as they are written, not run: that takes a minute and checks every link.

Pages: README, CONTRIBUTING, SECURITY, CHANGELOG and docs/*.md as they stand, the notebooks of docs/gallery with what
they show, and one for every folder of the three packages with the docstrings of its modules, which are read from the
sources, not imported. A broken link ends with exit code 1, and so does a notebook that fails.
"""

import json
import re
import shutil
import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
SITE = ROOT / "docs" / "site"
STAGE = ROOT / "build" / "docs"
PACKAGES = ("massspring", "reference_fem", "studies")
MENU = {
    "Tutorial": ("first-study",),
    "How-to": (
        *("own-organ", "accuracy", "submit", "paraview", "archive", "population", "cluster"),
        *("CONTRIBUTING", "troubleshooting"),
    ),
    "Theory": ("theory", "paper", "breaking", "limits"),
    "Reference": ("findings", "methods", "results", "report", "meshes", "notation", "how-a-run-works"),
}
"""Pages of docs/, and of the root, in the order of the menu; further ones follow in its last part."""
ROOT_PAGES = ("CONTRIBUTING", "SECURITY", "CHANGELOG")
LINK = re.compile(r"\]\((?:\.\./)?(results/[^)#\s]+)\)")
"""A link or picture in results/."""
FOREIGN = re.compile(r"""(?:<(?:script|img|iframe)\b[^>]*\bsrc|<link\b[^>]*\bhref)=["']?((?:https?:)?//[^"'\s>]+)""")
"""A script, picture, style sheet or font of another host."""


def title(page: Path) -> str:
    """The first heading of a page."""
    return next(line for line in page.read_text(encoding="utf-8").splitlines() if line.startswith("# "))[2:]


def copy_pages() -> list:
    """Copies all pages and what they show of results/, with the paths that they have here; returns the menu."""
    shutil.rmtree(STAGE, ignore_errors=True)
    shutil.copytree(ROOT / "docs", STAGE / "docs", ignore=shutil.ignore_patterns("site"))
    shutil.copytree(SITE / "assets", STAGE / "assets")
    for file in ("README.md", "CONTRIBUTING.md", "SECURITY.md", "CHANGELOG.md", "LICENSE", "CITATION.cff"):
        shutil.copy(ROOT / file, STAGE / file)
    for page in STAGE.rglob("*.md"):
        for shown in LINK.findall(page.read_text(encoding="utf-8")):
            if (ROOT / shown).is_file():
                (STAGE / shown).parent.mkdir(parents=True, exist_ok=True)
                shutil.copy(ROOT / shown, STAGE / shown)
    pages = {page.stem: page for page in sorted(STAGE.glob("docs/*.md"))}
    pages |= {name: STAGE / f"{name}.md" for name in ROOT_PAGES}
    further = pages.keys() - {name for names in MENU.values() for name in names}
    menu = {part: [name for name in names if name in pages] for part, names in MENU.items()}
    menu["Reference"] += [name for name in pages if name in further]
    parts = {part: [{title(pages[n]): str(pages[n].relative_to(STAGE))} for n in names] for part, names in menu.items()}
    return [{"organbench": "README.md"}, *({part: entries} for part, entries in parts.items())]


def gallery_pages(run: bool) -> list:
    """Runs the notebooks, if wanted, and writes their pages; their part of the menu. Raises BrokenNotebook."""
    from gallery import gallery  # its libraries are needed for this alone

    return [{title(page): str(page.relative_to(STAGE))} for page in gallery(STAGE / "docs" / "gallery", run)]


def section(module: str, **options: bool) -> str:
    """The docstrings of a module, for mkdocstrings."""
    return f"::: {module}\n    options: {json.dumps(options)}\n"


def api_page(folder: Path) -> dict:
    """Writes the page of a folder: its own docstring, then its modules one by one; returns its entry in the menu.

    The page of a package also has the names that a user imports from it, and the modules that lie beside its folders.
    """
    top, name = folder.parent == ROOT, dotted(folder)
    files = sorted(folder.glob("*.py") if top else folder.rglob("*.py"))
    modules = [dotted(file.with_suffix("")) for file in files if not file.stem.startswith("__")]
    parts = [section(name, members=top, show_submodules=False), *(section(module) for module in modules)]
    (STAGE / "api").mkdir(exist_ok=True)
    (STAGE / "api" / f"{name}.md").write_text("\n".join([f"# {name}\n", *parts]), encoding="utf-8")
    return {name: f"api/{name}.md"}


def dotted(path: Path) -> str:
    """The name by which Python imports a file or folder."""
    return ".".join(path.relative_to(ROOT).parts)


def api_pages() -> list:
    """A page for every package and every folder in it; their part of the menu."""
    folders = {name: sorted(file.parent for file in ROOT.glob(f"{name}/*/__init__.py")) for name in PACKAGES}
    return [{name: [api_page(folder) for folder in (ROOT / name, *found)]} for name, found in folders.items()]


def foreign(site: Path) -> list[str]:
    """What pages would load from other hosts: a reader needs no network."""
    pages = {page: FOREIGN.findall(page.read_text(encoding="utf-8")) for page in site.rglob("*.html")}
    return [f"{page.relative_to(site)} loads {address}" for page, found in pages.items() for address in found]


def main(links_alone: bool) -> int:
    """Copies, writes, builds and checks; the exit code."""
    config = {
        "INHERIT": str(SITE / "config.yml"),
        "docs_dir": str(STAGE),
        "site_dir": str(ROOT / "site"),
        "nav": [*copy_pages(), {"Gallery": gallery_pages(run=not links_alone)}, {"API": api_pages()}],
        "plugins": {"mkdocstrings": {"custom_templates": str(SITE / "templates")}},
    }
    file = ROOT / "build" / "mkdocs.yml"
    file.write_text(json.dumps(config), encoding="utf-8")  # JSON is YAML
    command = [sys.executable, "-m", "mkdocs", "build", "--strict", "--config-file", str(file)]
    code = subprocess.run(command, cwd=ROOT, check=False).returncode
    loads = foreign(ROOT / "site")
    print(*loads, sep="\n", end="\n" if loads else "")
    return code or int(bool(loads))


if __name__ == "__main__":
    sys.exit(main("--links" in sys.argv[1:]))
