"""Meshes shared by the geometry tests, made from nothing in every run."""

from collections.abc import Iterator

import pytest

from studies.geometry import HalfSpace, ball, liver
from studies.geometry.mesher.shipped import OWN

RADIUS = 0.05
CAP = 0.035
"""Height [m] of the planes that cut the held caps off the ball."""
CAPS = {
    "top": HalfSpace((0.0, 0.0, CAP), (0.0, 0.0, -1.0)),
    "bottom": HalfSpace((0.0, 0.0, -CAP), (0.0, 0.0, 1.0)),
}
COUNTS = (150, 300, 550)


@pytest.fixture(autouse=True)
def own_meshes() -> Iterator[None]:
    """These tests are of the code that makes meshes: none is a shipped one."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv(OWN, "1")
        yield


@pytest.fixture(scope="session")
def balls(mesh_cache):
    """Balls with two caps by node count."""
    return {nodes: ball(nodes, RADIUS, CAPS) for nodes in COUNTS}


@pytest.fixture(scope="session")
def livers(mesh_cache):
    """Livers with their bare area by node count, made."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv(OWN, "1")
        return {nodes: liver(nodes) for nodes in COUNTS}


@pytest.fixture(scope="session")
def bodies(balls, livers):
    """All of them by name and node count."""
    return {"ball": balls, "liver": livers}
