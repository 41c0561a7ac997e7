"""A scene is its numbers: they, and so the reference of a scene, must not depend on the processor."""

import json
import os
import subprocess
import sys

import numpy as np
import pytest
from numpy._core._multiarray_umath import __cpu_dispatch__  # pyright: ignore[reportAttributeAccessIssue]

from studies.catalog import STUDIES
from studies.geometry import SHAPES
from studies.geometry.shape.levelset import normals
from studies.reference.published import published
from studies.scene.library import KIDNEY_PROBE, LIVER_PROBE, STOMACH_PROBE

OLDEST = {
    "NUMBA_CPU_NAME": "generic",
    "NUMBA_CPU_FEATURES": "",
    "NUMBA_DISABLE_INTEL_SVML": "1",
    "NPY_DISABLE_CPU_FEATURES": " ".join(__cpu_dispatch__),
    "MKL_CBWR": "COMPATIBLE",
    "OPENBLAS_CORETYPE": "Nehalem",
    "GLIBC_TUNABLES": "glibc.cpu.hwcaps=-AVX2,-FMA,-FMA4,-AVX512F",
}
"""Variables with which libraries use the instructions of every x86-64 processor since 2009 alone."""
KEYS = """
import json
from tests.studies.scene.test_processor import keys
print(json.dumps(keys()))
"""


def keys():
    """The keys of all cases of the catalogue."""
    return {f"{study.name}: {case.name}": case.key for study in STUDIES for case in study.cases}


def test_the_oldest_processor_has_the_same_scenes():
    done = subprocess.run(
        [sys.executable, "-c", KEYS], env=os.environ | OLDEST, capture_output=True, text=True, check=True
    )
    other, here = json.loads(done.stdout), keys()
    assert [name for name in here if here[name] != other[name]] == [] and len(here) == len(other)


@pytest.mark.parametrize("scene", [LIVER_PROBE, KIDNEY_PROBE, STOMACH_PROBE], ids=lambda scene: scene.name)
def test_a_probe_starts_half_a_millimetre_from_the_surface(scene):
    shape, probe = SHAPES[scene.organ.shape](), scene.obstacles[0]
    outward = -np.asarray(scene.probed.direction)
    point = np.asarray(probe.centre) - (probe.radius + 0.0005) * outward
    assert shape.level(point[None])[0] == pytest.approx(0.0, abs=1e-12)
    assert outward == pytest.approx(normals(shape, point[None])[0], abs=1e-9)


@pytest.mark.parametrize("scene", [LIVER_PROBE, KIDNEY_PROBE, STOMACH_PROBE], ids=lambda scene: scene.name)
def test_its_reference_is_published(scene):
    assert published(scene) is not None
