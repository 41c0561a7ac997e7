"""Code that is compiled beforehand: which forms there are, that they run, and that it happens once."""

import sys

import numpy as np
import pytest

from massspring import LITERATURE, METHODS, Free, ImplicitVolume
from massspring.methods import VARIANTS
from studies.base.compile_watch import Compiled, watching
from studies.base.errors import StudyError
from studies.catalog import STUDIES
from studies.sweep.compiling import main
from studies.sweep.compiling.bodies import EDGE, KINDS, tiny_block, tiny_body
from studies.sweep.compiling.frames import OWN_TYPES, PLAIN, PROBE, Variant, advance, setup_of, variants


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
        options = {option for option, yes in ((PLAIN, True), (PROBE, table.thin_probes)) if yes}
        assert {variant.option for variant in own} == options
        assert {variant.precision for variant in own} == {"float64", "float32"} if table.float32 else {"float64"}
        kinds = {variant.kind for variant in own}
        assert kinds == {kind for kind in KINDS if method().why_not(tiny_body(kind)) is None} and kinds


def test_the_shared_kernels_and_the_reference_come_first():
    """Next to each other, two processes would both compile the loop of a family."""
    names, forms = list(main.tasks()), [variant.name for variant in variants()]
    kinds = [variant.kind for variant in variants()]
    assert kinds.index("nodal") > max(k for k, kind in enumerate(kinds) if kind in OWN_TYPES)
    assert names[0].startswith("implicit_volume, whole") and names[1].startswith("reference")
    assert len(set(names)) == len(names) == len(forms) + sum(name.startswith("reference") for name in names)
    for one, other in (("shake", "projection"), ("penalty", "pressure")):
        first, second = (forms.index(f"{name}, whole, float64") for name in (one, other))
        assert second - first > 2


def test_what_is_essential_is_what_the_main_studies_need():
    assert set(main.ESSENTIAL) <= set(main.tasks())
    needed = {(case.method.name, case.precision) for study in STUDIES if study.main for case in study.cases}
    assert needed == {("implicit_volume", "float64"), ("free", "float64")}
    assert all(f"{name}, whole, {precision}" in main.ESSENTIAL for name, precision in needed)


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


def called(monkeypatch, *words):
    monkeypatch.setattr(sys, "argv", ["compiling", *words])
    main.main()


def test_progress_names_what_had_to_be_compiled_and_what_is_there_is_silent(own_folder, monkeypatch, capsys):
    def done(names):
        for k, name in enumerate(names):
            yield main.Done(name, [Compiled("kernel", "(x)", 1.5)] if k else [])

    monkeypatch.setattr(main, "compile_all", done)
    called(monkeypatch, "--essential")
    lines = capsys.readouterr().out.splitlines()
    assert len(lines) == len(main.ESSENTIAL) + 1  # the first, the last, and all but the one that was there
    assert lines[1] == f"compiling 2/3: {main.ESSENTIAL[1]}: 1 functions, 1.5 s"
    assert "2 compiled in 3.0 s of processor time, 1 of them again" in lines[-1]
    monkeypatch.setattr(main, "compile_all", lambda names: pytest.fail("compiled again"))
    called(monkeypatch, "--essential")
    assert capsys.readouterr() == ("", "") and not main.is_done(True)


@pytest.mark.parametrize("changed", ["version", "source_fingerprint"])
def test_another_compiler_or_an_edit_asks_for_all_of_it(own_folder, monkeypatch, changed):
    main.write_whole(main.stamp(True), b"")
    assert main.is_done(True) and main.is_done(False)
    monkeypatch.setattr(main, changed, lambda name: "another")
    assert not main.is_done(True)


def test_a_form_that_does_not_compile_is_named_and_nothing_is_believed(own_folder, monkeypatch, capsys):
    def fails(names):
        raise StudyError(f"{names[0]} could not be compiled: ValueError: no")

    monkeypatch.setattr(main, "compile_all", fails)
    with pytest.raises(SystemExit) as stop:
        called(monkeypatch, "--essential")
    assert stop.value.code == 1
    assert capsys.readouterr().err == f"organbench: {main.ESSENTIAL[0]} could not be compiled: ValueError: no\n"
    assert not main.is_done(False)


@pytest.mark.slow
def test_two_processes_do_the_tasks_and_name_the_one_that_fails():
    assert [done.name for done in main.compile_all(["free, whole, float64"])] == ["free, whole, float64"]
    with pytest.raises(StudyError, match="nothing could not be compiled: KeyError: 'nothing'"):
        list(main.compile_all(["nothing"]))


def test_a_method_with_other_settings_is_named_by_them():
    assert Variant(VARIANTS[0], "whole").name == "element, hard=True, whole, float64"
    assert Variant(Free(), "several", "float32").name == "free, several, float32"
