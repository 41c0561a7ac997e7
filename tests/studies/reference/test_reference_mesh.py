"""The mesh of a reference: held up to the true outline, finer where asked, never folded."""

from dataclasses import replace

import numpy as np
import pytest
from skfem import MeshTet, MeshTet2

from reference_fem import NewtonSettings, facet_nodes, nodes
from reference_fem.model.problem import find_held
from reference_fem.system.saddle_point import System
from studies.reference.mesh import coarse_body, reference_mesh, rim_sides
from studies.reference.problem import reference_problem
from studies.scenes.ball_clamped import BALL_CLAMPED, CAP, RADIUS
from studies.scenes.liver_probe import LIVER_PROBE
from tests.studies.tiny import cube

LEVEL, LIVER_LEVEL = 150, 200


def planned(scene, **changes):
    return replace(scene, reference=replace(scene.reference, **changes))


def areas(mesh, chosen):
    """Area of the plane projection of the six-node facets whose nodes are all chosen, seen along z [m²]."""
    table = facet_nodes(mesh)
    table = table[np.isin(table, chosen).all(axis=1)]
    x = nodes(mesh)[table]
    # Four flat triangles to a facet: what they cut off is a quarter of a quarter.
    parts = [(0, 3, 5), (3, 1, 4), (5, 4, 2), (3, 4, 5)]
    a, b, c = (np.concatenate([x[:, p[k]] for p in parts]) for k in range(3))
    return abs(np.cross(b - a, c - a)[:, 2].sum()) / 2


@pytest.mark.parametrize("times", [0, 3])
def test_caps_are_round(mesh_cache, times):
    """A cap |z| > 0.8 R is a disc of radius 0.6 R seen along z; a polygon of a dozen sides would be 4 % smaller."""
    mesh, patches, _ = reference_mesh(planned(BALL_CLAMPED, at_outlines=times), LEVEL)
    for patch in patches:
        x = nodes(mesh)[patch]
        # New nodes lie on the quadratic sides of a dozen elements around: a thousandth of the radius off the sphere.
        assert (np.abs(x[:, 2]) >= CAP * RADIUS * (1 - 2e-3)).all()
        np.testing.assert_allclose(np.linalg.norm(x, axis=1), RADIUS, rtol=2e-3 if times else 1e-9)
        # Two chords to a side of a dozen: 1 - sin(2π/24)/(2π/24).
        assert areas(mesh, patch) == pytest.approx(np.pi * (0.6 * RADIUS) ** 2, rel=0.012)


def test_outline_is_closed_and_on_the_edge_of_the_region(mesh_cache):
    mesh, patches, _ = reference_mesh(BALL_CLAMPED, LEVEL)
    table = facet_nodes(mesh)
    sides = rim_sides(table[np.isin(table[:, :3], patches[0]).all(axis=1)])
    _, count = np.unique(sides[:, :2], return_counts=True)
    assert (count == 2).all()
    np.testing.assert_allclose(nodes(mesh)[sides][..., 2], -CAP * RADIUS, rtol=1e-9)


@pytest.mark.parametrize(
    ("scene", "level", "changes"),
    [(BALL_CLAMPED, LEVEL, {"at_outlines": 4}), (LIVER_PROBE, LIVER_LEVEL, {"at_contact": 5})],
)
def test_finer_meshes_are_upright_and_still_held(mesh_cache, scene, level, changes):
    """Moving each new node onto the surface by itself folds elements of the ball; the solver refuses such a mesh."""
    coarse, fine = (reference_problem(planned(scene, **c), level) for c in ({"at_contact": 0}, changes))
    System(fine, NewtonSettings()).solver.release()
    assert fine.mesh.nelements > 1.2 * coarse.mesh.nelements
    for before, after in zip(find_held(coarse), find_held(fine), strict=True):
        assert len(after.nodes) >= len(before.nodes)


def test_refinement_is_where_the_probe_will_be(mesh_cache):
    sphere = LIVER_PROBE.obstacles[0]
    deepest = np.asarray(sphere.centre) + sphere.path(LIVER_PROBE.checkpoints[-1])

    def near(changes):
        x = nodes(reference_mesh(planned(LIVER_PROBE, **changes), LIVER_LEVEL)[0])
        away = np.linalg.norm(x - deepest, axis=1)
        return (away < sphere.radius).sum(), (away > 2.5 * sphere.radius).sum()

    (inside, outside), (more_inside, more_outside) = near({"at_contact": 0}), near({"at_contact": 3})
    assert more_inside > 3 * inside
    assert more_outside < 1.3 * outside


def test_a_body_from_a_file_keeps_its_own_outline():
    """No true surface is known: a patch is the polygon of its facets, on the finer mesh as well."""
    points, _, cells = cube(2)
    body = coarse_body(MeshTet(points.T.copy(), cells.T.copy()), [np.flatnonzero(points[:, 2] < -0.049)])
    finer = body.bisected(body.at_outlines()).bisected(np.arange(5))
    mesh = MeshTet2.from_mesh(finer.mesh)
    (facets,) = finer.facets(mesh)
    assert (nodes(mesh)[facets][..., 2] == -0.05).all()
    assert areas(mesh, np.unique(facets)) == pytest.approx(0.1**2, rel=1e-12)
    assert len(facets) > 8
