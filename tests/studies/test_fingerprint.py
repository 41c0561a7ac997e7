from pathlib import Path

import pytest

from studies.errors import StudyError
from studies.fingerprint import source_fingerprint


def package(root: Path, text: str = "x = 1\n", name: str = "a.py") -> Path:
    folder = root / "pack"
    (folder / "sub").mkdir(parents=True)
    (folder / "__init__.py").write_bytes(b"")
    (folder / "sub" / name).write_bytes(text.encode())
    return folder


def test_it_depends_on_content_and_names_only(tmp_path):
    same = [source_fingerprint(package(tmp_path / str(i), text)) for i, text in enumerate(["x = 1\n", "x = 1\r\n"])]
    assert same[0] == same[1]
    assert source_fingerprint(package(tmp_path / "edited", "x = 2\n")) != same[0]
    assert source_fingerprint(package(tmp_path / "renamed", name="b.py")) != same[0]


def test_files_that_are_not_python_do_not_count(tmp_path):
    plain, noted = package(tmp_path / "1"), package(tmp_path / "2")
    (noted / "sub" / "notes.txt").write_text("hello")
    (noted / "__pycache__").mkdir()
    (noted / "__pycache__" / "a.cpython-311.pyc").write_bytes(b"x")
    assert source_fingerprint(plain) == source_fingerprint(noted)


def test_content_cannot_move_between_files_unseen(tmp_path):
    one, two = package(tmp_path / "1", "ab"), package(tmp_path / "2", "a")
    (one / "sub" / "b.py").write_text("c")
    (two / "sub" / "b.py").write_text("bc")
    assert source_fingerprint(one) != source_fingerprint(two)


def test_packages_and_modules_are_found_by_name():
    import studies.errors
    import studies.suggest

    assert source_fingerprint("studies.errors") == source_fingerprint(Path(studies.errors.__file__))
    assert source_fingerprint("studies") == source_fingerprint(Path(studies.errors.__file__).parent)
    assert source_fingerprint("studies.errors") != source_fingerprint("studies.errors", "studies.suggest")


@pytest.mark.parametrize("name", ["studies.nowhere", "no_such_package.inside", "sys"])
def test_a_source_that_does_not_exist_is_refused(name):
    with pytest.raises(StudyError, match=f"no Python source for '{name}'"):
        source_fingerprint(name)


def test_an_empty_folder_is_refused(tmp_path):
    with pytest.raises(StudyError, match="fingerprint of nothing"):
        source_fingerprint(tmp_path)
