import errno
import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

import studies.base.atomic
from studies.base.atomic import part_path, sweep_parts, write_whole
from studies.base.errors import StudyError

ROOT = Path(__file__).parents[3]


def test_written_whole_and_nothing_left(tmp_path):
    write_whole(tmp_path / "deep" / "a.h5", b"one")
    write_whole(tmp_path / "deep" / "a.h5", b"two")
    assert [(p.name, p.read_bytes()) for p in (tmp_path / "deep").iterdir()] == [("a.h5", b"two")]


@pytest.mark.parametrize("call", ["fsync", "replace"])
def test_a_full_disk_keeps_what_was_stored(tmp_path, monkeypatch, call):
    path = tmp_path / "a.h5"
    write_whole(path, b"old")

    def full(*args):
        raise OSError(errno.ENOSPC, "No space left on device")

    monkeypatch.setattr(studies.base.atomic.os, call, full)
    with pytest.raises(StudyError, match=r"a\.h5 \(0\.0 MB\) was not written, the disk is full: free some space"):
        write_whole(path, b"new")
    assert [(p.name, p.read_bytes()) for p in tmp_path.iterdir()] == [("a.h5", b"old")]


@pytest.mark.skipif(not os.path.exists("/dev/full"), reason="needs a device that is always full")
def test_a_truly_full_device(tmp_path, monkeypatch):
    part = tmp_path / "a.h5.part"
    part.symlink_to("/dev/full")
    monkeypatch.setattr(studies.base.atomic, "part_path", lambda path: part)
    with pytest.raises(StudyError, match="the disk is full"):
        write_whole(tmp_path / "a.h5", b"new")
    assert list(tmp_path.iterdir()) == []


def test_a_folder_that_cannot_be_written(tmp_path):
    (tmp_path / "results").write_text("a file where the folder should be")
    with pytest.raises(StudyError, match="choose a folder that can be written to"):
        write_whole(tmp_path / "results" / "study" / "a.h5", b"new")


WRITER = """
import sys
from pathlib import Path
from studies.base.atomic import write_whole
path, n = Path(sys.argv[1]), 0
while True:
    n += 1
    write_whole(path, bytes([n % 256]) * 3_000_000)
    if n == 1:
        print("going", flush=True)
"""


def test_kill_9_leaves_a_whole_file(tmp_path):
    path = tmp_path / "a.h5"
    for wait in (0.0, 0.013, 0.029):
        command = [sys.executable, "-c", WRITER, str(path)]
        with subprocess.Popen(command, cwd=ROOT, stdout=subprocess.PIPE) as writer:
            assert writer.stdout is not None
            assert writer.stdout.readline() == b"going\n"
            time.sleep(wait)
            writer.send_signal(signal.SIGKILL)
        content = path.read_bytes()
        assert len(content) == 3_000_000
        assert len(set(content)) == 1
    write_whole(path, b"next")  # a leftover .part does not disturb
    assert path.read_bytes() == b"next"


def test_old_leftovers_are_swept_and_those_of_living_writers_kept(tmp_path):
    hours = {"a.h5.1.part": 2.0, "b.h5.2.part": 0.5, "c.h5.3.part": 0.0, "d.h5": 2.0}
    for name, age in hours.items():
        (tmp_path / name).write_bytes(b"x")
        os.utime(tmp_path / name, (time.time() - 3600 * age,) * 2)
    assert sweep_parts(tmp_path) == 1
    assert sorted(p.name for p in tmp_path.iterdir()) == ["b.h5.2.part", "c.h5.3.part", "d.h5"]


def test_no_two_writers_have_one_part_and_all_may_read_the_file(tmp_path):
    path = tmp_path / "a.h5"
    assert len({part_path(path) for _ in range(100)}) == 100
    write_whole(path, b"one")
    (tmp_path / "plain").write_bytes(b"one")
    assert path.stat().st_mode == (tmp_path / "plain").stat().st_mode
