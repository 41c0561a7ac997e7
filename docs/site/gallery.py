"""The gallery: notebooks in docs/gallery, run from nothing, as pages with their pictures.

The sources are Python files in the percent format, which Jupyter opens as notebooks with jupytext.
"""

import os
import re
import sys
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from tempfile import TemporaryDirectory

import jupytext
import nbformat
from nbclient import NotebookClient
from nbclient.exceptions import CellExecutionError
from nbconvert import MarkdownExporter
from nbconvert.filters import strip_ansi

ROOT = Path(__file__).resolve().parents[2]
SOURCES = ROOT / "docs" / "gallery"
ORDER = ("first_steps", "own_scan", "own_method", "reading_results")
"""Of the menu; further ones follow."""
TOGETHER = 2
"""Notebooks that run at once."""
PATIENCE = 300
"""Seconds for a cell: the first one may have to compile."""
PICTURE, PICTURE_WORDS = "image/png", "What the cell above draws"


class BrokenNotebook(Exception):
    """A notebook that fails, or shows no picture."""


def gallery(target: Path, run: bool = True) -> list[Path]:
    """Writes the pages of all notebooks below `target`, in the order of the menu. Raises BrokenNotebook."""
    names = {path.stem: path for path in SOURCES.glob("*.py")}
    ordered = [name for name in ORDER if name in names] + sorted(names.keys() - set(ORDER))
    target.mkdir(parents=True, exist_ok=True)
    with ThreadPoolExecutor(TOGETHER) as pool:
        return list(pool.map(lambda name: write_page(names[name], target, run), ordered))


def write_page(source: Path, target: Path, run: bool = True) -> Path:
    """Writes the page of a notebook (run, or as it is), its pictures and the notebook. Raises BrokenNotebook."""
    notebook = executed(source) if run else jupytext.read(source)
    body, resources = MarkdownExporter(config=EXPORTED).from_notebook_node(
        notebook, {"output_files_dir": ".", "unique_key": source.stem}
    )
    for name, content in resources["outputs"].items():
        (target / name).write_bytes(content)
    nbformat.write(notebook, target / f"{source.stem}.ipynb")
    page = target / f"{source.stem}.md"
    link = f"[This page as a notebook]({source.stem}.ipynb){{download}}\n"
    page.write_text(f"{readable(body).rstrip()}\n\n{link}", encoding="utf-8")
    return page


def readable(body: str) -> str:
    """A page whose pictures say what they are, and whose tables look like the others of the site."""
    body = re.sub(r"<style scoped>.*?</style>\n?", "", body, flags=re.DOTALL)
    body = body.replace('<table border="1" class="dataframe">', "<table>").replace(' style="text-align: right;"', "")
    return body.replace("![png](./", f"![{PICTURE_WORDS}](")


EXPORTED = {"MarkdownExporter": {"exclude_input_prompt": True}}


def executed(source: Path) -> nbformat.NotebookNode:
    """A notebook with its results, run in an empty folder. Raises BrokenNotebook."""
    notebook = jupytext.read(source)
    with TemporaryDirectory(prefix=f"{source.stem}-") as folder:
        client = NotebookClient(
            notebook,
            timeout=PATIENCE,
            kernel_name="python3",
            coalesce_streams=True,
            extra_arguments=["--log-level=40"],  # errors alone: it warns of its plain, local connection
            resources={"metadata": {"path": folder}},
        )
        try:
            client.execute(env=environment())
        except CellExecutionError as error:
            raise BrokenNotebook(f"{source.name} fails: {strip_ansi(str(error))}") from error
    outputs = [output for cell in notebook.cells for output in cell.get("outputs", [])]
    if not any(PICTURE in output.get("data", {}) for output in outputs):
        raise BrokenNotebook(f"{source.name} shows no picture")
    return notebook


def environment() -> dict[str, str]:
    """Of the kernels: this code, this environment's commands, plain words in 100 columns."""
    paths = [str(Path(sys.executable).parent), os.environ["PATH"]]
    code = [str(ROOT), *filter(None, [os.environ.get("PYTHONPATH")])]
    # Jupyter sets FORCE_COLOR, by which programs take it for a terminal that moves its lines.
    plain = {"COLUMNS": "100", "NO_COLOR": "1", "TTY_COMPATIBLE": "0"}
    return os.environ | plain | {"PATH": os.pathsep.join(paths), "PYTHONPATH": os.pathsep.join(code)}
