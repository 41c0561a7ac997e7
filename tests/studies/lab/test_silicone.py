"""The silicone beam: how its files are read, its numbers, and the same beam in both solvers."""

from collections import Counter
from pathlib import Path

import numpy as np
import pytest

from massspring import ImplicitVolume
from studies.lab.league.adapters.scene_folder import CannotDo, SceneFolder
from studies.lab.silicone.beam import (
    DENSITY,
    LENGTH,
    MARKERS,
    SIDE,
    Beam,
    Contestant,
    hung,
    marker_sag,
    reference_rest,
    reference_swing,
)
from studies.lab.silicone.chart import figure
from studies.lab.silicone.measured import GRAVITY, LOADS, runs_of, swing_of
from studies.lab.silicone.predict import bars, fitted_damping, measured_row, read_table, write_table
from studies.lab.silicone.programs import FRAME, write_beam

pytestmark = pytest.mark.lab
FILES = Path(__file__).parents[4] / "shared" / "measured" / "silicone_beam"
YOUNGS = 272_000.0
TABLE = Path(__file__).parents[3] / "results" / "published" / "silicone" / "silicone.csv"


def released(frequency: float, damping: float, t: np.ndarray, held: float) -> np.ndarray:
    """A sag of 6 mm that a hand holds straight until `held` [s]."""
    circular = 2 * np.pi * frequency
    after = np.maximum(t - held, 0.0)
    fade = np.exp(-damping * circular / np.sqrt(1 - damping**2) * after)
    return 0.006 * (1 - fade * np.cos(circular * after))


@pytest.mark.parametrize(("frequency", "damping"), [(7.7, 0.05), (3.4, 0.06)])
def test_a_damped_cosine_is_read_back(frequency, damping):
    swing = swing_of(np.arange(500) / 100, released(frequency, damping, np.arange(500) / 100, 0.5))
    assert swing.sag == pytest.approx(0.006, rel=1e-3)
    assert swing.frequency == pytest.approx(frequency, rel=1e-4)
    assert swing.damping == pytest.approx(damping, rel=1e-2)


@pytest.mark.parametrize("load", LOADS, ids=lambda load: load.name)
def test_the_numbers_are_those_of_the_files(load):
    """The mean over the markers of what every file says, to the digits that are written down."""
    pytest.importorskip("ezc3d", reason="needs the extra silicone")
    if not FILES.is_dir():
        pytest.skip("the measured files are not part of the project")
    for run, file in enumerate(load.files):
        rows = np.array(runs_of(FILES / file))
        np.testing.assert_allclose(1e3 * rows[:, 0], load.sag[run], atol=0.006)
        assert rows[:, 1].mean() == pytest.approx(load.frequency[run], abs=6e-4)
        assert rows[:, 2].mean() == pytest.approx(load.damping[run], abs=6e-5)


def test_the_damping_fits_the_unloaded_swing():
    """c = 2 ζ ω: of a mass on a spring, exactly."""
    row = measured_row(LOADS[0])
    omega = 2 * np.pi * row.frequency / np.sqrt(1 - row.damping**2)
    assert fitted_damping() / (2 * omega) == pytest.approx(row.damping, rel=1e-12)


@pytest.mark.parametrize("height", [SIDE, SIDE / 2])
def test_what_hangs_has_its_mass_and_lies_on_its_line(height):
    points, _ = Beam(3, 4).quadratic
    where, shares = hung(points, 0.052, height)
    assert shares.sum() == pytest.approx(0.052, rel=1e-12) and (shares > 0).all()
    np.testing.assert_allclose(points[where][:, [0, 2]], np.tile([0.0, height], (len(where), 1)), atol=1e-12)
    assert shares @ points[where, 1] == pytest.approx(0.052 * SIDE / 2, rel=1e-12)


def test_markers_follow_a_rigid_motion():
    points, _ = Beam(2, 4).corners
    turn, _ = np.linalg.qr(np.random.default_rng(3).normal(size=(3, 3)))
    turn *= np.linalg.det(turn)
    sag = marker_sag(points, (points @ turn.T + [0.0, 0.0, 0.01])[None])[0]
    np.testing.assert_allclose(sag, -((MARKERS @ turn.T)[:, 2] + 0.01 - MARKERS[:, 2]), atol=1e-12)


@pytest.mark.parametrize("kind", ["quadratic", "cotangent"])
def test_bodies_weigh_what_beam_and_load_weigh(kind):
    body = Contestant("", Beam(2, 4), kind, ImplicitVolume()).body(YOUNGS, LOADS[1])
    assert body.mass.sum() == pytest.approx(DENSITY * LENGTH * SIDE**2 + 0.51012 / GRAVITY, rel=1e-12)


def test_both_solvers_let_the_same_beam_swing():
    """Sag and frequency of the quadratic body within 1 % of the reference on one mesh, with 52 g at the tip."""
    beam, load = Beam(2, 6), LOADS[1]
    t, sag = reference_swing(beam, YOUNGS, load, 5.0, 2.2, 0.01)
    truth = swing_of(t, sag.mean(axis=1))
    swing = swing_of(*_mean(Contestant("", beam, "quadratic", ImplicitVolume()).swing(YOUNGS, load, 5.0, 2.2)))
    assert swing.frequency == pytest.approx(truth.frequency, rel=0.01)
    assert swing.sag == pytest.approx(reference_rest(beam, YOUNGS, load).mean(), rel=0.01)


def _mean(swing: tuple[np.ndarray, np.ndarray]) -> tuple[np.ndarray, np.ndarray]:
    return swing[0], swing[1].mean(axis=1)


@pytest.mark.parametrize("load", LOADS, ids=lambda load: load.name)
def test_a_program_gets_the_beam_that_we_compute_and_refuses_masses_that_it_cannot_hang(load, tmp_path):
    write_beam(tmp_path, Beam(3, 6), YOUNGS, load, 5.0, 0.3)
    scene = SceneFolder(tmp_path)
    x, masses, corners = scene.points, scene.hung, scene.points[scene.cells]
    assert masses.sum() * GRAVITY == pytest.approx(load.newton, abs=1e-9)
    assert np.allclose(x[masses > 0][:, [0, 2]], [0.0, SIDE]) and np.count_nonzero(masses) == (4 if load.newton else 0)
    assert np.allclose(x[scene.held][:, 0], -LENGTH) and len(scene.held) == 16
    volumes = np.linalg.det(corners[:, 1:] - corners[:, :1]) / 6.0
    assert volumes.min() > 0.0 and volumes.sum() == pytest.approx(LENGTH * SIDE**2)
    assert (scene.density, scene.mu) == (DENSITY, pytest.approx(YOUNGS / 2.998))
    assert scene.times == pytest.approx(FRAME * np.arange(31)) and scene.data["gravity"] == [0.0, 0.0, -GRAVITY]
    scene.check_simple(masses=True)
    if load.newton:
        with pytest.raises(CannotDo, match="hangs no masses at nodes"):
            scene.check_simple()


def test_the_published_table_is_read_back_and_drawn(tmp_path):
    """Zero is what was measured; what lies outside the axes is named; every body and program has a look of its own."""
    rows = read_table(TABLE)
    write_table(tmp_path / "silicone.csv", rows)
    assert (tmp_path / "silicone.csv").read_bytes() == TABLE.read_bytes()
    sheet, loads = figure(rows, bars()), Counter(row.who for row in rows if row.who != "measured")
    names = {who for who, count in loads.items() if count == len(LOADS)}  # Drake hangs no masses
    lines = [line for line in sheet.axes[0].lines if np.size(line.get_xdata()) == len(LOADS)]
    assert len(names) > 8
    assert len({(line.get_color(), line.get_marker()) for line in lines}) == len(lines) == len(names)
    reference = [row.sag for row in rows if row.who == "reference"]
    off = np.subtract(reference, [measured_row(load).sag for load in LOADS])
    assert any(np.allclose(line.get_ydata(), off, atol=1e-4) for line in lines)
    assert any("springs, one volume, 1 N, sag +43 mm" in text.get_text() for text in sheet.texts)
