"""Bodies as heavy as their scene allows: by which rule, and that what their loads end in stays."""

from dataclasses import replace
from math import pi, sqrt

import numpy as np
import pytest

from massspring import Ramp, Trajectory
from massspring.analysis.stability import slowest_frequency
from studies.runs.case import Case
from studies.runs.heavy import CALM, ENDS, ENDS_ALONE, KINK, MOST, heaviness, kink
from studies.runs.prepare import attachments_for, body_for, mesh_of, prepared_on
from studies.runs.recipes import QuadraticBody
from studies.runs.run import measure
from studies.scene.inertia import SLOW
from studies.scene.library.ball_clamped import BALL_CLAMPED
from studies.scene.library.ball_squeeze import BALL_SQUEEZE
from studies.scene.scene import Lumen
from studies.store.record import Status

SCENE = replace(BALL_CLAMPED, reference=None, checkpoints=(1.5, 4.0))
BOTTOM, TOP = SCENE.held
SAG = replace(SCENE, held=(BOTTOM,), gravity=(0.0, 0.0, -1.0), checkpoints=(4.0,), quantities=("surface",))
HEAVY, LIGHT = QuadraticBody(234, mass="heavy"), QuadraticBody(234, mass="stiffness")
RADIUS = 0.5
"""Of a ball as large as the lumen that is filled [m]."""
WAVE = sqrt(SCENE.tissue.shear_modulus / SCENE.tissue.density)


def pushed(rise: float, way: float = 0.0125) -> dict:
    """The held regions of a ball pushed down by `way` [m] over `rise` [s]."""
    path = Trajectory((0.0, rise), ((0.0, 0.0, 0.0), (0.0, 0.0, -way)))
    return {"held": (BOTTOM, replace(TOP, path=path))}


def filled(rise: float, growth: float):
    """The ball held below, with a lumen whose radius grows by that factor over `rise` [s]."""
    return replace(SCENE, held=(BOTTOM,), lumen=Lumen(filling=Ramp((0.0, rise), (1.0, growth**3))))


@pytest.fixture(scope="module")
def mesh(mesh_cache):
    return mesh_of(SCENE, LIGHT)


@pytest.mark.parametrize(
    ("limit", "scene", "root"),
    [
        ("the longest", replace(SCENE, **pushed(30.0), checkpoints=(40.0,)), lambda omega: sqrt(MOST)),
        ("shear waves", SCENE, lambda omega: SLOW * WAVE / (0.0125 / 3.0)),
        ("changes its speed", replace(SCENE, **pushed(1.0, 1e-4)), lambda omega: KINK * omega),
        ("must end", replace(SCENE, **pushed(3.5, 1e-4)), lambda omega: 0.5 * CALM * omega * 0.5 / ENDS),
        ("changes its speed", filled(2.5, 1.001), lambda omega: KINK * omega * 2.5),
        ("shear waves", filled(2.5, 1.05), lambda omega: SLOW * WAVE / (0.05 * RADIUS / 2.5)),
        ("must end", replace(SAG, checkpoints=(1.0, 4.0)), lambda omega: 0.5 * CALM * omega / ENDS_ALONE),
    ],
)
def test_a_body_is_as_heavy_as_the_slowest_of_its_limits_allows(mesh, limit, scene, root):
    """The frequency is proved in test_stability; damping at rest follows it, and while loads move the drag stays."""
    body, attachments = body_for(scene, LIGHT, mesh), attachments_for(scene, mesh)
    omega = slowest_frequency(body, np.concatenate([held.nodes for held in attachments]))
    found = heaviness(scene, body, attachments, 4.0 / 3.0 * pi * RADIUS**3)
    assert limit in found.limit and found.factor == pytest.approx(root(omega) ** 2, rel=1e-9) and found.factor > 1.5
    assert found.damping * found.factor == pytest.approx(scene.damping, rel=1e-12) and found.at_rest is not None
    assert found.at_rest[1] == pytest.approx(CALM * omega / root(omega), rel=1e-9)
    heavy = found.of(body)
    assert np.array_equal(heavy.mass, body.mass) and np.allclose(heavy.moved_mass, found.factor * body.moved_mass)


@pytest.mark.parametrize(
    ("times", "heights", "gap", "rate"),
    [
        ((0.0, 2.0), (0.0, 1.0), 0.0, 0.5),
        ((0.0, 2.0), (5.0, 6.0), 0.5, 1.0),
        ((0.0, 2.0), (0.0, 1.0), 1.0, 0.0),
        ((0.0, 1.0, 2.0, 3.0), (0.0, 1.0, 1.0, 4.0), 0.0, 0.75),
        ((0.0, 1.0, 2.0), (0.0, 1.0, 4.0), 0.0, 0.75),
        ((0.0,), (1.0,), 0.0, 0.0),
    ],
)
def test_a_kink_is_a_change_of_speed_over_the_way(times, heights, gap, rate):
    assert kink(Trajectory(times, tuple((0.0, 0.0, z) for z in heights)), gap) == pytest.approx(rate)


def force(record) -> np.ndarray:
    return record.fields["held_force"].values[:, 1, 2]


@pytest.mark.slow
def test_a_heavy_body_ends_where_a_light_one_does_in_fewer_steps(mesh):
    """Within a tenth of the targets of 3 and 1 % at the end, within half of that of the force on the way."""
    heavy, light = (measure(Case(SCENE, body, dt_fraction=0.8)) for body in (HEAVY, LIGHT))
    assert heavy.status == light.status == Status.OK
    about, (end, way) = heavy.attributes, (force(light)[-1], slice(74, 150))
    assert about["heaviness"] == pytest.approx((SLOW * WAVE / (0.0125 / 3.0)) ** 2, rel=1e-6)
    assert about["damping_moving"] == pytest.approx(15.0 / about["heaviness"]) and about["damping_at_rest"] > 5.0
    limit = prepared_on(Case(SCENE, HEAVY, dt_fraction=0.8), mesh).limit
    assert limit.damping == max(about["damping_moving"], about["damping_at_rest"])
    fewer = [record.fields["frame_steps"].values.sum() for record in (light, heavy)]
    assert fewer[0] > 2.0 * fewer[1]
    change = np.abs(force(heavy) - force(light)) / abs(end)
    assert change[-1] < 3e-3 and change[way].max() < 1.5e-2
    moved = heavy.fields["snapshots"].values[-1] - light.fields["snapshots"].values[-1]
    assert np.linalg.norm(moved, axis=1).mean() < 1e-3 * 0.0125
    assert "too slow, by masses" in str(about["warnings"])


@pytest.mark.slow
def test_the_weight_of_a_heavy_body_is_that_of_its_tissue(mesh):
    heavy, light = (measure(Case(SAG, body, dt_fraction=0.8)) for body in (HEAVY, LIGHT))
    ends = [record.fields["snapshots"].values[-1] - record.fields["rest"].values for record in (heavy, light)]
    assert heavy.attributes["heaviness"] > 4.0
    assert np.abs(ends[0] - ends[1]).max() < 1e-3 * np.abs(ends[1]).max()


def test_a_body_that_may_not_be_heavier_is_the_light_one_and_says_why(mesh_cache):
    heavy, light = (measure(Case(BALL_SQUEEZE, body, dt_fraction=0.8, frames=5)) for body in (HEAVY, LIGHT))
    assert heavy.attributes["heaviness"] == pytest.approx(1.0)
    assert "makes the body no heavier than its tissue: nothing holds it" in str(heavy.attributes["warnings"])
    assert np.array_equal(heavy.fields["snapshots"].values, light.fields["snapshots"].values)
