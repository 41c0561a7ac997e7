"""What a file says cannot steer the terminal: not in any command, not as a warning, not as an error."""

import io
from dataclasses import replace

import pytest
from rich.table import Table

from studies.cli.terminal import VisibleConsole, visible
from studies.runs.current import case_path
from studies.store.record import Status, read_record, write_record
from tests.studies.tiny import cube, tiny_case, write_obj

EVIL = "\x1b]0;owned\x07\x1b[2J\x9b31m\u202eend"
"""A title, an empty screen, a colour in one character, and a text that runs to the left."""
SHOWN = r"\x1b]0;owned"


def steers(text):
    return [c for c in text if c in "\x1b\x07\x9b\u202e\r\x08"]


def test_characters_that_steer_are_shown_as_numbers():
    assert visible(EVIL) == r"\x1b]0;owned\x07\x1b[2J\x9b31m\u202eend"
    for plain in ("liver ± 1 %\n", "a\tb", "Leber-größe 肝臓 µm³", ""):
        assert visible(plain) == plain


def test_a_console_keeps_its_own_colours_and_no_others():
    stream = io.StringIO()
    console = VisibleConsole(file=stream, force_terminal=True, color_system="standard", width=200)
    table = Table("name", title=EVIL)
    table.add_row(EVIL)
    console.print(table)
    console.print(EVIL, style="red", markup=False, highlight=False)
    text = stream.getvalue()
    assert "\x1b[31m" in text and "\x1b]0;" not in text and "\x1b[2J" not in text and text.count(SHOWN) == 3


@pytest.fixture
def evil_results(results):
    """One of the records has failed, with a message of a stranger."""
    path = case_path(results, "tiny", tiny_case())
    record = read_record(path)
    evil = replace(record, status=Status.FAILED, message=EVIL, name=EVIL, fields={}, machine=EVIL)
    write_record(path, replace(evil, attributes={"message of another": EVIL}))
    return results, path


@pytest.mark.parametrize("command", ["show", "show --all", "show study", "table", "replay", "archive"])
def test_no_command_passes_on_what_a_record_says(organbench, evil_results, tiny_file, tmp_path, command):
    results, path = evil_results
    words = {
        "show": ("show", path),
        "show --all": ("show", path, "--all"),
        "show study": ("show", tiny_file, "--results", results, "--all"),
        "table": ("table", tiny_file, "--results", results),
        "replay": ("replay", path),
        "archive": ("archive", tiny_file, "--results", results, "-o", tmp_path / "a.zip"),
    }
    _, out, err = organbench(*words[command])
    assert steers(out + err) == []
    assert out + err
    if command in ("show", "show --all"):
        assert SHOWN in out


def test_no_part_of_a_mesh_is_passed_on(organbench, tmp_path):
    points, triangles, _ = cube()
    first = write_obj(tmp_path / "two.obj", points, triangles).read_text().splitlines()
    second = write_obj(tmp_path / "two.obj", points + 1.0, triangles + len(points)).read_text().splitlines()
    path = tmp_path / "two.obj"
    path.write_text("\n".join(["o first", *first, f"o {EVIL}", *second]) + "\n", encoding="utf-8")
    _, out, err = organbench("mesh", "--check", path, "--unit", "m")
    assert steers(out + err) == [] and "owned" in out + err
    _, out, err = organbench("mesh", "--from", path, "--unit", "m", "--part", "none", "-o", tmp_path / "a.vtu")
    assert steers(out + err) == [] and "owned" in out + err


def test_no_error_passes_on_a_name(organbench, tmp_path):
    evil = tmp_path / f"a{EVIL}.h5"
    code, out, err = organbench("show", evil)
    assert code == 2 and steers(out + err) == [] and SHOWN in err
