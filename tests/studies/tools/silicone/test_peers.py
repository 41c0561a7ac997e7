"""Other programs get the beam with what hangs at its tip, or refuse it with a sentence."""

import numpy as np
import pytest

from studies.base.errors import StudyError
from studies.exchange.peers.contest import PEERS
from studies.exchange.peers.scene_folder import CannotDo, SceneFolder
from studies.plots.silicone import Point, figure
from studies.tools.silicone.beam import DENSITY, LENGTH, SIDE, Beam
from studies.tools.silicone.main import bars
from studies.tools.silicone.measured import GRAVITY, LOADS
from studies.tools.silicone.peers import FRAME, main, peer_row, with_row, write_beam
from studies.tools.silicone.table import read_table, write_table

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
    table = tmp_path / "silicone" / "silicone.csv"
    table.write_text("who\n")
    with pytest.raises(StudyError, match="is no table of the silicone beam"):
        main(tmp_path, youngs=YOUNGS, only="sofa")
    write_table(table, [Point("measured", 0.0, 6.5, 7.7, 0.05)])
    with pytest.raises(StudyError, match="unknown program"):
        main(tmp_path, youngs=YOUNGS, only="sofia")
    with pytest.raises(StudyError, match="no program released the beam"):
        main(tmp_path, youngs=YOUNGS, only="sofa")
    assert "sofa: no wheel on PyPI" in capsys.readouterr().err


def test_a_program_that_runs_again_replaces_its_rows(tmp_path):
    old = [Point("measured", 0.0, 6.5, 7.7, 0.05), Point("mujoco", 0.0, 1.0, 2.0, 0.3), Point("mujoco", 0.5, 3, 4, 0.5)]
    write_table(tmp_path / "silicone.csv", with_row(old, Point("mujoco", 0.0, 6.7, 7.4, 0.06)))
    rows = read_table(tmp_path / "silicone.csv")
    assert rows == [old[0], old[2], Point("mujoco", 0.0, 6.7, 7.4, 0.06)]


def test_every_program_has_a_look_of_its_own():
    """Ten of ours and of others: the chart shows them all."""
    rows = [Point(f"program {number}", load.newton, 6.5, 7.7, 0.05) for number in range(9) for load in LOADS]
    lines = figure(rows, bars()).axes[0].lines
    assert sum(np.size(line.get_xdata()) == len(LOADS) for line in lines) == 9
    assert len({(line.get_color(), line.get_marker()) for line in lines if np.size(line.get_xdata()) == 3}) == 9
