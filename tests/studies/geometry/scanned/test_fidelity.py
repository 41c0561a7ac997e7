"""What a mesh of a scan lost: distances, place and volume of surfaces whose distances are known."""

import numpy as np
import pytest

from studies.geometry.scanned.fidelity import NOTABLE, fidelity, warnings_of
from tests.studies.geometry.boxes import box, split, together

BALL, FACES = split(*box((-1, -1, -1), (1, 1, 1)), times=4)
BALL = 0.05 * BALL / np.linalg.norm(BALL, axis=1, keepdims=True)


def test_distances_and_volumes_of_two_balls():
    losses = fidelity((BALL, FACES), (1.02 * BALL, FACES))
    for way in ("file_to_mesh", "mesh_to_file"):
        # 1 mm apart, less what the facets sag.
        for kind in ("mean", "p95", "max"):
            assert losses[way][kind] == pytest.approx(0.001, rel=0.03), (way, kind)
    assert losses["volume_mesh"] / losses["volume_file"] == pytest.approx(1.02**3, rel=1e-12)
    assert losses["handles"] == 0 and losses["diagonal"] == pytest.approx(0.1 * np.sqrt(3), rel=0.01)
    assert [text for text in warnings_of(losses) if "volume" in text]  # 6 % more, and nowhere far
    assert not [text for text in warnings_of(losses) if "up to" in text]


def test_a_warning_names_what_is_missing_and_its_place():
    speck = box((0.08, 0.0, 0.0), (0.082, 0.002, 0.002))
    losses = fidelity(together((BALL, FACES), speck), (BALL, FACES))
    far = losses["file_to_mesh"]
    assert far["max"] == pytest.approx(0.032, rel=0.01) and far["where"] == pytest.approx(
        [0.082, 0.002, 0.002], abs=1e-4
    )
    # Weighted by area the speck counts for nothing.
    assert far["p95"] < 1e-6 and far["mean"] < 1e-4 and losses["mesh_to_file"]["max"] < 1e-9
    (warning,) = warnings_of(losses)
    assert "up to 32.1 mm off" in warning and "(82, 2, 2) mm: this part of the file is missing" in warning


def test_no_warning_where_nothing_is_lost():
    assert warnings_of(fidelity((BALL, FACES), ((1 + NOTABLE / 10) * BALL, FACES))) == []
