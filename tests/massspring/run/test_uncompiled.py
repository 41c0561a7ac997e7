"""Small scenes without the compiler: numpy checks every index then, and the answers are those of compiled code."""

import json
import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from massspring import (
    Attachment,
    Clock,
    ImplicitSprings,
    ImplicitVolume,
    Plane,
    Probe,
    Setup,
    Sphere,
    Trajectory,
    Volumes,
    quadratic_body,
    simulate,
    surface_body,
    tetrahedral_body,
)
from massspring.kernels.probe.arrays import CARRIED
from tests.massspring.conftest import SOFT, block, icosphere
from tests.massspring.methods.test_methods import clock_for, squeeze
from tests.massspring.quadratic import quadratic_block

REPOSITORY = Path(__file__).parents[3]


def slices():
    """Nodes with and without rings and in pieces, held, between rough and smooth planes."""
    body = surface_body(*icosphere(1), SOFT)
    held = Attachment(np.flatnonzero(np.abs(body.rest[:, 0]) > 0.045))
    planes = squeeze(body, 0.01, 4 * clock_for(body, 4, 5).duration)
    rough = (Plane(planes[0].point, planes[0].normal, planes[0].path, friction=0.3), planes[1])
    return Setup(body, ImplicitVolume(), clock_for(body, 4, 5), rough, (held,), (0.0, 0.0, -9.81), damping=5.0)


def implicit():
    """Several volumes, a floor that holds and a ball that presses.

    So rough that no node is about to slip, and with few volumes, whose pressures all move something: round-off would
    decide the one, and be all there is of the other.
    """
    body = tetrahedral_body(*block((2, 2, 1)), SOFT)
    body = body.keeping(Volumes.regions(body, 4))
    floor = Plane((0, 0, float(body.rest[:, 2].min())), (0, 0, 1), friction=5.0)
    high = float(body.rest[:, 2].max())
    ball = Sphere((0.02, 0.02, high + 0.021), 0.02, Trajectory((0.0, 0.05), ((0, 0, 0), (0, 0, -0.006))))
    return Setup(body, ImplicitSprings(passes=3), Clock(0.01, 4, 1), (floor, ball), gravity=(0.0, 0.0, -9.81))


def probed():
    """A thin probe that presses beside an attached node, and then shoots through the ball: nodes are carried."""
    body = surface_body(*icosphere(1), SOFT)
    clock = clock_for(body, 4, 5)
    way = Trajectory((0.0, 0.8 * clock.duration, clock.duration), ((0, 0, 0), (0, 0, -0.004), (0, 0, -0.1)))
    probe = Probe((0.003, 0.002, 0.051), 0.0, way)
    held = Attachment(np.array([int(np.linalg.norm(body.rest - probe.tip, axis=1).argmin())]))
    return Setup(body, ImplicitVolume(), clock, (probe,), (held,), damping=5.0)


def facets():
    """A quadratic block on a rough floor, held at a corner, under a ball that presses inside its facets."""
    body = quadratic_body(*quadratic_block((1, 1, 1)), SOFT)
    clock = clock_for(body, 4, 5)
    low, high = body.rest[:, 2].min(), body.rest[:, 2].max()
    floor = Plane((0, 0, float(low)), (0, 0, 1), friction=0.4)
    way = Trajectory((0.0, clock.duration), ((0, 0, 0), (0.001, 0, -0.003)))
    middle = body.rest.mean(axis=0)
    ball = Sphere((float(middle[0]), float(middle[1]), float(high) + 0.0101), 0.01, way, friction="no_slip")
    held = Attachment(np.array([int(body.rest[:, 0].argmax())]))
    exact = ImplicitVolume(tolerance=1e-12)
    return Setup(body, exact, clock, (floor, ball), (held,), (0.0, 0.0, -9.81), damping=20.0)


SCENES = {scene.__name__: scene for scene in (slices, implicit, probed, facets)}


def answers(name) -> dict[str, object]:
    history = simulate(SCENES[name]())
    fields = {"final": history.final, "pressure": history.pressure, "contact_force": history.contact_force}
    counts = history.probe_counts.sum(axis=0).tolist()
    values = {key: np.ravel(value).tolist() for key, value in fields.items()}
    return {"outcome": history.outcome, "counts": counts, **values}


@pytest.fixture(scope="module")
def plain():
    """All of them in a process of its own, whose numba hands every kernel back as it is."""
    source = "from tests.massspring.run.test_uncompiled import *"
    code = f"{source}; print(json.dumps({{name: answers(name) for name in SCENES}}))"
    command = [sys.executable, "-c", code]
    environment = {**os.environ, "NUMBA_DISABLE_JIT": "1"}
    done = subprocess.run(command, cwd=REPOSITORY, env=environment, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr[-2000:]
    return json.loads(done.stdout.splitlines()[-1])


@pytest.mark.parametrize("name", SCENES)
def test_no_index_leaves_its_array_and_the_answer_is_the_compiled_one(name, plain):
    fast = answers(name)
    assert plain[name]["outcome"] == fast["outcome"] == "finished"
    assert plain[name]["counts"] == fast["counts"] and (fast["counts"][CARRIED] > 0) == (name == "probed")
    assert np.abs(fast["contact_force"]).max() > 0
    for key in ("final", "pressure", "contact_force"):
        # Compiled code contracts products and sums, twenty steps and an active set long; changes of the pressures over
        # points are in single precision.
        close = (1e-7 if name == "facets" else 1e-9) * np.abs(fast[key]).max()
        assert np.allclose(plain[name][key], fast[key], rtol=0, atol=close), key
