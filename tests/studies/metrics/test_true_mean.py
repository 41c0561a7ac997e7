"""mean_error over the true surface includes errors between the body's nodes and places that the body lacks."""

from dataclasses import replace

import numpy as np
import pytest

from massspring import quadratic_body
from studies.meshing.bounds import SHAPE
from studies.meshing.rest_surface import OUTER, RestSurface, rest_surfaces
from studies.metrics.table import metric
from studies.reference.solution import Boundary, Solution
from studies.runs.recipes import QuadraticBody, TetrahedralBody
from studies.scene.library.ball_squeeze import RADIUS as BALL
from studies.store.record import Field
from tests.massspring.conftest import SOFT
from tests.massspring.quadratic import ball_mesh
from tests.studies.made_up_run import EDGE, POINTS, SHIFT, TRIANGLES, of, reference, run
from tests.studies.metrics.bodies import ball_run
from tests.studies.octant import SCENE as OCTANT
from tests.studies.tiny import cube


def even(x):
    """A rigid shift by 30 mm."""
    return np.tile(SHIFT, (len(x), 1))


def body_of(points, triangles, cells, motion):
    """Fields of a body that moves by `motion` at its nodes."""
    return {"rest": points, "snapshots": (points + motion(points))[None], "triangles": triangles, "tetrahedra": cells}


def areas():
    """Share of the reference's area at each of its nodes."""
    (side,) = rest_surfaces(POINTS, TRIANGLES).values()
    return side.areas / side.areas.sum()


@pytest.mark.parametrize("gap", [0.5, 1.0, 3.0, 20.0])
def test_what_the_body_lacks_beyond_a_hundredth_of_the_size_is_an_error(gap):
    """One side of the cube lies `gap` % of the size inside the reference's; everything else is right."""
    size = EDGE * 3**0.5
    short = POINTS - [gap / 100 * size, 0.0, 0.0] * (POINTS[:, :1] > 0)
    error = of("mean_error", values=body_of(short, TRIANGLES, cube()[2], even), reference=reference(even))
    beyond = max(0.0, gap - SHAPE) / 100 * size * areas()[POINTS[:, 0] > 0].sum()
    assert error == pytest.approx(100 * beyond / 0.03, rel=1e-9, abs=1e-9)


def test_nothing_is_left_out():
    """The whole distance of a body far away counts."""
    far = POINTS + np.array([1.0, 0.0, 0.0])
    error = of("mean_error", values=body_of(far, TRIANGLES, cube()[2], even), reference=reference(even))
    assert error > 100 * (1.0 - EDGE - SHAPE / 100 * EDGE * 3**0.5) / 0.03


def test_what_lies_between_the_body_s_nodes_counts():
    """Eight corners are right, the middles of edges and sides are not: the old metric, at the corners, saw nothing."""

    def wave(x):
        return SHIFT * np.cos(np.pi * x[:, 2:] / EDGE)  # 0 at the corners, 30 mm halfway up

    points, triangles, cells = cube(1, EDGE)
    body = body_of(points, triangles, cells, wave)
    assert of("surface_error", values=body, reference=reference(even)) == pytest.approx(100.0)
    error = of("mean_error", values=body, reference=reference(wave))
    assert error == pytest.approx(100 * areas()[np.abs(POINTS[:, 2]) < 1e-9].sum(), rel=1e-9)


def test_between_the_nodes_of_curved_facets_the_displacement_is_quadratic():
    """A reference twice as fine, on the same ball: what a quadratic field loses is what the surfaces are apart."""
    body = quadratic_body(*ball_mesh(1), SOFT)
    fine, cells = ball_mesh(2)

    def swell(x):
        return np.column_stack([x[:, 0] * x[:, 1], x[:, 2] ** 2, x[:, 0] * x[:, 2]]) / 0.05

    truth = replace_boundary(fine, quadratic_body(fine, cells, SOFT).triangles.astype(int), swell)
    still = ball_run(body)
    values = still.record.fields | {"snapshots": Field((body.rest + swell(body.rest))[None], "m", "")}
    curved = replace(still, record=replace(still.record, fields=values), reference=truth)
    flat = replace(curved, case=replace(curved.case, body=TetrahedralBody()))
    assert metric("mean_error")(curved) < 0.3 < 3 * metric("mean_error")(curved) < metric("mean_error")(flat)


def replace_boundary(points, triangles, motion):
    """A made-up reference with this surface."""
    truth = reference(motion)
    truth.boundary = Boundary(points, triangles, motion(points))
    return truth


def test_a_surface_body_of_a_hollow_organ_is_compared_with_the_outer_surface():
    """The reference's lumen moves elsewhere; a filled body has one to compare it with."""
    inner = np.concatenate([POINTS, 0.5 * POINTS])
    both = np.concatenate([TRIANGLES, len(POINTS) + TRIANGLES[:, ::-1]])
    moved = np.concatenate([even(POINTS), 3 * even(POINTS)])
    truth = replace_boundary(inner, both, lambda x: moved)
    alone = body_of(POINTS, TRIANGLES, np.empty((0, 4), int), even)
    assert of("mean_error", values=alone, reference=truth) == pytest.approx(0.0, abs=1e-10)
    hollow = {**body_of(inner, both, cube()[2], even), "mass": np.ones(len(inner))}
    share = 0.25 / 1.25  # of the area
    assert of("mean_error", values=hollow, reference=truth) == pytest.approx(100 * share * 2 / 3, rel=1e-9)


def test_a_quadratic_record_with_linear_facets_has_no_mean_error():
    made = run()
    odd = replace(made, case=replace(made.case, body=QuadraticBody()))
    assert np.isnan(metric("mean_error")(odd))


def test_of_an_octant_the_whole_ball_is_compared():
    """Closed, with every mirror image in its place, and a displacement that is mirrored with it."""
    from reference_fem import nodes
    from studies.meshing.reference_mesh import reference_mesh

    mesh, _, _ = reference_mesh(OCTANT, 0.5)
    points = nodes(mesh)
    moved = 0.1 * points * [1.0, 2.0, 3.0]
    values = {"nodes": points, "tetrahedra": mesh.t.T.astype(int), "displacement": moved[None]}
    fields = {name: Field(value, "m", "") for name, value in values.items()}
    whole = Solution(OCTANT, replace(run().record, fields=fields)).boundary
    (side,) = rest_surfaces(whole.points, whole.facets).values()
    assert list(rest_surfaces(whole.points, whole.facets)) == [OUTER]
    assert side.volume == pytest.approx(4 / 3 * np.pi * BALL**3, rel=2e-3)
    assert whole.displacement == pytest.approx(0.1 * whole.points * [1.0, 2.0, 3.0], abs=1e-15)
    outside = np.unique(whole.facets)
    assert np.allclose(np.linalg.norm(whole.points[outside], axis=1), BALL, rtol=1e-9)
    assert len(np.unique(np.round(whole.points[outside], 12), axis=0)) == len(outside)


def test_the_nearest_facet_may_be_a_large_one_behind_many_small_ones():
    """Its centroid is farther away than those of forty others, and it is nearer."""
    large = np.array([[0.0, 0, 0], [10, 0, 0], [0, 10, 0]])
    small = np.array([9.0, 0.2, 1.0]) + 0.05 * np.random.default_rng(2).normal(size=(120, 3))
    side = RestSurface(np.concatenate([large, small]), np.arange(123).reshape(-1, 3))
    query = np.array([[9.0, 0.2, 0.3]])
    at = side.nearest(query)
    assert at.facet == [0] and at.distance == pytest.approx([0.3])
    assert side.interpolated(side.points, at) == pytest.approx(np.array([[9.0, 0.2, 0.0]]))
