"""Points are found once in a mesh, whichever solution on it and whichever checkpoint is asked."""

import numpy as np
import pytest

from reference_fem import Evaluator
from studies.reference.solution import Solution
from tests.studies.made_up_run import POINTS, SCENE, bend
from tests.studies.report.view.made import reference_record


@pytest.fixture
def located(monkeypatch):
    """How many points each search was for."""
    searched, locate = [], Evaluator.locate
    monkeypatch.setattr(Evaluator, "locate", lambda self, points: searched.append(len(points)) or locate(self, points))
    return searched


def test_solutions_on_one_mesh_find_the_same_points_once(located):
    one, other = (Solution(SCENE, reference_record(SCENE)) for _ in range(2))
    inside = 0.5 * (POINTS[:-1] + POINTS[1:])
    for solution in (one, other):
        np.testing.assert_allclose(solution.displacement(inside), bend(inside), atol=1e-15)
        np.testing.assert_allclose(solution.displacement(inside, 0), bend(inside) / len(SCENE.checkpoints), atol=1e-15)
        np.testing.assert_array_equal(solution.displacements(inside)[-1], solution.displacement(inside))
    assert located == [len(inside)]
    one.displacement(POINTS)
    assert located == [len(inside), len(POINTS)]


def test_meshes_that_differ_by_a_node_are_searched_each(located):
    record = reference_record(SCENE)
    one = Solution(SCENE, record)
    one.displacement(POINTS)
    nodes = record.fields["nodes"].values
    nodes[0] += 1e-9
    Solution(SCENE, record).displacement(POINTS)
    assert located == [len(POINTS)] * 2
