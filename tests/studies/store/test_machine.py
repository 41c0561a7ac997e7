import getpass
import json
import platform
import re
import socket

import pytest

import studies.store.machine
from studies.base.errors import StudyError
from studies.store.machine import machine_id, this_machine, write_machine


@pytest.fixture(autouse=True)
def fresh():
    this_machine.cache_clear()
    yield
    this_machine.cache_clear()


def test_the_id_is_short_and_stays():
    first = machine_id()
    this_machine.cache_clear()
    assert re.fullmatch("[0-9a-f]{8}", first)
    assert machine_id() == first


def test_other_hardware_has_another_id_and_other_packages_have_not(monkeypatch):
    first = machine_id()
    monkeypatch.setattr(studies.store.machine, "_version", lambda name: "0.0.0")
    this_machine.cache_clear()
    assert machine_id() == first
    monkeypatch.setattr(studies.store.machine, "_cpu", lambda: ("Abacus", None))
    this_machine.cache_clear()
    assert machine_id() != first


def test_no_name_of_host_or_user_is_written(tmp_path, monkeypatch):
    for place, name in ((socket, "gethostname"), (platform, "node"), (getpass, "getuser")):
        monkeypatch.setattr(place, name, lambda: "secret-name")
    for variable in ("USER", "LOGNAME", "HOSTNAME", "HOME"):
        monkeypatch.setenv(variable, "secret-name")
    uname = platform.uname()
    monkeypatch.setattr(platform, "uname", lambda: uname._replace(node="secret-name"))
    write_machine(tmp_path / "machine.json")
    text = (tmp_path / "machine.json").read_text()
    assert "secret-name" not in text
    assert set(json.loads(text)) == {
        "id", "cpu", "architecture", "cores", "virtual", "clock", "memory_gb", "system", "python", "packages",
    }  # fmt: skip


def test_what_is_written_does_not_change_between_runs(tmp_path):
    path = tmp_path / "results" / "machine.json"
    write_machine(path)
    before = path.stat()
    this_machine.cache_clear()
    write_machine(path)
    assert (path.stat().st_mtime_ns, path.stat().st_ino) == (before.st_mtime_ns, before.st_ino)
    facts = json.loads(path.read_text())
    assert facts["packages"]["numpy"].count(".") >= 1
    assert facts["clock"]["timer_resolution_ns"] >= 1


def test_a_system_that_tells_nothing(monkeypatch, tmp_path):
    for name in ("CPUINFO", "CPUFREQ"):
        monkeypatch.setattr(studies.store.machine, name, tmp_path / "absent")
    machine = this_machine()
    assert machine.virtual is None
    assert machine.clock["max_mhz"] is None


def test_the_facts_of_the_first_processor(monkeypatch, tmp_path):
    info, frequency = tmp_path / "cpuinfo", tmp_path / "cpufreq"
    one = "model name\t: Fast CPU @ 3 GHz\ncpu family\t: 26\nmodel\t\t: 2\nflags\t\t: fpu hypervisor sse\n"
    info.write_text(one + "\n" + one.replace("Fast", "Slow"))
    frequency.mkdir()
    (frequency / "cpuinfo_max_freq").write_text("3700000\n")
    (frequency / "scaling_governor").write_text("performance\n")
    monkeypatch.setattr(studies.store.machine, "CPUINFO", info)
    monkeypatch.setattr(studies.store.machine, "CPUFREQ", frequency)
    machine = this_machine()
    assert machine.cpu == "Fast CPU @ 3 GHz (family 26, model 2)"
    assert machine.virtual is True
    assert (machine.clock["max_mhz"], machine.clock["governor"]) == (3700, "performance")


def test_a_folder_that_cannot_be_written_is_one_sentence(tmp_path):
    (tmp_path / "results").write_text("")
    with pytest.raises(StudyError, match="was not written"):
        write_machine(tmp_path / "results" / "machine.json")
