"""Other programs get the beam with what hangs at its tip, or refuse it with a sentence."""

import numpy as np
import pytest

from studies.base.errors import StudyError
from studies.exchange.peers.contest import PEERS
from studies.exchange.peers.scene_folder import CannotDo, SceneFolder
from studies.tools.silicone.beam import DENSITY, LENGTH, SIDE, Beam
from studies.tools.silicone.measured import GRAVITY, LOADS
from studies.tools.silicone.peers import FRAME, main, peer_row, write_beam

YOUNGS = 264_000.0


@pytest.fixture(params=LOADS, ids=lambda load: load.name)
def given(request, tmp_path):
    write_beam(tmp_path / "beam", Beam(3, 6), YOUNGS, request.param, 5.0, 0.3)
    return request.param, SceneFolder(tmp_path / "beam")


def test_a_program_gets_the_beam_that_we_compute(given):
    load, scene = given
    x, hung = scene.points, scene.hung
    assert hung.sum() * GRAVITY == pytest.approx(load.newton, abs=1e-9)
    assert np.allclose(x[hung > 0][:, [0, 2]], [0.0, SIDE]) and np.count_nonzero(hung) == (4 if load.newton else 0)
    assert np.allclose(x[scene.held][:, 0], -LENGTH) and len(scene.held) == 16
    corners = x[scene.cells]
    volumes = np.linalg.det(corners[:, 1:] - corners[:, :1]) / 6.0
    assert volumes.min() > 0.0 and volumes.sum() == pytest.approx(LENGTH * SIDE**2)
    assert (scene.density, scene.mu) == (DENSITY, pytest.approx(YOUNGS / 2.998))
    assert scene.times == pytest.approx(FRAME * np.arange(31)) and scene.data["gravity"] == [0.0, 0.0, -GRAVITY]


def test_a_program_without_masses_at_nodes_refuses_a_loaded_beam(given):
    load, scene = given
    scene.check_simple(masses=True)
    if load.newton == 0.0:
        scene.check_simple()
        return
    with pytest.raises(CannotDo, match="hangs no masses at nodes"):
        scene.check_simple()


def test_a_program_without_an_adapter_says_why(tmp_path):
    sofa = next(peer for peer in PEERS if peer.name == "sofa")
    with pytest.raises(StudyError, match="sofa: no wheel on PyPI"):
        peer_row(sofa, LOADS[0], YOUNGS, tmp_path, tmp_path)


def test_what_writes_no_row_is_an_error(tmp_path, capsys):
    with pytest.raises(StudyError, match=r"no table .*silicone.csv to add rows to"):
        main(tmp_path, youngs=YOUNGS)
    (tmp_path / "silicone").mkdir()
    (tmp_path / "silicone" / "silicone.csv").write_text("who\n")
    with pytest.raises(StudyError, match="unknown program"):
        main(tmp_path, youngs=YOUNGS, only="sofia")
    with pytest.raises(StudyError, match="no program released the beam"):
        main(tmp_path, youngs=YOUNGS, only="sofa")
    assert "sofa: no wheel on PyPI" in capsys.readouterr().err
