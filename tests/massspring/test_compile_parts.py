"""Functions that compiled code calls: compiled once for all callers and constants, and kept without machine code."""

import subprocess
import sys

import numpy as np
import pytest

from massspring.kernels.jit.decorators import compiled, njit_inlined, njit_lean
from massspring.sources import ROOT


@njit_inlined
def share(row, place, included):
    """Compiled as a part of its callers only."""
    return row[place] if included else 0.0


@njit_lean
def added(row, place):
    """For Python and for compiled callers."""
    return share(row, place, True) + share(row, place + 1, False)


@compiled
def both(row):
    """A caller of it with two constants."""
    return added(row, 0) + added(row, 2) / row[0]


def part_of(function):
    """The dispatcher of what callers take in."""
    return function.get_overload.__self__


def test_constants_compile_nothing_again_and_python_gets_machine_code_of_its_own():
    row = np.array([2.0, 3.0, 5.0, 7.0])
    assert both(row) == 2.0 + 5.0 / 2.0
    # Once for both constants; where this file ran before, the caller is kept and nothing is compiled.
    assert len(part_of(added).signatures) <= 1 and len(part_of(share).signatures) <= 1
    assert not added.signatures
    assert added(row, 2) == 5.0
    assert len(added.signatures) == 1


def test_an_error_of_a_part_reaches_python():
    @compiled
    def refused(x):
        if x < 0:
            raise ValueError("negative")
        return x

    @compiled
    def caller(x):
        return 2 * refused(x)

    assert caller(3) == 6
    for function in (caller, refused):
        with pytest.raises(ValueError, match="negative"):
            function(-1)


KEPT = """
import sys
from massspring.kernels.jit.decorators import compiled

@compiled
def part(x):
    return x + 1

@compiled
def first(x):
    return 2 * part(x)

@compiled
def second(x):
    return 3 * part(x)

print(globals()[sys.argv[1]](len(sys.argv)), sum(part.get_overload.__self__.stats.cache_hits.values()))
"""


def test_a_new_caller_takes_in_a_part_that_was_kept(tmp_path):
    file = tmp_path / "kept.py"
    file.write_text(KEPT)
    environment = {"NUMBA_CACHE_DIR": str(tmp_path / "kept"), "PYTHONPATH": str(ROOT), "HOME": str(tmp_path)}

    def run(caller):
        command = [sys.executable, str(file), caller]
        return subprocess.run(command, env=environment, capture_output=True, text=True, check=True).stdout.split()

    assert [run(caller) for caller in ("first", "second", "second")] == [["6", "0"], ["9", "1"], ["9", "0"]]
