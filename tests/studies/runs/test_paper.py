"""The paper's scenes on small bodies: the slide is stored, read back and played, with true positions."""

import json

import numpy as np
import pytest

from massspring import Free
from massspring.body.inside import is_inside
from studies.plots.figures import paper_ball, paper_slide
from studies.runs.case import case_from_json
from studies.runs.paper import ball_case, moments, play, slide_case, tip_of
from studies.scene.as_json import scene_from_dict, scene_to_json
from studies.scene.library import JUDGED, SCENES, STOMACH_SLIDE
from studies.scene.library.stomach_slide import NODES

SMALL = 300


@pytest.fixture(scope="module")
def slide(mesh_cache):
    return play(slide_case(SMALL))


@pytest.fixture(scope="module")
def balls(mesh_cache):
    return {name: play(ball_case(method, 150)) for name, method in (("free", Free()), ("implicit_volume", kept()))}


def kept():
    return slide_case(SMALL).method


@pytest.mark.campaign
def test_the_slide_is_stored_and_read_back(slide):
    assert scene_from_dict(json.loads(scene_to_json(STOMACH_SLIDE))) == STOMACH_SLIDE
    assert case_from_json(slide.case.key) == slide.case
    assert STOMACH_SLIDE in SCENES and STOMACH_SLIDE not in JUDGED
    assert 2 * NODES - 4 == 38_996  # triangles of a closed surface: the paper's 39,000, rounded


@pytest.mark.campaign
def test_the_probe_stays_outside_and_presses_while_it_slides(slide):
    """The tip of every frame lies outside the surface of that frame; the volume is kept all the way."""
    triangles = slide.prepared.setup.body.triangles
    for frame, x in enumerate(slide.history.snapshots):
        assert not is_inside(tip_of(slide, frame), x, triangles)
    at = moments(slide)
    assert at["first contact"] < at["deep"] < at["end of the slide"]
    assert slide.force[at["deep"]] > 10 * slide.force[at["first contact"]] > 0
    assert slide.force[at["deep"] : at["end of the slide"]].min() > 0
    assert np.abs(slide.history.volume / slide.history.volume_target - 1).max() < 1e-4


def test_the_shaft_ends_at_the_tip():
    tip = np.array([0.01, 0.02, 0.03])
    corners, normals = paper_slide.rod(tip)
    assert np.linalg.norm(corners.reshape(-1, 3) - tip, axis=1).min() < 1e-12
    outward = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    assert ((outward * normals).sum(axis=1) >= -1e-15).all()


def test_the_curves_are_the_volumes(balls, tmp_path):
    figure = paper_ball.volume_figure(balls)
    for line, played in zip(figure.axes[0].lines, balls.values(), strict=True):
        ratio = played.history.volume[:, 0] / played.history.volume_target[:, 0]
        assert np.array_equal(line.get_ydata(), 100 * (ratio - 1))
        assert len(ratio) == 800
    assert paper_ball.change(balls["free"])[-1] < -5 < -1e-2 < paper_ball.change(balls["implicit_volume"])[-1]
    paper_ball.draw(balls, tmp_path / "a.png", tmp_path / "b.png")
    assert (tmp_path / "a.png").stat().st_size > 2000 and (tmp_path / "b.png").stat().st_size > 2000
