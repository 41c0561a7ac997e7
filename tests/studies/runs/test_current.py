"""Which code makes a stored result stale: all that it was computed with, and nothing that only shows it."""

import pytest

from massspring import sources
from massspring.sources import own_modules, source_fingerprint
from studies.reference.reference_solves import reference_fingerprint
from studies.runs.case import Case
from studies.runs.current import case_fingerprint, run_fingerprint
from studies.runs.recipes import QuadraticBody
from studies.scene.library import LIVER_PROBE

BOTH = {
    "studies.scene.start",
    "studies.geometry.surface.distance",
    "studies.geometry.surface.snap",
    "studies.geometry.mesh.wall_layers",
    "studies.geometry.organs.liver",
    "studies.geometry.mesher.gmsh_calls",
    "massspring.world.trajectories",
    "studies.meshing.held_mesh",
    "studies.meshing.true_shape",
}
RUNS = BOTH | {
    "studies.runs.prepare",
    "studies.meshing.graded_mesh",
    "massspring.body.laws",
    "massspring.kernels.fused.sweep",
    "massspring.run.history",
}
REFERENCES = BOTH | {"studies.meshing.reference_mesh", "studies.reference.problem", "reference_fem.contact.augmented"}
SHOWN = {"studies.metrics.metrics", "studies.plots.laws", "studies.cli.app", "studies.report.results"}


def with_edit(monkeypatch, module: str, fingerprint) -> str:
    """The number after an edit of one module."""
    read = sources._source.__wrapped__
    edited = lambda name: read(name)._replace(digest="edited") if name == module else read(name)  # noqa: E731
    source_fingerprint.cache_clear()
    with monkeypatch.context() as changed:
        changed.setattr(sources, "_source", edited)
        number = fingerprint()
    source_fingerprint.cache_clear()
    return number


@pytest.mark.parametrize(
    ("fingerprint", "makers"), [(run_fingerprint, RUNS), (reference_fingerprint, REFERENCES)], ids=["run", "reference"]
)
def test_what_makes_a_result_makes_it_stale_and_what_shows_it_does_not(monkeypatch, fingerprint, makers):
    before = fingerprint()
    assert makers | SHOWN <= set(own_modules())
    changed = {module for module in makers | SHOWN if with_edit(monkeypatch, module, fingerprint) != before}
    assert changed == makers


def test_springs_make_no_reference_stale_and_elements_no_run(monkeypatch):
    for module, fingerprint in (
        ("massspring.kernels.fused.sweep", reference_fingerprint),
        ("reference_fem.system.assembly", run_fingerprint),
        ("reference_fem.oracles.cook", reference_fingerprint),
    ):
        assert with_edit(monkeypatch, module, fingerprint) == fingerprint()


def test_the_reference_makes_adaptive_bodies_stale_and_no_others(monkeypatch):
    for graded, stale in ((False, False), (True, False), ("adaptive", True)):
        case = Case(LIVER_PROBE, QuadraticBody(794, graded=graded))
        edited = with_edit(monkeypatch, "reference_fem.estimate", lambda case=case: case_fingerprint(case))
        assert (edited != case_fingerprint(case)) == stale
