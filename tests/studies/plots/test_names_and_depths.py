"""Titles and legends say what the scene and the user say: the depth of a press, and the name of a method."""

from types import SimpleNamespace

import numpy as np
import pytest

from massspring import Free
from studies.plots.force_path import figure
from studies.plots.style.style import method_label
from studies.runs.case import Case
from studies.scene.library import LIVER_PRESS, LIVER_PROBE
from studies.scene.library.ball_squeeze import BALL_SQUEEZE
from tests.studies.plots.made_up import run


def title(scene, nodes):
    """Of the panel of a scene whose reference has these nodes (n, 3) [m]; None: no reference."""
    made = run(scene, method=Free(), with_reference=nodes is not None)
    if nodes is not None:
        before = made.reference.field
        made.reference.field = lambda name: nodes if name == "nodes" else before(name)  # type: ignore[method-assign]
    return figure([made]).axes[0].get_title()


@pytest.mark.parametrize(("scene", "deep"), [(LIVER_PRESS, 20), (LIVER_PROBE, 10)])
def test_the_depth_is_that_of_the_scene_not_the_way_of_the_press(scene, deep):
    press = scene.obstacles[0]
    start, way = press.anchor, np.array(press.path.displacements[-1])
    ahead = way / np.linalg.norm(way)
    touched = start + (getattr(press, "radius", 0.0) + np.linalg.norm(way) - deep * 1e-3) * ahead
    assert f", {deep} mm in 6 s" in title(scene, np.array([touched, touched + 0.05 * ahead]))


def test_the_first_touch_of_an_octant_may_lie_in_another_eighth():
    assert ", 2 × 15 mm in" in title(BALL_SQUEEZE, np.array([[0.0, 0.0, 0.05], [0.05, 0.0, 0.0]]))


def test_own_methods_keep_their_names_in_legends():
    assert method_label("implicit_volume") == "implicit volume" and method_label("lbfgs_nh") == "lbfgs_nh"
    made = run(LIVER_PRESS)
    own = SimpleNamespace(name="lbfgs_nh")
    case = Case(LIVER_PRESS, made.case.body, Free())
    object.__setattr__(case, "method", own)
    sheet = figure([type(made)(case, made.record, made.reference)])
    assert any("lbfgs_nh" in text.get_text() for legend in sheet.legends for text in legend.get_texts())
