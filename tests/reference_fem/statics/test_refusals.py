"""Bad input and loads that cannot converge: one sentence each, naming thing, value, limit and way out."""

from dataclasses import replace

import numpy as np
import pytest
from skfem import MeshTet, MeshTet2

from reference_fem import (
    NeoHookean,
    NewtonSettings,
    PrescribedDisplacement,
    Problem,
    RigidPlane,
    RigidSphere,
    SolveError,
    curve,
    equilibrium_path,
)
from reference_fem.errors import SingularTangent
from reference_fem.statics import newton
from tests.reference_fem.bodies import block, symmetry

TISSUE = NeoHookean(1.0, 1000.0)
BOTTOM = PrescribedDisplacement(lambda x: x[2] < 1e-9)


def refused(problem, times=(1.0,), settings=None):
    with pytest.raises(SolveError) as caught:
        equilibrium_path(problem, times, settings)
    message = str(caught.value)
    assert "\n" not in message
    assert len(message) > 40
    return message, caught.value


@pytest.mark.parametrize(("mu", "kappa"), [(0.0, 1.0), (1.0, -5.0), (np.nan, 1.0), (1.0, np.inf)])
def test_material_out_of_range(mu, kappa):
    with pytest.raises(SolveError, match="must be positive and finite"):
        NeoHookean(mu, kappa)


def test_nan_in_the_mesh():
    mesh = block()
    mesh.p[1, 4] = np.nan
    assert "node 4" in refused(Problem(mesh, TISSUE, [BOTTOM]))[0]


def test_unused_vertex():
    mesh = block()
    t = mesh.t + 1
    p = np.hstack((np.zeros((3, 1)) - 1.0, mesh.p))
    assert "vertex 0 belongs to no tetrahedron" in refused(Problem(MeshTet(p, t), TISSUE, [BOTTOM]))[0]


def test_unused_vertex_behind_all_others():
    mesh = block()
    p, last = np.hstack((mesh.p, np.zeros((3, 1)) - 1.0)), mesh.p.shape[1]
    assert f"vertex {last} belongs to no tetrahedron" in refused(Problem(MeshTet(p, mesh.t), TISSUE, [BOTTOM]))[0]


def pulled(share):
    """A block whose top is pulled up by a tenth for each second, solved up to `share` seconds."""
    top = PrescribedDisplacement(lambda x: x[2] > 1.0 - 1e-9, motion=lambda t: (0.0, 0.0, 0.1 * t))
    return equilibrium_path(Problem(block(), TISSUE, [BOTTOM, top]), (0.5, share), NewtonSettings(smallest_step=0.5))


def test_a_singular_tangent_is_a_step_that_failed(monkeypatch):
    """The first sub-step of the second interval meets it, and its halves do not."""
    plain, made = newton.Tangent, []

    def once(system, evaluation):
        made.append(evaluation)
        if len(made) == first + 1:
            raise SingularTangent("the tangent matrix is singular: hold it")
        return plain(system, evaluation)

    first = iterations_to_the_first()
    monkeypatch.setattr(newton, "Tangent", once)
    assert [step.substeps for step in pulled(1.0)] == [1, 2]


def iterations_to_the_first():
    """Linear solves up to the first output time of `pulled`."""
    return pulled(1.0)[0].newton_iterations


def test_a_tangent_that_stays_singular_ends_the_path_with_what_converged(monkeypatch):
    first, plain, made = iterations_to_the_first(), newton.Tangent, []

    def from_then_on(system, evaluation):
        made.append(evaluation)
        if len(made) > first:
            raise SingularTangent("the tangent matrix is singular: hold it")
        return plain(system, evaluation)

    monkeypatch.setattr(newton, "Tangent", from_then_on)
    with pytest.raises(SolveError, match=r"last that converged.*hold it") as caught:
        pulled(1.0)
    assert [step.t for step in caught.value.converged] == [0.5]


def test_an_element_turned_inside_out():
    mesh = block((2, 2, 2))
    inner = np.flatnonzero(np.all(np.abs(mesh.p - 0.5) < 1e-9, axis=0))
    mesh.p[:, inner] = 1.4
    assert "overlap" in refused(Problem(mesh, TISSUE, [BOTTOM]))[0]


def test_a_flat_element():
    mesh = MeshTet(
        np.array([[0.0, 1, 0, 0, 1], [0, 0, 1, 0, 1], [0, 0, 0, 1, 1e-14]]), np.array([[0, 1, 2, 3], [1, 2, 0, 4]]).T
    )
    message = refused(Problem(mesh, TISSUE, [BOTTOM]))[0]
    assert "inverted or flat" in message or "overlap" in message


def test_a_folded_curved_element():
    mesh = curve(block(), lambda x: x - np.array([[0.0], [0.0], [0.6]]), lambda x: x[2] > 1 - 1e-9)
    assert isinstance(mesh, MeshTet2)
    assert "inverted or flat" in refused(Problem(mesh, TISSUE, [BOTTOM]))[0]


@pytest.mark.parametrize(
    ("held", "words"),
    [
        ([], ["slide along (1, 0, 0)", "slide along (0, 1, 0)", "slide along (0, 0, 1)", "turn about"]),
        (
            [PrescribedDisplacement(lambda x: x[2] < 1e-9, (2,))],
            ["slide along (1, 0, 0)", "slide along (0, 1, 0)", "turn about (0, 0, 1)"],
        ),
        ([PrescribedDisplacement(lambda x: (x[0] < 1e-9) & (x[1] < 1e-9))], ["free to turn about (0, 0, 1):"]),
    ],
)
def test_a_free_rigid_motion_is_named(held, words):
    message, _ = refused(Problem(block(), TISSUE, held))
    for word in words:
        assert word in message


def test_three_symmetry_planes_hold_a_body():
    assert equilibrium_path(Problem(block(), TISSUE, symmetry()), [0.0])[0].energy == 0.0


@pytest.mark.parametrize(
    ("held", "words"),
    [
        (PrescribedDisplacement(lambda x: x[0] > 7.0), "contains no boundary node"),
        (PrescribedDisplacement(lambda x: x[2] < 1e-9, (3,)), "components"),
        (PrescribedDisplacement(lambda x: x[2] < 1e-9, motion=lambda t: (np.nan, 0.0, 0.0)), "three finite numbers"),
    ],
)
def test_bad_held_regions(held, words):
    assert words in refused(Problem(block(), TISSUE, [BOTTOM, held]))[0]


def test_contradictory_held_regions():
    other = PrescribedDisplacement(lambda x: x[0] < 1e-9, motion=lambda t: (0.0, 0.0, 0.1 * t))
    assert "prescribes" in refused(Problem(block(), TISSUE, [BOTTOM, other]))[0]


@pytest.mark.parametrize(
    ("obstacle", "words"),
    [
        (RigidPlane((0.0, 0.0, 0.9), (0.0, 0.0, -1.0)), "obstacle 0 starts 0.1 m inside the body (limit 0.00173 m)"),
        (RigidSphere((0.5, 0.5, 1.2), 0.5), "inside the body"),
        (RigidPlane((0.0, 0.0, 2.0), (0.0, 0.0, 0.0)), "normal is (0, 0, 0)"),
        (RigidSphere((0.0, 0.0, 9.0), -1.0), "radius"),
        (RigidSphere((0.0, 9.0), 1.0), "three finite numbers"),
        (RigidPlane((0.0, 0.0, 2.0), (0.0, 0.0, -1.0), lambda t: (0.0, 0.0, np.inf)), "motion of obstacle 0"),
    ],
)
def test_bad_obstacles(obstacle, words):
    assert words in refused(Problem(block(), TISSUE, [BOTTOM], [obstacle]))[0]


def test_bad_loads_and_orders():
    good = Problem(block(), TISSUE, [BOTTOM])
    assert "density is 0" in refused(replace(good, gravity=(0, 0, -9.81)))[0]
    assert "density" in refused(replace(good, density=-1.0))[0]
    assert "gravity" in refused(replace(good, gravity=(0, np.nan, 0)))[0]
    assert "4 is the least" in refused(replace(good, order=2))[0]
    assert "4 is the least" in refused(replace(good, contact_order=2))[0]


@pytest.mark.parametrize("times", [(), (2.0, 1.0), (-1.0,), (np.nan,)])
def test_bad_times(times):
    assert "times" in refused(Problem(block(), TISSUE, [BOTTOM]), times)[0]


def test_a_load_that_cannot_converge_keeps_what_was_reached():
    """The lid is pushed through the floor between the second and third time: the path stops, with two states."""
    lid = PrescribedDisplacement(
        lambda x: x[2] > 1 - 1e-9, (0, 1, 2), lambda t: (0.0, 0.0, -0.1 * t if t <= 2 else -0.2 - 1.5 * (t - 2))
    )
    states = []
    problem = Problem(block((1, 1, 1)), TISSUE, [BOTTOM, lid])
    with pytest.raises(
        SolveError, match=r"no equilibrium found between t = 2\.\d+ s \(the last that converged\)"
    ) as caught:
        equilibrium_path(problem, (1.0, 2.0, 3.0), NewtonSettings(smallest_step=1 / 16), states.append)
    assert [state.t for state in caught.value.converged] == [1.0, 2.0]
    assert states == caught.value.converged


def test_a_step_that_is_too_long_is_cut():
    """One output time far away: reached in several sub-steps, with the answer of an even path."""
    lid = PrescribedDisplacement(lambda x: x[2] > 1 - 1e-9, (0, 1, 2), lambda t: (1.2 * t, 0.0, -0.35 * t))
    problem = Problem(block((2, 2, 2)), TISSUE, [BOTTOM, lid])
    settings = NewtonSettings(max_iterations=5)
    state = equilibrium_path(problem, (1.0,), settings)[0]
    even = equilibrium_path(problem, np.arange(1, 11) / 10)[-1]
    assert state.substeps > 1
    np.testing.assert_allclose(state.held_force, even.held_force, atol=1e-5)
