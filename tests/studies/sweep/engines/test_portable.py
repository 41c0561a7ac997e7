"""Results that are equal on every x86-64 machine: the variables of processes, and the attribute of records."""

import os
import platform
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import pytest

from studies.base.portable import SETTINGS, environment
from studies.runs.current import case_path
from studies.store.record import read_record
from studies.sweep.local import Local
from studies.sweep.run_studies import run_studies
from tests.studies.tiny import Silent, tiny_case, tiny_study

ROOT = Path(__file__).parents[4]
ASKED = """
import numba, numpy
from numpy._core._multiarray_umath import __cpu_features__ as has, __cpu_dispatch__ as dispatched
from numba.core.registry import cpu_target

@numba.njit
def fused(a, b, c):
    return a * b + c

fused(0.1, 0.1, 0.1)
assembly = "".join(fused.inspect_asm().values())
magic = cpu_target.target_context.codegen().magic_tuple()
print(magic[1], repr(magic[2]), any(has[name] for name in dispatched), "ymm" in assembly or "vmul" in assembly)
"""


@pytest.mark.skipif(platform.machine() != "x86_64", reason="the settings are those of x86-64 processors")
def test_what_libraries_do_with_the_settings():
    done = subprocess.run(
        [sys.executable, "-W", "error", "-c", ASKED],
        env={**os.environ, **environment()},
        capture_output=True,
        text=True,
        check=True,
    )
    assert (done.stdout, done.stderr) == ("generic '' False False\n", "")


def test_records_say_so_and_others_run_again(tmp_path):
    refused = tiny_case(body=replace(tiny_case().body, stiffness=-1.0))  # stored before anything is compiled
    study, native, portable = tiny_study(cases=(refused,)), Local(1), Local(1, portable=True)
    assert run_studies(tmp_path, [study], native, Silent()) == 1
    path = case_path(tmp_path, study.name, refused)
    assert "portable" not in read_record(path).attributes
    assert run_studies(tmp_path, [study], portable, Silent()) == 1, "it was not computed portably"
    settings = read_record(path).attributes["portable"]
    assert all(f"{name}={value}" in settings for name, value in SETTINGS.items() if value)
    assert [run_studies(tmp_path, [study], engine, Silent()) for engine in (portable, native)] == [0, 0]
    assert "NUMBA_CPU_NAME" not in os.environ and "ORGANBENCH_PORTABLE" not in os.environ
