"""The scheduler of a job array talks to holders of its key alone: on the network it would run anybody's code."""

import subprocess
import sys
import urllib.error
import urllib.request
from pathlib import Path

import pytest
from distributed import Client
from distributed.security import Security

from studies.base.errors import StudyError
from studies.sweep.engines import tls
from studies.sweep.engines.queue import Settings, scheduler_with_workers

ROOT = Path(__file__).parents[3]
TRY = """
from distributed import Client
client = Client({address!r}, timeout=5)
client.run_on_scheduler(lambda: open({marker!r}, "w").close())
"""
"""What an attacker on the network does: code of his in the process of the user."""


@pytest.fixture
def scheduler(tmp_path):
    """Address and folder of a scheduler without workers."""
    settings = Settings("command", workers=1, command="sleep 60 & wait", host="127.0.0.1")
    with scheduler_with_workers(settings, tmp_path, lambda text: None) as address:
        (folder,) = (tmp_path / "cache").iterdir()
        yield address, folder


def attack(address, marker):
    """From a process that knows no key; what came of it."""
    program = TRY.format(address=address, marker=str(marker))
    return subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=False)


def test_the_key_is_for_its_owner_alone_and_goes_with_the_command(tmp_path):
    settings = Settings("command", workers=1, command="sleep 60 & wait", host="127.0.0.1")
    with scheduler_with_workers(settings, tmp_path, lambda text: None):
        (folder,) = (tmp_path / "cache").iterdir()
        modes = {path.name: path.stat().st_mode & 0o777 for path in (folder, folder / tls.KEY)}
        assert modes == {folder.name: 0o700, tls.KEY: 0o600}
    assert not (folder / tls.KEY).exists()


@pytest.mark.parametrize("protocol", ["tls", "tcp"])
def test_who_has_no_key_runs_nothing(scheduler, tmp_path, protocol):
    address, _ = scheduler
    assert address.startswith("tls://")
    marker = tmp_path / "marker"
    done = attack(address.replace("tls", protocol), marker)
    assert done.returncode == 1 and not marker.exists(), done.stderr


def test_another_key_is_of_no_use(scheduler, tmp_path):
    tls.make_key(tmp_path / "other")
    key, certificate = str(tmp_path / "other" / tls.KEY), str(tmp_path / "other" / tls.CERTIFICATE)
    security = Security(tls_ca_file=certificate, tls_client_key=key, tls_client_cert=certificate)
    with pytest.raises(OSError, match=r"Timed out|CERTIFICATE|certificate"):
        Client(scheduler[0], security=security, timeout=3, set_as_default=False)


def test_the_holder_of_the_key_is_served_and_no_page_is(scheduler, tmp_path):
    address, _ = scheduler
    with Client(address, timeout=10, set_as_default=False) as client:
        marker = tmp_path / "marker"
        client.run_on_scheduler(lambda: marker.touch())
        assert marker.exists(), "the attack works with the key"
        place = client.run_on_scheduler(lambda dask_scheduler: dask_scheduler.http_server.address)
        port = client.run_on_scheduler(lambda dask_scheduler: dask_scheduler.http_server.port)
    assert place == "127.0.0.1"
    for page in ("status", "json/identity.json", "info/main/workers.html", "health", "proxy/80/127.0.0.1/"):
        with pytest.raises(urllib.error.HTTPError, match="404"):
            urllib.request.urlopen(f"http://127.0.0.1:{port}/{page}", timeout=10)


@pytest.mark.slow
def test_a_worker_holds_the_key_that_lies_beside_its_file(scheduler, monkeypatch):
    address, folder = scheduler
    monkeypatch.setenv("PYTHONPATH", str(ROOT))
    command = [sys.executable, "-m", "studies", "worker", "--scheduler-file", str(folder / "scheduler.json")]
    worker = subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    try:
        with Client(address, timeout=10, set_as_default=False) as client:
            client.wait_for_workers(1, timeout=60)
            (place,) = client.scheduler_info()["workers"]
            assert place.startswith("tls://")
    finally:
        worker.terminate()
        worker.wait(30)


def test_without_openssl_there_is_one_sentence_and_no_scheduler(tmp_path, monkeypatch):
    monkeypatch.setenv("PATH", str(tmp_path))
    with pytest.raises(StudyError, match=r"openssl failed: .*\), .*; install openssl"):
        tls.make_key(tmp_path / "folder")
