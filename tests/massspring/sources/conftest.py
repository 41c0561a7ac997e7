"""Copies of small packages, and the state of their code as another process would find it."""

import pytest

from massspring import sources
from massspring.sources import source_fingerprint

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
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))
    return tmp_path


def fresh(*modules: str, **within) -> str:
    """As another process would find it."""
    for function in (source_fingerprint, sources._followed, sources._source, sources._memory):
        function.cache_clear()
    return source_fingerprint(*modules, **within)


@pytest.fixture(autouse=True)
def forget():
    yield
    for function in (source_fingerprint, sources._followed, sources._source, sources._memory):
        function.cache_clear()
