"""Code that is compiled beforehand: which forms there are, that they run, that it happens once, and what is printed."""

import sys

import numba
import numpy as np
import pytest

from massspring import LITERATURE, METHODS, Free, ImplicitVolume
from massspring.kernels.jit.stage_clock import STAGES
from massspring.methods import VARIANTS
from studies.base.compile_watch import Compiled, watching
from studies.base.errors import StudyError
from studies.catalog import STUDIES
from studies.sweep.compiling import main, tasks
from studies.sweep.compiling.bodies import EDGE, KINDS, tiny_block, tiny_body
from studies.sweep.compiling.frames import OWN_TYPES, PLAIN, PROBE, Variant, advance, setup_of, variants
from studies.sweep.compiling.log import listing, summary


@pytest.fixture
def own_folder(tmp_path, monkeypatch):
    """A folder of compiled code in which nothing is."""
    monkeypatch.setenv("NUMBA_CACHE_DIR", str(tmp_path / "compiled"))
    return tmp_path / "compiled"


def test_every_method_is_there_in_each_form_that_it_supports():
    forms = variants()
    assert {variant.method for variant in forms} == {*(method() for method in (*METHODS, *LITERATURE)), *VARIANTS}
    assert len({variant.name for variant in forms}) == len(forms)
    for method in (*METHODS, *LITERATURE):
        own = [variant for variant in forms if variant.method == method()]
        table = method.capabilities
        assert {variant.option for variant in own} == {
            option for option, yes in ((PLAIN, True), (PROBE, table.thin_probes)) if yes
        }
        assert {variant.precision for variant in own} == {"float64", "float32"} if table.float32 else {"float64"}
        kinds = {variant.kind for variant in own}
        assert kinds == {kind for kind in KINDS if method().why_not(tiny_body(kind)) is None} and kinds


def test_options_are_compiled_for_every_method_that_has_them_and_not_for_all_that_they_go_with():
    """What no test and no main study asks for is compiled when a user does."""
    forms = {(one.method.name, one.kind) for one in variants() if one.option != PLAIN}
    assert {kind for name, kind in forms if name == "free"} == {"whole"}
    assert {kind for name, kind in forms if name == "implicit_volume"} == set(OWN_TYPES) - {"quadratic"}


def test_the_shared_kernels_and_the_reference_come_first():
    names = list(tasks.tasks())
    kinds = [variant.kind for variant in variants()]
    assert kinds.index("nodal") > max(k for k, kind in enumerate(kinds) if kind in OWN_TYPES)
    assert names[0].startswith("implicit_volume, whole") and names[1].startswith("reference")
    assert len(set(names)) == len(names) == len(variants()) + sum(name.startswith("reference") for name in names)


def test_a_loop_is_compiled_before_another_method_asks_for_it():
    """Next to each other, two processes would both compile the loop of a family."""
    names = [variant.name for variant in variants()]
    for option in ("", ", thin probe"):
        for one, other in (("shake", "projection"), ("penalty", "pressure")):
            first, second = (names.index(f"{name}, whole, float64{option}") for name in (one, other))
            assert second - first > 2


def test_what_is_essential_is_what_the_main_studies_need():
    assert set(tasks.ESSENTIAL) <= set(tasks.tasks())
    needed = {(case.method.name, case.precision) for study in STUDIES if study.main for case in study.cases}
    assert needed == {("implicit_volume", "float64"), ("free", "float64")}
    assert all(f"{name}, whole, {precision}" in tasks.ESSENTIAL for name, precision in needed)


def test_the_tiny_block_is_upright_and_closed():
    points, triangles, tetrahedra = tiny_block()
    a, b, c, d = points[tetrahedra].transpose(1, 0, 2)
    volumes = np.einsum("ij,ij->i", np.cross(b - a, c - a), d - a) / 6
    assert (volumes > 0).all() and volumes.sum() == pytest.approx(EDGE**3, rel=1e-12)
    p, q, r = points[triangles].transpose(1, 0, 2)
    assert np.einsum("ij,ij->i", np.cross(p, q), r).sum() / 6 == pytest.approx(EDGE**3, rel=1e-12)


@pytest.mark.parametrize("option", [PLAIN, PROBE])
def test_a_variant_advances_a_body_that_is_pressed(option):
    variant = Variant(ImplicitVolume(), "whole", option=option)
    setup = setup_of(variant)
    assert len(setup.probes) == (option == PROBE)
    after = setup.method.advance(setup.start(), setup.boundary(0))
    assert np.abs(after.diagnostics.contact_impulse[0]).max() > 0
    with watching() as first:
        advance(variant)
    assert all(entry.seconds > 0 for entry in first.compiled)
    with watching() as again:
        advance(variant)
    assert again.compiled == []


@pytest.mark.parametrize("method", LITERATURE, ids=lambda method: method.name)
def test_those_of_the_literature_advance_too(method):
    """Without friction, targets or whatever else they refuse."""
    first = next(variant for variant in variants() if variant.method == method())
    setup = setup_of(first)
    moved = setup.method.advance(setup.start(), setup.boundary(0))
    assert np.isfinite(moved.x).all() and np.abs(moved.x - tiny_body(first.kind).rest).max() > 0


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
    text = listing(watch.compiled)
    assert text.count("\n") == 3 and ".inner," in text


def test_the_summary_counts_what_was_compiled_twice():
    entries = [
        Compiled("a", "(x)", 1.0),
        Compiled("b", "(x)", 5.0),
        Compiled("a", "(x)", 2.0),
        Compiled("a", "(y)", 0.5),
    ]
    lines = summary(entries, 1)
    assert lines[0] == "4 compiled in 8.5 s of processor time, 1 of them again"
    assert lines[1].split() == ["5.00", "s", "1", "x", "b"] and len(lines) == 2


def test_nothing_is_printed_or_done_when_it_is_there(own_folder, monkeypatch, capsys):
    monkeypatch.setattr(sys, "argv", ["compiling"])
    monkeypatch.setattr(main, "compile_all", lambda names: pytest.fail("compiled again"))
    assert not tasks.is_done(True) and not tasks.is_done(False)
    tasks.set_done(False)
    assert tasks.is_done(False) and not tasks.is_done(True)
    tasks.set_done(True)
    main.main()
    assert capsys.readouterr() == ("", "")


@pytest.mark.parametrize("changed", ["version", "source_fingerprint"])
def test_another_compiler_or_an_edit_asks_for_all_of_it(own_folder, monkeypatch, changed):
    tasks.set_done(True)
    monkeypatch.setattr(tasks, changed, lambda name: "another")
    assert not tasks.is_done(True)


def test_progress_names_what_had_to_be_compiled_and_ends_with_the_sum(own_folder, monkeypatch, capsys, tmp_path):
    def done(names):
        for k, name in enumerate(names):
            yield tasks.Done(name, 9.0, [Compiled("kernel", "(x)", 1.5)] if k else [])

    monkeypatch.setattr(main, "compile_all", done)
    main.run(False, tmp_path / "table.csv")
    lines = capsys.readouterr().out.splitlines()
    assert len(lines) == len(tasks.ESSENTIAL) + 1  # the first, the last, and all but the one that was there
    assert lines[1] == f"compiling 2/3: {tasks.ESSENTIAL[1]}: 1 functions, 1.5 s"
    assert "2 compiled in 3.0 s of processor time, 1 of them again" in lines[-1]
    assert (tmp_path / "table.csv").read_text().count("kernel") == 2
    assert tasks.is_done(False)


def test_a_form_that_does_not_compile_is_named_and_nothing_is_believed(own_folder, monkeypatch, capsys):
    def fails(names):
        raise StudyError(f"{names[0]} could not be compiled: ValueError: no")

    monkeypatch.setattr(main, "compile_all", fails)
    monkeypatch.setattr(sys, "argv", ["compiling", "--essential"])
    with pytest.raises(SystemExit) as stop:
        main.main()
    assert stop.value.code == 1
    assert capsys.readouterr().err == f"organbench: {tasks.ESSENTIAL[0]} could not be compiled: ValueError: no\n"
    assert not tasks.is_done(False)


@pytest.mark.slow
def test_two_processes_do_the_tasks_and_name_the_one_that_fails():
    assert [done.name for done in main.compile_all(["free, whole, float64"])] == ["free, whole, float64"]
    with pytest.raises(StudyError, match="nothing could not be compiled: KeyError: 'nothing'"):
        list(main.compile_all(["nothing"]))


def test_a_method_with_other_settings_is_named_by_them():
    assert Variant(VARIANTS[0], "whole").name == "element, hard=True, whole, float64"
    assert Variant(Free(), "several", "float32").name == "free, several, float32"
