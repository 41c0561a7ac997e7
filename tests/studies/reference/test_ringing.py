"""Scenes in motion: both solvers start alike, the reference rings at the continuum's frequency; rest builds no mass."""

from dataclasses import replace

import numpy as np
import pytest

from reference_fem.dynamics import inertia
from reference_fem.uncertainty import combined
from studies.base.errors import StudyError
from studies.metrics.metrics import METRICS, frequency_error
from studies.metrics.run import Run
from studies.reference.load import load_reference
from studies.reference.reference_solves import ReferenceSolve
from studies.reference.ringing import fitted_frequency
from studies.reference.solve import solve
from studies.runs.case import Case
from studies.runs.recipes import TetrahedralBody
from studies.runs.run import measure
from studies.scene.library.ball_ringing import BALL_RINGING, RADIUS
from studies.scene.library.ball_squeeze import BALL_SQUEEZE
from studies.scene.quantities import allowed
from studies.scene.scene import Lumen, ReferencePlan
from studies.scene.start import InitialConditions
from studies.store.record import Status

LAMB = 2.6656
"""Angular frequency over √(mu/rho)/R of the spheroidal mode n = 2 of an incompressible ball (Lamb 1882)."""
SCENE = replace(BALL_RINGING, reference=ReferencePlan("octant", (0.7, 0.5), variants=("steps",), dt=2.5e-3))
"""Two meshes of a few elements, time steps twice as long."""
TRUE = LAMB * np.sqrt(SCENE.tissue.shear_modulus / SCENE.tissue.density) / RADIUS / (2 * np.pi)


@pytest.fixture(scope="module")
def reference(mesh_cache, tmp_path_factory):
    root = tmp_path_factory.mktemp("motion")
    solve(root, ReferenceSolve(SCENE))
    return load_reference(root, SCENE)


def test_a_fading_swing_gives_its_frequency():
    t = np.linspace(0.0, 0.2, 81)
    for f, damping in ((3.3, 0.0), (11.0, 1.0), (41.0, 8.0)):
        swing = 0.02 + np.exp(-0.5 * damping * t) * (0.3 * np.cos(2 * np.pi * f * t) - np.sin(2 * np.pi * f * t))
        # the minimiser stops at the square root of round-off
        assert fitted_frequency(t, swing, damping) == pytest.approx(f, rel=1e-6)


def test_a_frequency_needs_more_than_a_few_values():
    with pytest.raises(StudyError, match="11 checkpoints; give the scene 12"):
        fitted_frequency(np.linspace(0.0, 1.0, 11), np.zeros(11), 0.0)


@pytest.mark.campaign
def test_the_reference_rings_like_the_continuum(reference):
    """Lamb's is for small swings: one of 5 % and the linear field it starts with are 0.7 % slower on fine meshes."""
    frequency = reference.meshes[0].frequency
    assert frequency == pytest.approx(TRUE, rel=0.012)
    assert frequency < TRUE


@pytest.mark.campaign
def test_the_frequency_has_an_error_bar_of_meshes_and_time_steps(reference):
    bar = reference.uncertainty["frequency"]
    assert set(bar.shares) == {"mesh", "steps"}
    assert bar.total == combined(bar.shares)
    # second order: a step of (w dt)²/12 = 0.25 % at most is left, and the bar doubles the change
    assert 1e-4 < bar.shares["steps"] < 0.01
    assert set(reference.uncertainty) == {"frequency", "volume"}  # only what the scene lets be compared


@pytest.mark.campaign
def test_the_energy_of_the_motion_is_kept(reference):
    total = reference.field("kinetic") + reference.field("energy")
    assert np.all(np.isfinite(total))
    # what the damping took, 1 - e^-ct in the mean, is in the balance too: the rest is the scheme's
    assert np.abs(reference.field("balance")).max() < 0.01 * total[0]
    faded = np.exp(-SCENE.damping * SCENE.checkpoints[-1])
    assert total[-1] / total[0] == pytest.approx(faded, abs=0.05)


@pytest.mark.campaign
def test_a_mass_spring_ball_is_judged_by_its_frequency(reference):
    case = Case(SCENE, TetrahedralBody(150, volumes="nodal"))
    record = measure(case)
    assert record.status == Status.OK
    error = frequency_error(Run(case, record, reference))
    # springs of van Gelder's law with a shear modulus some ten per cent too small: frequency with its root
    assert -15.0 < error < 5.0
    metric = next(m for m in METRICS if m.name == "frequency_error")
    assert metric.uncertainty(Run(case, record, reference)) == 100.0 * reference.total_uncertainty["frequency"]


def test_a_load_path_builds_no_mass(mesh_cache, tmp_path, monkeypatch):
    """Quasi-static scenes skip dynamics altogether."""

    def forbidden(*_):
        raise AssertionError("a mass was built")

    monkeypatch.setattr(inertia, "build_mass", forbidden)
    rest = replace(BALL_SQUEEZE, reference=ReferencePlan("octant", (0.9, 0.7), variants=()), checkpoints=(0.5,))
    solve(tmp_path, ReferenceSolve(rest))
    with pytest.raises(AssertionError, match="mass"):
        solve(tmp_path, ReferenceSolve(SCENE))


def test_what_a_reference_depends_on():
    """Damping and start with motion; the filling of a lumen always."""
    moving, still = ReferenceSolve(SCENE), ReferenceSolve(BALL_SQUEEZE)
    for changes in (
        {"damping": 7.0},
        {"start": InitialConditions(speed=((0.0, 0.0, 0.0), (0.0, 0.0, 0.0), (0.0, 0.0, 1.0)))},
    ):
        assert ReferenceSolve(replace(SCENE, **changes)).key != moving.key
        assert ReferenceSolve(replace(BALL_SQUEEZE, **changes)).key == still.key
    assert ReferenceSolve(replace(BALL_SQUEEZE, lumen=Lumen())).key != still.key
    assert ReferenceSolve(replace(BALL_SQUEEZE, frames=3, title="other")).key == still.key


def test_a_shape_to_start_from_is_refused(mesh_cache, tmp_path):
    flat = replace(SCENE, start=InitialConditions(matrix=((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 0.5))))
    with pytest.raises(StudyError, match="shape of its own"):
        solve(tmp_path, ReferenceSolve(flat))


def test_a_scene_at_rest_has_no_frequency():
    assert not allowed(BALL_SQUEEZE, "frequency")
    assert allowed(SCENE, "frequency")
    assert not allowed(SCENE, "pressure")  # it swings about zero
