"""A recorded surface is where the run was, at the same steps, from start to end; other cases record none."""

from dataclasses import replace

import numpy as np
import pytest

from massspring import simulate
from studies.runs import surface_frames
from studies.runs.case import Case, case_from_json
from studies.runs.prepare import prepare
from studies.runs.recipes import TetrahedralBody
from studies.runs.run import checkpoint_frames, measure, run_case
from studies.runs.surface_frames import MOMENTS, moments
from studies.scene.library import BLADDER_FILL
from studies.scene.library.stress import STRESS_SCENES
from studies.store.record import Status, read_record
from studies.store.schema import SURFACE
from tests.studies.tiny import NODES, diverging_case, tiny_case

FRAMES = 130
"""More than there are moments, and no multiple of them."""
CASE = tiny_case(frames=FRAMES, recorded=("surface",))


@pytest.fixture(scope="module")
def stored(mesh_cache, tmp_path_factory):
    """A run with its surface, and where it lies."""
    path = run_case(tmp_path_factory.mktemp("surface"), "tiny", CASE)
    return path, read_record(path)


@pytest.fixture(scope="module")
def every_frame(mesh_cache):
    """The positions of the same run after every frame, kept in memory."""
    prepared = prepare(CASE)
    return prepared, simulate(prepared.setup, range(1, FRAMES + 1))


def test_the_frames_are_the_run_s_own_positions(stored, every_frame):
    record, (prepared, history) = stored[1], every_frame
    frames, nodes, surface = (record.fields[name].values for name in SURFACE)
    assert surface.dtype == np.float32 and surface.shape == (len(frames), len(nodes), 3)
    own = np.concatenate([prepared.setup.body.rest[None], history.snapshots])
    assert np.array_equal(surface, own[frames][:, nodes].astype(np.float32))
    # Ends, checkpoints and about 60 more.
    assert frames[0] == 0 and frames[-1] == FRAMES and np.all(np.diff(frames) > 0)
    assert set(checkpoint_frames(CASE, prepared)) <= set(frames) and len(frames) <= MOMENTS + 1 + 7
    assert np.diff(frames).max() == -(-FRAMES // MOMENTS)


def test_the_nodes_are_those_of_the_surface_and_fewer_than_all(stored):
    record = stored[1]
    nodes = record.fields["surface_node"].values
    assert np.array_equal(nodes, np.unique(record.fields["triangles"].values)) and len(nodes) == NODES
    assert record.attributes["nodes"] > NODES


def test_nothing_else_changes_and_nothing_is_recorded_unasked(stored):
    plain, full = measure(CASE.replaced(recorded=())), stored[1]
    assert case_from_json(CASE.key) == CASE
    assert set(full.fields) - set(plain.fields) == set(SURFACE)
    for name, field in plain.fields.items():
        assert np.array_equal(field.values, full.fields[name].values, equal_nan=field.values.dtype.kind == "f"), name


def test_an_early_end_is_the_last_frame_and_a_start_of_its_own_the_first():
    cut = measure(diverging_case().replaced(frames=FRAMES, recorded=("surface",)))
    assert cut.status == Status.DIVERGED
    frames, surface = cut.fields["surface_frame"].values, cut.fields["surface"].values
    assert frames[-1] == cut.attributes["good_frames"] < FRAMES and np.isfinite(surface).all()
    shrunk = next(scene for scene in STRESS_SCENES if scene.name == "stress_shrunk")
    record = measure(Case(shrunk, TetrahedralBody(nodes=NODES), dt_fraction=0.2, frames=4, recorded=("surface",)))
    first = record.fields["surface"].values[0]
    assert np.ptp(first, axis=0).max() < 0.01 * np.ptp(record.fields["rest"].values, axis=0).max()


def test_a_lumen_is_not_seen():
    scene = replace(BLADDER_FILL, reference=None)
    record = measure(Case(scene, TetrahedralBody(nodes=400), frames=1, dt_fraction=0.5, recorded=("surface",)))
    nodes, triangles = record.fields["surface_node"].values, record.fields["triangles"].values
    assert len(nodes) < len(np.unique(triangles))
    inside = np.isin(triangles, nodes).all(axis=1)
    assert 0 < inside.sum() < len(triangles) and np.array_equal(np.unique(triangles[inside]), nodes)


def test_moments_are_few_and_never_before_the_first_frame():
    assert moments(5, [5]) == [1, 2, 3, 4, 5]
    assert len(moments(80_000, [1, 777])) == MOMENTS + 2
    assert moments(1, [1]) == [1] and surface_frames.MOMENTS == 60
