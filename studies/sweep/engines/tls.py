"""A key of one command: who has it reaches the scheduler, and nobody else on the network; how workers are called."""

import subprocess
from pathlib import Path

from studies.base.errors import StudyError

CERTIFICATE, KEY = "certificate.pem", "key.pem"
"""Next to scheduler.json, in a folder that its owner alone may enter."""
DAYS = 365
"""Lifetime of a key; the command that owns its folder ends earlier."""
OPENSSL_SECONDS = 60.0
LONELY_SECONDS = 120
"""Without a scheduler, after which a worker ends."""
NO_PAGES = ("--no-dashboard", "--dashboard-address", "127.0.0.1:0")
"""Dask opens the port of its web pages in any case: here, and for this machine alone."""


def make_key(folder: Path) -> None:
    """Makes `folder`, and in there a key with a certificate signed by itself, all for this user alone.

    Raises StudyError where they cannot be made."""
    try:
        folder.mkdir(parents=True, mode=0o700)
    except OSError as error:
        raise StudyError(f"{folder} cannot be created ({error.strerror}): choose a writable results folder") from error
    command = ["openssl", "req", "-x509", "-nodes", "-newkey", "ec", "-pkeyopt", "ec_paramgen_curve:prime256v1"]
    command += ["-days", str(DAYS), "-subj", "/CN=organbench"]
    command += ["-keyout", str(folder / KEY), "-out", str(folder / CERTIFICATE)]
    try:
        subprocess.run(command, check=True, capture_output=True, timeout=OPENSSL_SECONDS, umask=0o077)
    except (OSError, subprocess.SubprocessError) as error:
        detail = getattr(error, "stderr", b"") or str(error).encode()
        last = (detail.decode(errors="replace").strip().splitlines() or [""])[-1]
        raise StudyError(
            f"no key could be created (openssl failed: {last}), and the scheduler listens on the network, so it "
            "needs one; install openssl"
        ) from error


def settings_of(folder: Path) -> dict[str, object]:
    """Dask's settings for a scheduler and a client that talk to holders of the key alone, and serve no web pages."""
    files = {"key": str(folder / KEY), "cert": str(folder / CERTIFICATE)}
    return {
        "distributed.scheduler.http.routes": [],
        "distributed.comm.require-encryption": True,
        "distributed.comm.tls.ca-file": files["cert"],
        "distributed.comm.tls.scheduler": files,
        "distributed.comm.tls.client": files,
    }


def words_of(folder: Path) -> list[str]:
    """What a worker is called with to hold the key in a folder; nothing where there is none."""
    certificate, key = folder / CERTIFICATE, folder / KEY
    if not key.is_file():
        return []
    return ["--tls-ca-file", str(certificate), "--tls-cert", str(certificate), "--tls-key", str(key)]
