"""Every scene is read back as it was stored, loads both solvers alike, moves its body, and does what its title says."""

import json
import re
from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np
import pytest

from massspring import METHODS, simulate
from studies.base.errors import StudyError
from studies.geometry import SHAPES
from studies.geometry.shape.levelset import normals
from studies.reference.published import published
from studies.runs.case import Case
from studies.runs.prepare import prepare
from studies.runs.recipes import BODIES
from studies.runs.run import checkpoint_frames
from studies.scene.as_json import scene_from_dict, scene_to_json
from studies.scene.kind import has_wall
from studies.scene.library import (
    BALL_CLAMPED,
    BALL_SQUEEZE,
    BLADDER_FILL,
    JUDGED,
    KIDNEY_PROBE,
    LIVER_PROBE,
    SCENES,
    STOMACH_PROBE,
    STOMACH_SLIDE,
)
from studies.scene.library.ball_squeeze import RADIUS
from studies.scene.library.stress import STRESS_SCENES
from studies.scene.start import InitialConditions
from tests.studies.tiny import bodies_of

SMALL, THIN = 150, 400
"""Surface nodes of a small solid organ, and of a small hollow one: its wall folds on coarser meshes."""
KINDS = pytest.mark.parametrize(("scene", "kind"), bodies_of(SCENES))


@pytest.fixture(params=SCENES, ids=lambda scene: scene.name)
def scene(request):
    return request.param


@pytest.fixture(params=JUDGED, ids=lambda scene: scene.name)
def judged(request):
    """A scene with a reference."""
    return request.param


def small(scene, kind="tetrahedral", **changes) -> Case:
    return Case(scene, BODIES[kind](THIN if has_wall(scene) else SMALL), frames=20).replaced(**changes)


@cache
def _by_name(name, kind):
    return prepare(small(next(scene for scene in SCENES if scene.name == name), kind))


def small_setup(scene, kind="tetrahedral"):
    """The small case of a scene made ready, once for all tests, which only read it."""
    return _by_name(scene.name, kind) if scene in SCENES else prepare(small(scene, kind))


def test_it_is_a_word_a_line_and_a_clock(scene):
    assert [one.name for one in SCENES].count(scene.name) == 1 and scene.name.isidentifier()
    assert scene.title and "\n" not in scene.title
    assert (np.diff([0.0, *scene.checkpoints]) > 0).all() and scene.checkpoints[-1] <= scene.duration
    # A free body may turn: no displacement to compare.
    assert scene.held or not {"surface", "interior"} & set(scene.quantities)


def test_stored_and_read_back_it_is_the_same_scene(scene):
    assert scene_from_dict(json.loads(scene_to_json(scene))) == scene


def test_what_is_deepest_at_the_last_checkpoint_has_stopped_before(scene):
    """Otherwise the body would still ring at the last checkpoint."""
    paths = [o.path for o in scene.obstacles] + [h.path for h in scene.held]
    ramps = [scene.lumen.filling] if scene.lumen else []
    if scene.reference is not None and scene.reference.dt is not None:
        assert "frequency" in scene.quantities  # ringing is what it shows
        return
    assert max(path.times[-1] for path in paths + ramps) < scene.checkpoints[-1]


def test_a_start_is_a_linear_map_about_the_middle_and_always_the_same_throw():
    rest = np.array([[1.0, 2.0, 3.0], [3.0, 2.0, 3.0], [2.0, 2.0, 4.0]])
    assert InitialConditions().positions(rest) == pytest.approx(rest, abs=1e-15)
    flat = InitialConditions(((1, 0, 0), (0, 1, 0), (0, 0, 0))).positions(rest)
    assert (flat == [[1, 2, 3.5], [3, 2, 3.5], [2, 2, 3.5]]).all()
    thrown = InitialConditions(scatter=1.0).positions(rest)
    assert (thrown == InitialConditions(scatter=1.0).positions(rest)).all()
    # The longest side is 2: no node flies farther than 1 along any axis, and some fly.
    assert 0.1 < np.abs(thrown - rest).max() <= 1.0


@pytest.mark.parametrize("start", STRESS_SCENES, ids=lambda start: start.name)
def test_a_stress_scene_starts_where_it_says_and_is_stored(start):
    assert scene_from_dict(json.loads(scene_to_json(start))) == start
    prepared = prepare(small(start))
    body = prepared.setup.body
    assert np.array_equal(prepared.setup.start().x, start.start.positions(body.rest))
    assert np.abs(prepared.setup.start().x - body.rest).max() > 0.1 * body.size


def test_a_skipped_method_is_refused_with_the_reason(scene):
    skipping = replace(scene, not_for=(("free", "it needs a volume"),))
    with pytest.raises(StudyError, match=r"'free' does not apply .* it needs a volume"):
        prepare(small(skipping, method=METHODS[0]()))
    assert METHODS[0].name == "free"


@KINDS
def test_body_weighs_what_the_tissue_weighs(scene, kind):
    prepared = small_setup(scene, kind)
    body = prepared.setup.body
    # Sums of a few hundred terms: rounding stays far below 1e-12.
    assert body.mass.sum() == pytest.approx(scene.tissue.density * prepared.mesh.volume, rel=1e-12)
    assert body.volume == pytest.approx(prepared.mesh.volume, rel=1e-12)


@KINDS
def test_obstacles_start_outside(scene, kind):
    body = small_setup(scene, kind).setup.body
    for obstacle in scene.obstacles:
        assert obstacle.gap(body.rest, 0.0).min() >= -1e-9 * body.size


@KINDS
def test_something_is_felt(scene, kind):
    """Every obstacle reaches the body, and the probed force is a press at the deepest point, or a lumen swells."""
    case = small(scene, kind)
    prepared = small_setup(scene, kind)
    history = simulate(prepared.setup, checkpoint_frames(case, prepared))
    assert history.outcome == "finished"
    last = checkpoint_frames(case, prepared)[-1] - 1
    assert (np.linalg.norm(history.contact_force[last], axis=1) > 0).all()
    # Far above what rounding leaves of balanced forces: a thousandth of mu, times a square centimetre.
    if "force" in scene.quantities:
        assert (
            scene.output_force(history.contact_force, history.held_force)[last]
            > 1e-3 * scene.tissue.shear_modulus * 1e-4
        )
    elif scene.filled:
        assert history.pressure[last, -1] > 1e-3 * scene.tissue.shear_modulus
    else:
        weight = -scene.tissue.density * prepared.mesh.volume * np.asarray(scene.gravity)
        # What is left of the swing after four seconds of damping, with room for twenty coarse frames.
        assert history.held_force[last].sum(axis=0) == pytest.approx(weight, abs=0.01 * np.linalg.norm(weight))


ROOT = Path(__file__).parents[3]


def travel(scene, leg=1) -> float:
    """How far obstacles and held regions are moved on one leg of their paths, all of them together [m]."""
    paths = [body.path for body in (*scene.obstacles, *scene.held) if len(body.path.times) > leg]
    legs = [np.subtract(path.displacements[leg], path.displacements[leg - 1]) for path in paths]
    return float(sum(np.linalg.norm(step) for step in legs))


PRESSED = re.compile(r"(?:pressed|pushed in by) (\d+) mm")


@pytest.mark.parametrize("pressed", [s for s in SCENES if PRESSED.search(s.title)], ids=lambda s: s.name)
def test_a_press_is_as_deep_as_the_title_says(pressed):
    """The way begins outside the organ, up to 2 mm from it; a probe has the radius of the title."""
    (depth,) = PRESSED.findall(pressed.title)
    assert 0 <= travel(pressed) - 1e-3 * float(depth) <= 2e-3
    for radius in re.findall(r"spherical probe of (\d+) mm radius", pressed.title):
        assert [o.radius for o in pressed.obstacles if hasattr(o, "centre")] == [pytest.approx(1e-3 * float(radius))]


def test_the_other_loads_are_those_of_the_titles():
    assert [s.name for s in SCENES if travel(s) and not PRESSED.search(s.title)] == [
        "ball_squeeze",
        "ball_clamped",
    ]
    assert "30 % of its diameter" in BALL_SQUEEZE.title and travel(BALL_SQUEEZE) == pytest.approx(0.30 * 2 * RADIUS)
    assert "a quarter of the radius" in BALL_CLAMPED.title and travel(BALL_CLAMPED) == pytest.approx(0.25 * RADIUS)
    assert "grows by 20 %" in BLADDER_FILL.title and BLADDER_FILL.lumen is not None
    assert BLADDER_FILL.lumen.filling.values[-1] == pytest.approx(1.20)
    # Along the tangent plane at the tip, a hundredth shorter than the title (DOWN of stomach_slide.py).
    assert "25 mm along" in STOMACH_SLIDE.title and travel(STOMACH_SLIDE, 2) == pytest.approx(0.025, rel=0.02)


def test_tissue_is_as_nearly_incompressible_as_the_theory_says():
    """kappa/mu of the reference; that it reaches the solver, test_scenes.py holds."""
    (ratio,) = re.findall(r"kappa/mu = (\d+)", (ROOT / "docs/theory.md").read_text(encoding="utf-8"))
    assert {scene.tissue.bulk_over_shear for scene in SCENES} == {float(ratio)}


PROBES = pytest.mark.parametrize("probing", [LIVER_PROBE, KIDNEY_PROBE, STOMACH_PROBE], ids=lambda scene: scene.name)


@PROBES
def test_a_probe_starts_half_a_millimetre_from_the_surface(probing):
    shape, probe = SHAPES[probing.organ.shape](), probing.obstacles[0]
    outward = -np.asarray(probing.probed.direction)
    point = np.asarray(probe.centre) - (probe.radius + 0.0005) * outward
    assert shape.level(point[None])[0] == pytest.approx(0.0, abs=1e-12)
    assert outward == pytest.approx(normals(shape, point[None])[0], abs=1e-9)


@PROBES
def test_its_reference_is_published(probing):
    assert published(probing) is not None
