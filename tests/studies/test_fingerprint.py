from pathlib import Path

import pytest

from studies.base.errors import StudyError
from studies.store.fingerprint import source_fingerprint


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


CODE = """'''What the module is for.'''
LIMIT = 3  # of pieces
'''What the limit is.'''


def double(x):
    '''Twice x.'''
    return 2 * x
"""


@pytest.mark.parametrize(
    ("before", "after"),
    [("What the module is for", "Another purpose"), ("# of pieces", "# [1]"), ("Twice x", "2 x"), ("\n\n\n", "\n")],
)
def test_words_about_the_code_do_not_count(tmp_path, before, after):
    assert before in CODE
    one, two = package(tmp_path / "1", CODE), package(tmp_path / "2", CODE.replace(before, after))
    assert source_fingerprint(one) == source_fingerprint(two)


@pytest.mark.parametrize(
    ("before", "after"), [("= 3", "= 4"), ("2 * x", "x * 2"), ("double", "twice"), ("(x)", "(x=1)"), ("return ", "")]
)
def test_every_word_of_the_code_counts(tmp_path, before, after):
    one, two = package(tmp_path / "1", CODE), package(tmp_path / "2", CODE.replace(before, after))
    assert source_fingerprint(one) != source_fingerprint(two)


def test_a_string_that_is_used_is_no_remark(tmp_path):
    one, two = (package(tmp_path / word, f"def f():\n    return {word!r}\n") for word in ("a", "b"))
    assert source_fingerprint(one) != source_fingerprint(two)


def test_files_left_out_do_not_count(tmp_path):
    one, two, three = (package(tmp_path / name, f"x = {name}\n") for name in ("1", "2", "3"))
    for folder, text in ((one, "y = 1\n"), (two, "y = 1\n"), (three, "y = 2\n")):
        (folder / "b.py").write_text(text)
    for without in ("sub/a.py", "sub/"):
        left = [source_fingerprint(folder, without=(without,)) for folder in (one, two, three)]
        assert left[0] == left[1] != left[2]


def test_a_file_that_is_no_python_is_refused(tmp_path):
    with pytest.raises(StudyError, match=r"a\.py is no Python \(.*, line 1\)"):
        source_fingerprint(package(tmp_path, "x = = 1\n"))


def test_files_that_are_not_python_do_not_count(tmp_path):
    plain, noted = package(tmp_path / "1"), package(tmp_path / "2")
    (noted / "sub" / "notes.txt").write_text("hello")
    (noted / "__pycache__").mkdir()
    (noted / "__pycache__" / "a.cpython-311.pyc").write_bytes(b"x")
    assert source_fingerprint(plain) == source_fingerprint(noted)


def test_content_cannot_move_between_files_unseen(tmp_path):
    one, two = package(tmp_path / "1", "a\nb\n"), package(tmp_path / "2", "a\n")
    (one / "sub" / "b.py").write_text("c\n")
    (two / "sub" / "b.py").write_text("b\nc\n")
    assert source_fingerprint(one) != source_fingerprint(two)


def test_packages_and_modules_are_found_by_name():
    import studies.base.errors
    import studies.base.lookup

    assert source_fingerprint("studies.base.errors") == source_fingerprint(Path(studies.base.errors.__file__))
    assert source_fingerprint("studies.base") == source_fingerprint(Path(studies.base.errors.__file__).parent)
    assert source_fingerprint("studies.base.errors") != source_fingerprint("studies.base.errors", "studies.base.lookup")


@pytest.mark.parametrize("name", ["studies.nowhere", "no_such_package.inside", "sys"])
def test_a_source_that_does_not_exist_is_refused(name):
    with pytest.raises(StudyError, match=f"no Python source for '{name}'"):
        source_fingerprint(name)


def test_an_empty_folder_is_refused(tmp_path):
    with pytest.raises(StudyError, match="fingerprint of nothing"):
        source_fingerprint(tmp_path)
