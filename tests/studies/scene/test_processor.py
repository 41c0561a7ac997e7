"""Where a probe starts is written as numbers: they are those of the surface, and the key of the published reference."""

import numpy as np
import pytest

from studies.geometry import SHAPES
from studies.geometry.shape.levelset import normals
from studies.reference.published import published
from studies.scene.library import KIDNEY_PROBE, LIVER_PROBE, STOMACH_PROBE

PROBES = pytest.mark.parametrize("scene", [LIVER_PROBE, KIDNEY_PROBE, STOMACH_PROBE], ids=lambda scene: scene.name)


@PROBES
def test_a_probe_starts_half_a_millimetre_from_the_surface(scene):
    shape, probe = SHAPES[scene.organ.shape](), scene.obstacles[0]
    outward = -np.asarray(scene.probed.direction)
    point = np.asarray(probe.centre) - (probe.radius + 0.0005) * outward
    assert shape.level(point[None])[0] == pytest.approx(0.0, abs=1e-12)
    assert outward == pytest.approx(normals(shape, point[None])[0], abs=1e-9)


@PROBES
def test_its_reference_is_published(scene):
    assert published(scene) is not None
