"""References are solved, written as a set, and solved again within the bars of both."""

import pytest

from studies.lab import references
from studies.reference.published import index, published
from tests.studies.octant import SCENE


@pytest.mark.lab
def test_a_set_is_published_and_checked(monkeypatch, tmp_path, reference, capsys):
    monkeypatch.setattr(references, "judged_scenes", lambda: {"one": SCENE})
    monkeypatch.setattr(references, "solve_reference", lambda root, scene: reference)
    monkeypatch.setattr(references, "reference_for", lambda root, scene: reference)
    monkeypatch.setattr(references, "ProcessPoolExecutor", Here)
    path = references.publish("2027.9", ["one"], tmp_path, folder=tmp_path / "set")
    assert published(SCENE, path.parent).name == "2027.9"
    assert references.main(["check"]) == 0 and "one: within its bars (" in capsys.readouterr().out
    index.cache_clear()


class Here:
    """In place of processes."""

    def __init__(self, *_):
        pass

    def __enter__(self):
        return self

    def __exit__(self, *_):
        pass

    map = staticmethod(map)
