"""The second opinion: NGSolve gives the same answers on the same meshes, and a difference would show."""

from dataclasses import replace

import numpy as np
import pytest

from reference_fem import (
    NeoHookean,
    PrescribedDisplacement,
    Problem,
    RigidPlane,
    SolveError,
    crosscheck,
    equilibrium_path,
    facet_nodes,
)
from reference_fem.crosscheck import clamped_ball, ngsolve_code, opinions, pulled_organ, solve, thick_sphere
from reference_fem.crosscheck.bench import INVERSES, iteration_ratio
from reference_fem.crosscheck.cases import STEPS, facets_where
from reference_fem.crosscheck.opinions import AGREEMENT, CLOSE, opinion
from tests.reference_fem.bodies import ball_octant, block, symmetry

needs_ngsolve = pytest.mark.skipif(
    not crosscheck.available(), reason="NGSolve is not installed: pip install organbench[crosscheck]"
)


def stretched(**changes):
    """A skewed block drawn out and aside: no element is like another."""
    grip = PrescribedDisplacement(lambda x: x[2] > 1 - 1e-9, motion=lambda t: (0.1 * t, 0.0, 0.2 * t))
    problem = Problem(
        block((2, 2, 2), skew=0.1), NeoHookean(1.0, 1000.0), [grip, PrescribedDisplacement(lambda x: x[2] < 1e-9)]
    )
    return replace(problem, **changes)


@pytest.fixture(scope="module")
def ours():
    return equilibrium_path(stretched(), STEPS, CLOSE)[-1]


@needs_ngsolve
def test_both_codes_agree_at_every_node(ours):
    """Displacements, pressures and forces, to Newton's tolerance: a wrong entry of a table shows at one node."""
    theirs = solve(stretched(), STEPS)
    np.testing.assert_allclose(ours.u, theirs.u, atol=AGREEMENT * np.abs(theirs.u).max())
    np.testing.assert_allclose(ours.p, theirs.p, atol=AGREEMENT * np.abs(theirs.p).max())
    np.testing.assert_allclose(ours.held_force, theirs.held_force, atol=AGREEMENT * np.abs(theirs.held_force).max())


@needs_ngsolve
@pytest.mark.parametrize("changes", [{"material": NeoHookean(1.0, 1010.0)}, {"order": 6}], ids=["bulk", "quadrature"])
def test_another_bulk_modulus_or_rule_makes_a_difference(ours, changes):
    """A hundredth of kappa, or other quadrature points, move the answer by more than the codes may differ."""
    theirs = solve(stretched(**changes), STEPS)
    assert np.abs(ours.p - theirs.p).max() > 100.0 * AGREEMENT * np.abs(theirs.p).max()


@needs_ngsolve
@pytest.mark.parametrize("problem", [clamped_ball(3), thick_sphere(3, 2)], ids=["ball", "sphere"])
def test_small_versions_of_the_oracles_agree(problem):
    checks = opinion(problem, "small")
    assert all(check.met for check in checks)
    assert checks[0].expected > 0.1


@needs_ngsolve
def test_the_four_opinions():
    """Each says where it comes from; organs are built only when they are measured."""
    mesh = block((2, 2, 2))
    low, high = (np.flatnonzero(np.abs(mesh.p[2] - z) < 1e-9) for z in (0.0, 1.0))
    built = []

    def organ():
        built.append(pulled_organ(mesh, low, high, (0.0, 0.1, 0.2)))
        return built[0]

    oracles = opinions(organ, organ)
    assert not built
    assert [oracle.name for oracle in oracles] == ["second_ball", "second_sphere", "second_organ", "second_cut"]
    assert all("NGSolve" in oracle.source and not oracle.fast for oracle in oracles)
    outcome = oracles[2].measure()
    assert len(built) == 1
    assert all(check.met for check in outcome.checks)
    assert outcome.checks[0].expected > 100.0


@needs_ngsolve
@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"obstacles": [RigidPlane((0, 0, 2), (0, 0, -1))]}, "held regions and nothing else"),
        ({"element": "MINI"}, "held regions and nothing else"),
        ({"mesh": ball_octant(2), "held": symmetry()}, "straight elements"),
        (
            {"held": [PrescribedDisplacement(lambda x: np.abs(x[2] - 0.75) < 1e-9)]},
            "mid-side nodes are held while a vertex",
        ),
    ],
)
def test_what_the_translation_does_not_cover_is_refused(changes, message):
    with pytest.raises(SolveError, match=message):
        solve(stretched(**changes), (1.0,))


@needs_ngsolve
def test_a_newton_that_does_not_converge_is_refused():
    model = ngsolve_code.NgsolveModel(stretched())
    with pytest.raises(SolveError, match="did not converge in 0 iterations"):
        model.newton("umfpack", 1e-9, most=0)


@needs_ngsolve
def test_an_iteration_is_timed_in_both_codes():
    cost = iteration_ratio(n=3, repeats=1)
    # 3 x 377 displacements and 63 pressures
    assert cost["unknowns"] == 1194
    assert cost["own_s"] / cost["ngsolve_s"] == cost["ratio"] > 0.0
    assert cost["inverse"] in INVERSES


def test_without_the_extra_a_sentence_says_how_to_get_it(monkeypatch):
    monkeypatch.setattr(ngsolve_code, "available", lambda: False)
    with pytest.raises(SolveError, match=r"pip install organbench\[crosscheck\]"):
        ngsolve_code.load("ngsolve")


def test_a_patch_is_made_of_whole_facets():
    mesh = block((2, 2, 2))
    where = facets_where(mesh, lambda x: x[0] < 1e-9)
    table = facet_nodes(mesh)
    x = np.vstack((mesh.p.T, mesh.p[:, mesh.edges].mean(axis=1).T))
    held = where(x.T)
    assert held.sum() == (np.abs(x[:, 0]) < 1e-9).sum()
    assert held[np.unique(table[(np.abs(x[table[:, :3], 0]) < 1e-9).all(axis=1)])].all()
    with pytest.raises(SolveError, match="no whole boundary facet"):
        facets_where(mesh, lambda x: np.linalg.norm(x, axis=0) < 1e-9)


def test_patches_of_an_organ_that_meet_are_refused():
    with pytest.raises(SolveError, match="share vertices"):
        pulled_organ(block((1, 1, 1)), [0, 1, 2], [2, 3], (0.0, 0.0, 0.1))
