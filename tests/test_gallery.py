"""The gallery: a notebook is run from nothing and becomes a page; one that fails, or shows nothing, is refused."""

import importlib.util
import json
import re
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
SOURCES = sorted(ROOT.glob("docs/gallery/*.py"))
REASON = "the libraries of notebooks are not installed: pip install 'organbench[docs]'"
GOOD = """# %% [markdown]
# # Title
#
# Words.

# %%
import matplotlib.pyplot as plt
plt.plot([0, 1])
plt.show()

# %%
import pandas as pd
pd.DataFrame({"a": [1]})

# %% language="bash"
# echo told; organbench --version
"""


@pytest.fixture(scope="module")
def gallery():
    """docs/site/gallery.py."""
    for name in ("jupytext", "nbclient", "nbconvert", "ipykernel"):
        pytest.importorskip(name, reason=REASON)
    spec = importlib.util.spec_from_file_location("build_gallery", ROOT / "docs/site/gallery.py")
    assert spec is not None and spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


@pytest.fixture
def written(gallery, tmp_path):
    """Makes a page of the text of a notebook: its folder."""

    def write(text: str) -> Path:
        (tmp_path / "made.py").write_text(text)
        gallery.write_page(tmp_path / "made.py", tmp_path)
        return tmp_path

    return write


def test_a_notebook_becomes_a_page_with_its_pictures(written):
    folder = written(GOOD)
    page = (folder / "made.md").read_text(encoding="utf-8")
    assert page.startswith("# Title\n\nWords.")
    assert re.search(r"^    told\n    organbench \d", page, re.M)
    (picture,) = re.findall(r"!\[What the cell above draws\]\((.+)\)", page)
    assert (folder / picture).read_bytes().startswith(b"\x89PNG")
    assert "<table>" in page and "style" not in page and "\x1b" not in page
    assert json.loads((folder / "made.ipynb").read_text())["cells"][1]["outputs"]


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (("plt.plot([0, 1])", "plt.plotted([0, 1])"), "made.py fails: .*has no attribute 'plotted'"),
        (("organbench --version", "organbench --versoin"), "made.py fails: .*exit status 2"),
        (("plt.show()", "plt.close()"), "made.py shows no picture"),
    ],
)
def test_a_notebook_that_fails_or_shows_nothing_is_refused(gallery, written, change, message):
    with pytest.raises(gallery.BrokenNotebook, match=re.compile(message, re.DOTALL)):
        written(GOOD.replace(*change))


def test_the_four_notebooks_are_there_in_the_order_of_the_menu(gallery):
    assert {path.stem for path in SOURCES} == set(gallery.ORDER) and len(gallery.ORDER) == 4


@pytest.mark.parametrize("path", SOURCES, ids=lambda path: path.stem)
def test_a_notebook_begins_with_its_title_and_has_no_results(path):
    text = path.read_text(encoding="utf-8")
    assert text.startswith("# %% [markdown]\n# # ")
    assert len(text) < 6_000, "sources are text alone"
