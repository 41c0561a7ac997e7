"""The load of every scene is the one that its title says."""

import re
from pathlib import Path

import numpy as np
import pytest

from studies.scene.library import BALL_CLAMPED, BALL_SQUEEZE, BLADDER_FILL, SCENES, STOMACH_SLIDE
from studies.scene.library.ball_squeeze import RADIUS

ROOT = Path(__file__).parents[3]


def travel(scene, leg=1) -> float:
    """How far obstacles and held regions are moved on one leg of their paths, all of them together [m]."""
    paths = [body.path for body in (*scene.obstacles, *scene.held) if len(body.path.times) > leg]
    legs = [np.subtract(path.displacements[leg], path.displacements[leg - 1]) for path in paths]
    return float(sum(np.linalg.norm(step) for step in legs))


PRESSED = re.compile(r"(?:pressed|pushed in by) (\d+) mm")


@pytest.mark.parametrize("scene", [s for s in SCENES if PRESSED.search(s.title)], ids=lambda s: s.name)
def test_a_press_is_as_deep_as_the_title_says(scene):
    """The way begins outside the organ, up to 2 mm from it; a probe has the radius of the title."""
    (depth,) = PRESSED.findall(scene.title)
    assert 0 <= travel(scene) - 1e-3 * float(depth) <= 2e-3
    for radius in re.findall(r"spherical probe of (\d+) mm radius", scene.title):
        assert [o.radius for o in scene.obstacles if hasattr(o, "centre")] == [pytest.approx(1e-3 * float(radius))]


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
