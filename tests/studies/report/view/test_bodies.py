"""What is shown of a run and of a reference: displacement, error, histories, cells that are not inside out."""

from dataclasses import replace
from itertools import product

import numpy as np
import pytest

from studies.base.errors import StudyError
from studies.reference.solution import Solution
from studies.report.view.bodies import QUADRATIC_TETRAHEDRON, TETRAHEDRON, TRIANGLE, shown_reference, shown_run
from studies.report.view.side_by_side import side_by_side
from tests.studies.made_up_run import CELLS, EDGE, POINTS, SCENE, TRIANGLES, bend, run
from tests.studies.octant import SCENE as OCTANT
from tests.studies.report.view.made import reference_record

EDGES = ((0, 1), (1, 2), (2, 0), (0, 3), (1, 3), (2, 3))
"""Vertices at the ends of the side of each mid-side node of vtkQuadraticTetra."""


@pytest.fixture(scope="module")
def solution():
    return Solution(SCENE, reference_record(SCENE))


def test_a_run_is_what_is_stored_at_the_checkpoints(solution):
    body = shown_run(run(volume=(1.0, 0.98, 1.0, 1.03)), solution, "made up")
    np.testing.assert_array_equal(body.displacement, [0 * POINTS, POINTS + bend(POINTS) - POINTS])
    np.testing.assert_allclose(body.error, [-bend(POINTS) / 2, 0 * POINTS], atol=1e-15)
    np.testing.assert_allclose(body.volume_ratio, [0.98, 1.03])
    np.testing.assert_array_equal(body.force, [1.0, 2.0])
    assert body.cell_type == TETRAHEDRON and (body.cells == CELLS).all()


def test_nodes_that_are_no_points_of_the_organ_have_no_error(solution):
    body = shown_run(run(values={"tetrahedra": np.empty((0, 4), int)}), solution, "surface")
    assert body.cell_type == TRIANGLE and (body.cells == TRIANGLES).all()
    inside = np.setdiff1d(np.arange(len(POINTS)), TRIANGLES)
    assert len(inside) == 1
    assert (np.isnan(body.error).any(axis=(0, 2)) == np.isin(np.arange(len(POINTS)), inside)).all()


def test_errors_are_shown_where_displacements_may_be_compared(solution):
    assert shown_run(run(), None, "alone").error is None
    turns = replace(SCENE, quantities=("force", "volume"))
    assert shown_run(run(scene=turns), solution, "may turn").error is None
    assert shown_reference(Solution(turns, solution.record), "may turn").error is None


def test_a_body_that_ended_early_stays_where_it_was_and_shows_no_numbers(solution):
    broken = {"snapshots": POINTS[None] + 0.5 * bend(POINTS), "snapshot_frame": np.array([2])}
    body = shown_run(run(values=broken, volume=(1.0, 0.9, np.nan, np.nan)), solution, "broke")
    np.testing.assert_array_equal(body.positions, [body.rest + body.displacement[0]] * 2)
    assert np.isfinite(body.displacement[0]).all() and np.isfinite(body.error[0]).all()
    assert np.isnan(body.displacement[1]).all() and np.isnan(body.error[1]).all()
    assert body.volume_ratio[0] == 0.9 and np.isnan(body.volume_ratio[1])


def vertex_volumes(x, cells) -> np.ndarray:
    a, b, c, d = (x[cells[:, k]] for k in range(4))
    return np.einsum("ni,ni->n", np.cross(b - a, c - a), d - a) / 6


def check_mid_side_nodes(body):
    for k, (a, b) in enumerate(EDGES):
        middle = (body.rest[body.cells[:, a]] + body.rest[body.cells[:, b]]) / 2
        np.testing.assert_allclose(body.rest[body.cells[:, 4 + k]], middle, atol=1e-15)


def test_a_reference_is_its_quadratic_tetrahedra_as_vtk_orders_them(solution):
    body = shown_reference(solution, "reference")
    assert body.cell_type == QUADRATIC_TETRAHEDRON
    check_mid_side_nodes(body)
    assert vertex_volumes(body.rest, body.cells).min() > 0
    assert vertex_volumes(body.rest, body.cells).sum() == pytest.approx(EDGE**3)
    np.testing.assert_allclose(body.displacement, [0.5 * bend(body.rest), bend(body.rest)], atol=1e-15)
    assert not body.error.any()
    np.testing.assert_allclose(body.volume_ratio, [1.05, 1.1])


def test_an_octant_becomes_the_whole_body():
    body = shown_reference(Solution(OCTANT, reference_record(OCTANT)), "octant")
    volumes = vertex_volumes(body.rest, body.cells)
    assert volumes.min() > 0 and volumes.sum() == pytest.approx(8 * EDGE**3)
    check_mid_side_nodes(body)
    part = len(body.rest) // 8
    for k, signs in enumerate(product((1, -1), repeat=3)):
        block = slice(part * k, part * (k + 1))
        np.testing.assert_array_equal(body.rest[block], signs * body.rest[:part])
        np.testing.assert_array_equal(body.displacement[:, block], signs * body.displacement[:, :part])
    assert body.error is None  # the squeezed ball may turn


def test_bodies_stand_side_by_side_in_every_step(solution):
    bodies = [shown_reference(solution, "reference"), *(shown_run(run(), solution, str(k)) for k in range(4))]
    grid = side_by_side(np.array(SCENE.checkpoints), bodies)
    case, offset = grid.point_data["case"].values, grid.point_data["offset"].values
    boxes = [(p.min(axis=(0, 1)), p.max(axis=(0, 1))) for p in (grid.points[:, case == k] for k in range(5))]
    for k, (low, high) in enumerate(boxes):
        for other_low, other_high in boxes[:k]:
            assert ((low > other_high) | (other_low > high)).any()
    for k, body in enumerate(bodies):
        np.testing.assert_allclose((grid.points - offset)[:, case == k], body.positions, atol=1e-15)
        np.testing.assert_array_equal(grid.point_data["displacement"].values[:, case == k], body.displacement)
    assert (case[grid.connectivity[grid.offsets[:-1]]] == grid.cell_data["case"].values).all()
    assert offset[case == 0].max() == 0.0
    with pytest.raises(StudyError, match="reference has 2 steps, not 3"):
        side_by_side(np.arange(3.0), bodies[:1])
