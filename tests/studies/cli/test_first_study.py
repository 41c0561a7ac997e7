"""The tutorial docs/first-study.md: its lines are run in their order, and print what the page shows."""

import glob
import re
import shlex
from pathlib import Path

import pytest

PAGE = Path(__file__).parents[3] / "docs" / "first-study.md"
PART = re.compile(
    r"```(?P<kind>python|text)\n(?P<block>.*?)```|^    organbench (?P<command>[^\n]*)$|"
    r"Change `(?P<old>[^`]+)` to `(?P<new>[^`]+)`",
    re.DOTALL | re.MULTILINE,
)


@pytest.mark.campaign
@pytest.mark.slow
@pytest.mark.filterwarnings("ignore::UserWarning")
def test_the_tutorial_is_followed(organbench, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("COLUMNS", "100")
    file, printed, count = tmp_path / "first.py", "", 0
    for part in re.finditer(PART, PAGE.read_text(encoding="utf-8")):
        if part["command"]:
            words = [word for text in shlex.split(part["command"]) for word in glob.glob(text) or [text]]
            code, out, err = organbench(*words)
            assert code == 0, f"organbench {part['command']}: {out}{err}"
            printed += out + err
        elif part["old"]:
            assert file.read_text().count(part["old"]) == 1
            file.write_text(file.read_text().replace(part["old"], part["new"]))
        elif part["kind"] == "text":
            for line in part["block"].splitlines():
                assert line.rstrip() in printed, f"not printed: {line}"
            printed, count = "", count + 1
        elif file.exists():
            first, rest = file.read_text().split("CHARTS", 1)
            file.write_text(f"{first}{part['block']}CHARTS{rest}")
        else:
            file.write_text(part["block"])
    assert count == 5 and (tmp_path / "results" / "first" / "volume.png").is_file()
