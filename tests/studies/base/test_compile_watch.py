"""What is compiled is listed once, with its own time."""

import numba

from massspring.kernels.jit.stage_clock import STAGES
from studies.base.compile_watch import Compiled, summary, watching


def test_compiling_is_logged_with_its_own_time_and_loading_is_not():
    @numba.njit
    def inner(x):
        return x + len(STAGES)

    @numba.njit
    def outer(x):
        return inner(x) * 2

    with watching() as watch:
        outer(1.0), outer(2.0)
    assert [entry.function.rpartition(".")[2] for entry in watch.compiled] == ["inner", "outer"]
    assert all(0 < entry.seconds < 60 and "float64" in entry.arguments for entry in watch.compiled)


def test_the_summary_counts_what_was_compiled_twice():
    seconds = {("a", "(x)"): (1.0, 2.0), ("b", "(x)"): (5.0,), ("a", "(y)"): (0.5,)}
    lines = summary([Compiled(*form, each) for form, times in seconds.items() for each in times], 1)
    assert lines[0] == "4 compiled in 8.5 s of processor time, 1 of them again"
    assert lines[1].split() == ["5.00", "s", "1", "x", "b"] and len(lines) == 2


def test_numba_reports_each_compiled_function_once():
    @numba.njit
    def inner(x):
        return x + 1

    @numba.njit
    def outer(x):
        return inner(x) * 2

    functions = []
    with watching(functions.append) as watch:
        assert outer(1) == 4
        assert outer(2) == 6
    assert functions == ["outer"] and len(watch.compiled) == 2
    assert watch.seconds > 0
    outer(1.0)
    assert functions == ["outer"]
