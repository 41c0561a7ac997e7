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
    with pytest.raises(StudyError, match="choose a results folder that can be written to"):
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


def test_old_leftovers_are_swept_and_fresh_ones_kept(tmp_path):
    for name in ("a.h5.1.part", "b.h5.2.part", "c.h5"):
        (tmp_path / name).write_bytes(b"x")
    for name in ("a.h5.1.part", "c.h5"):
        os.utime(tmp_path / name, (time.time() - 7200,) * 2)
    assert sweep_parts(tmp_path) == 1
    assert sorted(p.name for p in tmp_path.iterdir()) == ["b.h5.2.part", "c.h5"]


@pytest.mark.skipif(os.name != "posix", reason="processes by number")
def test_parts_of_the_dead_go_after_a_minute_and_of_the_living_after_an_hour(tmp_path):
    gone = subprocess.run([sys.executable, "-c", "import os; print(os.getpid())"], capture_output=True, check=True)
    host = part_path(tmp_path / "a.h5").name.split(".")[2].split("-")[0]
    names = [f"{host}-{int(gone.stdout)}-1", f"{host}-{os.getpid()}-1", f"0badcafe-{int(gone.stdout)}-1"]
    dead, living, elsewhere = parts = [tmp_path / f"a.h5.{name}.part" for name in names]
    for part in parts:
        part.write_bytes(b"")
    assert sweep_parts(tmp_path) == 0, "it may be renamed in this moment"
    for part in parts:
        os.utime(part, (time.time() - 120,) * 2)
    assert sweep_parts(tmp_path) == 1 and living.exists() and elsewhere.exists() and not dead.exists()
    for part in (living, elsewhere):
        os.utime(part, (time.time() - 7200,) * 2)
    assert sweep_parts(tmp_path) == 2


def test_no_two_writers_have_one_part(tmp_path, monkeypatch):
    """Neither two threads, nor two processes of one number on hosts that share the folder."""
    here = {part_path(tmp_path / "a.h5") for _ in range(2)}
    monkeypatch.setattr(studies.base.atomic.platform, "node", lambda: "another")
    studies.base.atomic._host.cache_clear()
    monkeypatch.setattr(studies.base.atomic, "_NUMBERS", iter((1, 2)))
    try:
        there = {part_path(tmp_path / "a.h5") for _ in range(2)}
    finally:
        studies.base.atomic._host.cache_clear()
    assert len(here | there) == 4 and not any("another" in part.name for part in there)
