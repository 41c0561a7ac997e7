"""Our own run as an entry, and the file of its scene."""

import numpy as np
import pytest

from massspring import simulate
from studies.runs.prepare import prepare
from tests.studies.exchange.handed_in import CASE, FRAMES, HandedIn
from tests.studies.octant import SCENE

TEXT = "from tests.studies.octant import SCENE\n"


@pytest.fixture(scope="session")
def ours(mesh_cache):
    """Every frame of our own run."""
    prepared = prepare(CASE)
    history = simulate(prepared.setup, range(1, FRAMES + 1))
    return HandedIn(
        np.concatenate([[0.0], history.t]),
        np.concatenate([prepared.setup.body.rest[None], history.snapshots]),
        np.concatenate([[0.0], SCENE.output_force(history.contact_force, history.held_force)]),
        np.concatenate([[0.0], history.pressure[:, 0]]),
    )


@pytest.fixture
def scene_file(tmp_path):
    path = tmp_path / "octant_scene.py"
    path.write_text(TEXT)
    return path
