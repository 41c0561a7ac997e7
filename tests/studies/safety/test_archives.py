"""An archive of a stranger: only its own files are opened, and every check ends."""

import hashlib
import os
import subprocess
import zipfile

import pytest

from studies.report.archive import checking
from studies.store.archived import MANIFEST

EMPTY = hashlib.sha256(b"").hexdigest()


def manifest(folder, *names):
    folder.mkdir(exist_ok=True)
    (folder / MANIFEST).write_text("".join(f"{EMPTY}  {name}\n" for name in names))
    return folder


@pytest.mark.parametrize(
    "name", ["/dev/zero", "/etc/passwd", "../secret", "a/../../secret", "./a", "a//b", ".", "..", ""]
)
@pytest.mark.parametrize("kind", ["folder", "zip"])
def test_a_name_that_leaves_the_archive_is_refused(refused, tmp_path, name, kind):
    (tmp_path / "secret").write_bytes(b"")  # its checksum would fit
    path = manifest(tmp_path / "evil", name)
    (path / "a").mkdir()
    if kind == "zip":
        with zipfile.ZipFile(tmp_path / "evil.zip", "w") as archive:
            archive.write(path / MANIFEST, MANIFEST)
            archive.writestr(name or "b", b"")
        path = tmp_path / "evil.zip"
    assert "which lies outside: it is not an archive of organbench" in refused("archive", "--check", path)


@pytest.mark.parametrize("kind", ["device", "pipe", "folder", "link", "link above"])
@pytest.mark.parametrize("named", ["a", MANIFEST])
def test_nothing_but_regular_files_of_the_folder_is_opened(refused, tmp_path, kind, named):
    path = manifest(tmp_path / "evil", "a")
    file = path / named
    file.unlink(missing_ok=True)
    (tmp_path / "secret").write_bytes(b"")
    if kind == "pipe":
        os.mkfifo(file)
    elif kind == "folder":
        file.mkdir()
    else:
        file.symlink_to({"device": "/dev/zero", "link": "/proc/self/status", "link above": "../secret"}[kind])
    reason = "leads outside" if kind.startswith("link") else "is not a regular file"
    assert f"{named} is" in (sentence := refused("archive", "--check", path)) and reason in sentence


def test_a_large_manifest_is_not_read_to_its_end(refused, tmp_path):
    """A zip of 50 MB of line ends is 50 kB."""
    with zipfile.ZipFile(tmp_path / "evil.zip", "w", zipfile.ZIP_DEFLATED) as archive:
        archive.writestr(MANIFEST, b"\n" * (checking.LARGEST + 1))
    assert (tmp_path / "evil.zip").stat().st_size < 1e5
    assert "manifest-sha256.txt has more than 50 MB" in refused("archive", "--check", tmp_path / "evil.zip")


def test_a_file_that_is_named_twice_is_not_read_twice(refused, tmp_path):
    path = manifest(tmp_path / "evil", "a", "a")
    (path / "a").write_bytes(b"")
    assert "manifest-sha256.txt has changed since it was packed" in refused("archive", "--check", path)


def test_an_encrypted_archive_is_one_sentence(refused, tmp_path):
    """Without a program that encrypts: the flag alone is what a reader sees."""
    file = tmp_path / "locked.zip"
    with zipfile.ZipFile(file, "w") as archive:
        archive.writestr(MANIFEST, "")
    content = bytearray(file.read_bytes())
    content[6] |= 1  # of the file itself
    content[content.index(b"PK\x01\x02") + 8] |= 1  # of the directory at the end
    file.write_bytes(content)
    with zipfile.ZipFile(file) as archive, pytest.raises(RuntimeError, match="is encrypted, password required"):
        archive.open(MANIFEST)
    assert "locked.zip is encrypted: unpack it with its password" in refused("archive", "--check", file)


def test_a_true_archive_still_passes(organbench, tmp_path):
    path = manifest(tmp_path / "good", "a", "b/c")
    (path / "b").mkdir()
    for name in ("a", "b/c"):
        (path / name).write_bytes(b"")
    assert organbench("archive", "--check", path)[:2] == (0, f"{path}: 2 files, each as it was packed\n")
    moved = tmp_path / "elsewhere"
    moved.symlink_to(path)
    assert organbench("archive", "--check", moved)[0] == 0
    assert subprocess.run(["sha256sum", "-c", "--quiet", MANIFEST], cwd=path, check=False).returncode == 0
