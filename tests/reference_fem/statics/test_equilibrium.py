"""Paths of rest: homogeneous states, contact with planes and probes, loads that cannot converge, and bad input."""

from dataclasses import replace

import numpy as np
import pytest
from skfem import MeshTet

from reference_fem import (
    NeoHookean,
    NewtonSettings,
    PrescribedDisplacement,
    Problem,
    RigidCapsule,
    RigidPlane,
    RigidSphere,
    SolveError,
    curve,
    equilibrium_path,
    exact,
    nodes,
)
from reference_fem.errors import SingularTangent
from reference_fem.oracles import uniaxial
from reference_fem.statics import newton
from tests.reference_fem.bodies import ball_octant, block, symmetry

TIGHT = NewtonSettings(force_tol=1e-11, volume_tol=1e-12)
"""Newton converges quadratically: these cost one more iteration and leave round-off only."""


def test_uniaxial_closed_form_tends_to_the_incompressible_one():
    for stretch, force in ((0.7, -1.340816), (0.8, -0.7625), (0.9, -0.334568), (1.5, 1.055556)):
        assert stretch - stretch**-2 == pytest.approx(force, abs=1e-6)
        # the difference is of order mu / kappa
        assert exact.uniaxial_stress(NeoHookean(1.0, 1e6), stretch) == pytest.approx(force, abs=3e-6)


def test_uniaxial_test_notices_a_material_that_is_a_thousandth_too_stiff():
    class Stiffer(NeoHookean):
        @property
        def parameters(self):
            return np.array([1.001 * self.mu, 0.0, self.kappa])

    _, state = uniaxial.pull(Stiffer(1.0, 1000.0), 0.8, block())
    assert state.held_force[3, 2] != pytest.approx(exact.uniaxial_stress(NeoHookean(1.0, 1000.0), 0.8), rel=1e-4)


def test_holders_carry_the_weight():
    """A block that hangs from its top: the reaction is its weight, and rest has no pressure jump at the free end."""
    problem = Problem(
        block(),
        NeoHookean(1800.0, 1.8e6),
        [PrescribedDisplacement(lambda x: x[2] > 1 - 1e-9)],
        gravity=(0.0, 0.0, -9.81),
        density=10.0,
    )
    state = equilibrium_path(problem, [0.0], TIGHT)[0]
    np.testing.assert_allclose(state.held_force[0], (0.0, 0.0, 98.1), atol=98.1 * 1e-9)
    assert state.u[np.argmin(nodes(problem.mesh)[:, 2]), 2] < 0.0


def test_energy_is_the_work_of_the_holders():
    """Simpson's rule over the stretch, whose error at these nine points is below 1e-7."""
    held = [*symmetry(), PrescribedDisplacement(lambda x: x[2] > 1 - 1e-9, (2,), lambda t: (0.0, 0.0, 0.4 * t))]
    times = np.arange(1, 9) / 8
    path = equilibrium_path(Problem(block((1, 1, 1)), NeoHookean(1.0, 1000.0), held), times, TIGHT)
    force = np.array([0.0] + [state.held_force[3, 2] for state in path])
    work = 0.4 / 24 * (force @ np.array([1, 4, 2, 4, 2, 4, 2, 4, 1]))
    assert path[-1].energy == pytest.approx(work, rel=1e-5)


def squeeze(n, times, penetration_tol=1e-3, kappa=5000.0, **settings):
    mesh = ball_octant(n)
    plane = RigidPlane((0.0, 0.0, 1.0), (0.0, 0.0, -1.0), lambda t: (0.0, 0.0, -t))
    problem = Problem(mesh, NeoHookean(1.0, kappa), symmetry(), [plane])
    return mesh, equilibrium_path(problem, times, NewtonSettings(penetration_tol=penetration_tol, **settings))


@pytest.fixture(scope="module")
def squeezed():
    return squeeze(10, (0.05, 0.10, 0.15, 0.20, 0.25, 0.30))


@pytest.mark.parametrize("share", [0.10, 0.20, 0.30])
def test_force_and_equator_of_a_squeezed_ball(squeezed, share):
    """Within 1 %: 1,000 elements leave 0.5 %, an off-by-one in the contact weights would be far more."""
    (mesh, path), x = squeezed, nodes(squeezed[0])
    state = next(s for s in path if s.t == share)
    equator = (nodes(mesh) + state.u)[np.argmax(x[:, 0]), 0]
    assert equator == pytest.approx(exact.BALL_BETWEEN_PLANES[share][1], rel=1e-3)
    assert -4.0 * state.obstacle_force[0, 2] == pytest.approx(exact.BALL_BETWEEN_PLANES[share][0], rel=0.01)


def test_a_squeezed_ball_keeps_its_volume_and_stays_out_of_the_plane(squeezed):
    for state in squeezed[1]:
        assert abs(state.volume / state.volume0 - 1.0) < 5e-4
        assert state.min_J > 0.5
        assert state.penetration <= 1e-3 * state.t


def test_forces_balance(squeezed):
    """Bottom plane of symmetry against obstacle: equilibrium to the force tolerance, 1e-6."""
    for state in squeezed[1]:
        force = state.obstacle_force.sum(axis=0) + state.held_force.sum(axis=0)
        assert np.abs(force).max() < 3e-6 * np.abs(state.obstacle_force).max()
        np.testing.assert_allclose(state.reaction.sum(axis=0), state.held_force.sum(axis=0), atol=1e-12)


def test_a_softer_bulk_is_noticed():
    """The volume test would catch kappa entering with a wrong power: at kappa = 10 mu the volume goes."""
    _, path = squeeze(4, (0.1, 0.2), kappa=10.0)
    assert path[-1].volume / path[-1].volume0 - 1.0 < -5e-4


def test_without_multiplier_updates_a_soft_penalty_sinks_in():
    _, path = squeeze(5, (0.1, 0.2), penetration_tol=1.0, penalty=30.0)
    assert path[-1].penetration > 1e-3 * path[-1].t
    _, path = squeeze(5, (0.1, 0.2), penalty=30.0)
    assert path[-1].penetration <= 1e-3 * path[-1].t


@pytest.fixture(scope="module")
def probed():
    """A ball of a third of the body's radius pushed in along the axis, the equator glued."""
    held = [PrescribedDisplacement(lambda x: np.abs(x[2]) < 1e-9), *symmetry()[:2]]
    probe = RigidSphere((0.0, 0.0, 1.35), 0.35, lambda t: (0.0, 0.0, -t))
    mesh = ball_octant(6)
    return mesh, probe, equilibrium_path(Problem(mesh, NeoHookean(1.0, 1000.0), held, [probe]), (0.1, 0.2))


def test_a_probe_is_carried_by_the_holders(probed):
    for state in probed[2]:
        balance = state.obstacle_force.sum(axis=0) + state.held_force.sum(axis=0)
        assert np.abs(balance).max() < 3e-6 * np.abs(state.obstacle_force).max()
        assert state.obstacle_force[0, 2] < 0.0


def test_a_turned_scene_gives_the_turned_answer():
    """To the Newton tolerance: the unknowns come in another order, so round-off differs."""
    mesh = ball_octant(4)
    held = [PrescribedDisplacement(lambda x: np.abs(x[2]) < 1e-9), *symmetry()[:2]]
    probe = RigidSphere((0.0, 0.0, 1.5), 0.5, lambda t: (0.0, 0.0, -t))
    straight = equilibrium_path(Problem(mesh, NeoHookean(1.0, 1000.0), held, [probe]), (0.1,))[0]
    turn = np.array([[0.0, 0.0, 1.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]])
    turned_mesh = type(mesh)(turn @ mesh.doflocs, mesh.t)
    turned_held = [PrescribedDisplacement(lambda x: np.abs(x[0]) < 1e-9), *symmetry()[1:]]
    turned_probe = RigidSphere(tuple(turn @ (0.0, 0.0, 1.5)), 0.5, lambda t: turn @ (0.0, 0.0, -t))
    turned = equilibrium_path(Problem(turned_mesh, NeoHookean(1.0, 1000.0), turned_held, [turned_probe]), (0.1,))[0]
    np.testing.assert_allclose(turned.u, straight.u @ turn.T, atol=1e-6)
    np.testing.assert_allclose(turned.obstacle_force, straight.obstacle_force @ turn.T, atol=1e-5)


TISSUE = NeoHookean(1.0, 1000.0)
BOTTOM = PrescribedDisplacement(lambda x: x[2] < 1e-9)


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


def changed(mesh, points=None, t=None):
    """The mesh with other points (3, n) or elements."""
    return MeshTet(mesh.p if points is None else points, mesh.t if t is None else t)


def nan_mesh():
    mesh = block()
    mesh.p[1, 4] = np.nan
    return mesh


def inside_out():
    mesh = block((2, 2, 2))
    mesh.p[:, np.all(np.abs(mesh.p - 0.5) < 1e-9, axis=0)] = 1.4
    return mesh


CORNER = np.full((3, 1), -1.0)
FLAT = np.array([[0.0, 1, 0, 0, 1], [0, 0, 1, 0, 1], [0, 0, 0, 1, 1e-14]]), np.array([[0, 1, 2, 3], [1, 2, 0, 4]]).T
FOLDED = curve(block(), lambda x: x - np.array([[0.0], [0.0], [0.6]]), lambda x: x[2] > 1 - 1e-9)
GOOD = Problem(block(), TISSUE, [BOTTOM])


def down(c):
    return PrescribedDisplacement(lambda x: x[2] < 1e-9, c)


REFUSALS = {
    "node 4": {"mesh": nan_mesh()},
    "vertex 0 belongs to no tetrahedron": {"mesh": changed(block(), np.hstack((CORNER, block().p)), block().t + 1)},
    f"vertex {block().p.shape[1]} belongs to no": {"mesh": changed(block(), np.hstack((block().p, CORNER)))},
    "overlap across": {"mesh": inside_out()},
    "inverted or flat|overlap": {"mesh": MeshTet(*FLAT)},
    "inverted or flat": {"mesh": FOLDED},
    r"slide along \(1, 0, 0\) and slide along \(0, 1, 0\) and slide along \(0, 0, 1\) and turn about": {"held": []},
    r"slide along .* and slide along .* and turn about \(0, 0, 1\)": {"held": [down((2,))]},
    r"free to turn about \(0, 0, 1\):": {"held": [PrescribedDisplacement(lambda x: (x[0] < 1e-9) & (x[1] < 1e-9))]},
    "contains no boundary node": {"held": [BOTTOM, PrescribedDisplacement(lambda x: x[0] > 7.0)]},
    "components": {"held": [BOTTOM, down((3,))]},
    "three finite numbers": {"held": [PrescribedDisplacement(lambda x: x[2] < 1e-9, motion=lambda t: (np.nan, 0, 0))]},
    "prescribes": {"held": [BOTTOM, PrescribedDisplacement(lambda x: x[0] < 1e-9, motion=lambda t: (0, 0, 0.1 * t))]},
    r"obstacle 0 starts 0.1 m inside the body \(limit 0.00173 m\)": {
        "obstacles": [RigidPlane((0, 0, 0.9), (0, 0, -1))]
    },
    "inside the body": {"obstacles": [RigidSphere((0.5, 0.5, 1.2), 0.5)]},
    "starts 0.195 m inside": {"obstacles": [RigidCapsule((0.0, 0.0, 1.1), (1.0, 1.0, 1.1), 0.3)]},
    r"normal is \(0, 0, 0\)": {"obstacles": [RigidPlane((0, 0, 2), (0.0, 0.0, 0.0))]},
    "radius": {"obstacles": [RigidSphere((0.0, 0.0, 9.0), -1.0)]},
    "three finite numbers ": {"obstacles": [RigidSphere((0.0, 9.0), 1.0)]},
    "motion of obstacle 0": {"obstacles": [RigidPlane((0, 0, 2), (0, 0, -1), lambda t: (0.0, 0.0, np.inf))]},
    "starts and ends at": {"obstacles": [RigidCapsule((0.0, 0.0, 2.0), (0.0, 0.0, 2.0), 0.1)]},
    "capsule's radius is 0.0 m": {"obstacles": [RigidCapsule((0.0, 0.0, 2.0), (0.0, 1.0, 2.0), 0.0)]},
    "slip 'sticky'": {"obstacles": [RigidPlane((0, 0, 2), (0, 0, -1), slip="sticky")]},
    "density is 0": {"gravity": (0, 0, -9.81)},
    "the density is -1": {"density": -1.0},
    "gravity is": {"gravity": (0, np.nan, 0)},
    "quadrature order is 2: 4 is the least": {"order": 2},
    "contact_order is 2: 4 is the least": {"contact_order": 2},
}


@pytest.mark.parametrize("words", REFUSALS)
def test_what_cannot_be_solved_is_refused_in_one_sentence(words):
    with pytest.raises(SolveError, match=words.strip()) as caught:
        equilibrium_path(replace(GOOD, **REFUSALS[words]), (1.0,))
    assert "\n" not in str(caught.value) and len(str(caught.value)) > 40


@pytest.mark.parametrize("times", [(), (2.0, 1.0), (-1.0,), (np.nan,)])
def test_bad_times(times):
    with pytest.raises(SolveError, match="times"):
        equilibrium_path(GOOD, times)


def test_three_symmetry_planes_hold_a_body():
    assert equilibrium_path(Problem(block(), TISSUE, symmetry()), [0.0])[0].energy == 0.0


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


@pytest.mark.parametrize(
    ("settings", "words", "other"),
    [
        ({"force_tol": 1e-30}, r"force error \S+ \(bound 1e-30\)", "volume error"),
        ({"volume_tol": 1e-30}, r"volume error \S+ \(bound 1e-30\)", "force error"),
        ({"penetration_tol": 1e-30}, r"contact \S+ mm from where it acts \(bound \S+ mm\)", "volume error"),
    ],
)
def test_a_step_that_fails_names_the_test_that_it_failed(settings, words, other):
    plane = RigidPlane((0.0, 0.0, 1.0), (0.0, 0.0, -1.0), lambda t: (0.0, 0.0, -t))
    problem = Problem(ball_octant(3), NeoHookean(1.0, 1000.0), symmetry(), obstacles=[plane])
    with pytest.raises(SolveError, match=words) as failure:
        equilibrium_path(problem, [0.05], NewtonSettings(smallest_step=1.0, **settings))
    assert other not in str(failure.value)
