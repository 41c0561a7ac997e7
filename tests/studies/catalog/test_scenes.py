"""Every scene is read back as it was stored, loads both solvers alike, and moves its body."""

import json
from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from massspring import METHODS, simulate
from studies.base.errors import StudyError
from studies.runs.case import Case
from studies.runs.prepare import prepare
from studies.runs.recipes import BODIES
from studies.runs.run import checkpoint_frames
from studies.scene.as_json import scene_from_dict, scene_to_json
from studies.scene.kind import has_wall
from studies.scene.library import JUDGED, SCENES
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
