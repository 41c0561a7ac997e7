"""The shape of a reference is measured, stored, and named where the user looks if it is far from the organ's."""

import shutil
from dataclasses import replace

import numpy as np
import pytest

from studies.meshing.bounds import REFERENCE_SHAPE
from studies.meshing.true_surface import true_surface
from studies.metrics.table import OFF_SHAPE
from studies.reference.load import load_reference, reference_for
from studies.reference.published import FOLDER, judged_scenes
from studies.reference.shape import shape_attributes, shape_of
from studies.report.page.markup import table
from studies.scene.library import BALL_CLAMPED
from studies.store.ledger import Ledger
from studies.store.record import write_record
from studies.sweep.job import do, reference_jobs
from studies.sweep.load import References, load_runs, table_rows
from studies.sweep.standings import warnings_of
from tests.studies.octant import SCENE
from tests.studies.tiny import tiny_case, tiny_study

STUDY = tiny_study(cases=(tiny_case(scene=SCENE),))


@pytest.mark.parametrize("name", ["ball_squeeze", "spleen_sag", "liver_incised"])
def test_published_references_have_the_shape_that_is_stored(name):
    """Of a cut one without the faces of the cut; the truth is sampled as finely as it is on bodies."""
    reference = reference_for(FOLDER, judged_scenes()[name])
    assert shape_of(reference).distance == pytest.approx(reference.shape_error, rel=0.01)
    assert bool(reference.warnings) == (name != "ball_squeeze")


def test_a_dent_is_measured():
    reference = reference_for(FOLDER, BALL_CLAMPED)
    points, facets, _ = reference.boundary
    size, deepest = (
        true_surface(BALL_CLAMPED.organ).size,
        np.argmax(points[:, 0] * np.isin(np.arange(len(points)), facets)),
    )
    values = reference.field("nodes").copy()
    values[deepest] *= 1.0 - 0.02 * size / np.linalg.norm(values[deepest])
    field = replace(reference.record.fields["nodes"], values=values)
    dented = replace(reference, record=replace(reference.record, fields=reference.record.fields | {"nodes": field}))
    assert 0.012 < shape_of(dented).distance < 0.021


@pytest.fixture
def root(solved, tmp_path, mesh_cache):
    """A case whose reference is 2 % of the size off its organ."""
    from studies.runs.run import run_case

    root = shutil.copytree(solved, tmp_path / "results")
    run_case(root, STUDY.name, STUDY.cases[0])
    (job,) = reference_jobs(root, [SCENE])
    record = load_reference(root, SCENE).record
    write_record(job.path, replace(record, attributes=record.attributes | shape_attributes(SCENE.name, 0.02)))
    return root


def test_one_beyond_the_bound_is_named_by_run_table_page_and_show(root, organbench, tmp_path):
    words = f"up to 2 % of the size off the organ's shape (bound {REFERENCE_SHAPE:g} %)"
    assert words in warnings_of(Ledger(root), STUDY)[0]
    assert words in load_runs(root, STUDY)[1][0]
    (row,), remarks = table_rows(References(Ledger(root)), STUDY, [])
    assert words in remarks[0] and row[OFF_SHAPE] == pytest.approx(2.0)
    (shown,) = table([{**row, "case": "0", "study": "tiny"}], {})["rows"]
    assert "reference 2 % off the shape" in shown["marks"]
    file = tmp_path / "mine.py"
    file.write_text("from tests.studies.reference.test_shape import STUDY\n")
    _, out, _ = organbench("show", file, "--results", root)
    assert words in " ".join(out.split())


def test_one_within_it_is_not(tmp_path):
    (job,) = reference_jobs(tmp_path, [BALL_CLAMPED])
    do(job)
    assert warnings_of(Ledger(tmp_path), tiny_study(cases=(tiny_case(scene=BALL_CLAMPED),))) == []
