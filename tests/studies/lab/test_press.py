"""The press of silicone cylinders: closed forms, known numbers found again, and the published tables made again."""

import sys
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from skfem import (
    Basis,
    BilinearForm,
    ElementTriP1,
    ElementTriP2,
    ElementVector,
    MeshTri,
    asm,
    bmat,
    condense,
    solve,
)

from massspring import Material, quadratic_body
from studies import StudyError
from studies.lab.league.adapters.scene_folder import SceneFolder, hand_in
from studies.lab.league.programs import Program, Surroundings
from studies.lab.silicone import __main__ as command
from studies.lab.silicone import press, programs
from studies.lab.silicone.cylinder import (
    HEIGHT,
    MODULUS,
    MOONEY,
    RADIUS,
    Contestant,
    body_curve,
    reference_curves,
    sliding,
    whole,
)

pytestmark = pytest.mark.lab
PUBLISHED = Path(__file__).parents[3] / "results" / "published" / "silicone"
CURVES = PUBLISHED / "press_curves.csv"


def test_between_sliding_plates_the_forces_are_closed_forms():
    """F/(mu A) = (λ⁻² − λ) (1 − b + b/λ) of Mooney and Rivlin, (λ⁻² − λ) (1 + 2 b (λ² + 2/λ − 3)) of Yeoh."""
    at = 0.03 * np.arange(1, 15)
    force, mooney, yeoh = reference_curves((2, 2), at, "frictionless")
    stretch, begun = 1.0 - at, at > 0.1
    np.testing.assert_allclose(force, 1.0, atol=2e-3)
    np.testing.assert_allclose(mooney[begun], (1.0 / stretch - 1.0)[begun], rtol=0.01)
    np.testing.assert_allclose(yeoh[begun], 2.0 * (stretch**2 + 2.0 / stretch - 3.0)[begun], rtol=0.02)
    body = body_curve(Contestant("", (2, 2), 0.0), np.append(at, 0.54))
    np.testing.assert_allclose(body[:-1][begun], 1.0, atol=0.015)
    assert np.isnan(body[-1])  # folded


def test_sticking_plates_at_small_strain_are_those_of_linear_elasticity():
    """Of an incompressible quarter section with u = 0 across at the plate: P2/P1 in r and z."""
    mesh = MeshTri.init_tensor(*(edge * (1.0 - np.linspace(1.0, 0.0, 25) ** 2) for edge in (RADIUS, 0.5 * HEIGHT)))
    moves, presses = Basis(mesh, ElementVector(ElementTriP2()), intorder=5), Basis(mesh, ElementTriP1(), intorder=5)
    hoop = lambda u, w: u[0] / w.x[0]  # noqa: E731
    spread = lambda u, w: u.grad[0, 0] + u.grad[1, 1] + hoop(u, w)  # noqa: E731

    @BilinearForm
    def shear(u, v, w):
        e, f = ((x.grad + np.swapaxes(x.grad, 0, 1)) / 2.0 for x in (u, v))
        return 2.0 * ((e * f).sum(axis=(0, 1)) + hoop(u, w) * hoop(v, w)) * w.x[0]

    K = asm(shear, moves)
    B = asm(BilinearForm(lambda u, q, w: spread(u, w) * q * w.x[0]), moves, presses)
    r, z = moves.doflocs
    top, axis, middle = z > 0.5 * HEIGHT - 1e-9, r < 1e-9, z < 1e-9
    across = np.zeros(moves.N, dtype=bool)
    across[np.concatenate([moves.nodal_dofs[0], moves.facet_dofs[0]])] = True
    held = np.flatnonzero(np.where(across, top | axis, top | middle))
    x = np.zeros(moves.N + presses.N)
    x[: -presses.N][~across & top] = -0.5 * HEIGHT
    x = solve(*condense(bmat([[K, -B.T], [-B, None]], "csr"), np.zeros(len(x)), x=x, D=held))
    energy = 0.5 * x[: moves.N] @ (K @ x[: moves.N])
    exact = 2.0 * energy / (3.0 * RADIUS**2 / 2.0 * 0.5 * HEIGHT)
    assert pytest.approx(exact, rel=0.05) == 1.0 + 2.0 * (RADIUS / (2.0 * HEIGHT)) ** 2  # Gent and Lindley 1959
    assert reference_curves((5, 4), np.array([0.005, 0.01]))[0] == pytest.approx(exact, rel=0.01)


def test_the_body_is_round():
    points, nodes = whole((2, 2))
    assert quadratic_body(points, nodes, Material(1.0, 1.0)).mass.sum() == pytest.approx(
        np.pi * RADIUS**2 * HEIGHT, rel=2e-3
    )
    assert np.hypot(*points[:, :2].T).max() == pytest.approx(RADIUS, rel=1e-12)


def test_bonded_ends_are_plates_until_sides_fold_onto_them():
    at = np.array([0.02, 0.3])
    bonded, sticks = (reference_curves((4, 3), at, slip)[0] for slip in ("bonded", "no_slip"))
    assert bonded[0] == pytest.approx(sticks[0], rel=1e-3) and bonded[1] < 0.98 * sticks[1]
    assert body_curve(Contestant("", (3, 3), "bonded"), at)[1] == pytest.approx(bonded[1], rel=0.03)


@pytest.mark.parametrize("mesh", programs.CELLS)
def test_a_program_gets_the_cylinder_and_is_judged_by_the_force_on_top(mesh, tmp_path, monkeypatch):
    def hand_over(program, given, out, at):
        """A program with twice the force at 40 %, from the scene that it gets."""
        scene = SceneFolder(given, program.mesh)
        scene.check_simple()
        corners = scene.points[scene.cells[:, :4]]
        volume = np.linalg.det(corners[:, 1:] - corners[:, :1]).sum() / 6.0
        assert volume == pytest.approx(np.pi * RADIUS**2 * HEIGHT, rel=0.06) and scene.mu == MODULUS
        top = scene.points[scene.probed_nodes]
        assert np.allclose(top[:, 2], 0.5 * HEIGHT) and len(scene.held) == 2 * len(top)
        closed = np.ptp(scene.held_at(scene.times[-1])[:, 2])
        assert closed == pytest.approx((1.0 - programs.PRESSED[-1]) * HEIGHT)
        factors = reference_curves((2, 2), np.array(programs.PRESSED), "bonded")[0] * [1.0, 1.0, 1.0, 2.0]
        force = factors * sliding(np.array(programs.PRESSED)) * MODULUS * np.pi * RADIUS**2
        hand_in(out, scene.times, np.array([scene.points] * 5), np.append(0.0, force), 3.0)
        return "", ""

    monkeypatch.setattr(programs, "hand_over", hand_over)
    monkeypatch.setattr(programs, "reference_curves", lambda cells, at, slip: reference_curves((2, 2), at, slip))
    monkeypatch.setattr(programs, "CELLS", dict.fromkeys(programs.CELLS, (2, 2)))
    ours, other = programs.press_rows([Program("other", "", mesh)], Surroundings(tmp_path, tmp_path))
    assert other["cost [s/s]"] == 3.0 and other["at 40 % [%]"] == pytest.approx(100.0)
    assert other["at 20 % [%]"] == pytest.approx(0.0, abs=1e-6) and abs(ours["at 20 % [%]"]) < 10.0


@pytest.fixture
def written(tmp_path):
    """Presses of two materials, Mooney–Rivlin: sample A of 9 kPa, sample B of 12 kPa, contacts at .2 and −.3 mm."""
    way, curves, lines = np.linspace(0.0, 19.8, 200), pd.read_csv(CURVES), ["# made", press.HEAD]
    for material, b in (("X_1", -0.1), ("Y_1", 0.15)):
        for run, mu, offset in (("A1", 9e3, 0.2), ("B1", 12e3, -0.3)):
            compression = np.maximum(1e-3 * (way - offset) / HEIGHT, 0.0)
            force = mu * press.AREA * press.law(curves, MOONEY, b)(np.minimum(compression, 0.54))
            lines += [f"{material},{run},{d},{f}" for d, f in zip(way, force, strict=True)]
    (tmp_path / "made.csv").write_text("\n".join(lines))
    return tmp_path / "made.csv"


def test_known_numbers_are_found_again(written):
    runs, curves = press.read_runs(written), pd.read_csv(CURVES)
    own = next(one for one in press.options(runs, curves) if (one.kind, one.scope) == (MOONEY, "family"))
    assert own.numbers == {"X": -0.1, "Y": 0.15}
    assert own.rows.loc[("X_1", "B"), "mu"].item() == pytest.approx(12e3, rel=1e-3)
    assert np.abs(own.rows[press.JUDGED].to_numpy()).max() < 0.1
    assert press.fit(runs[1], press.law(curves, MOONEY, -0.1))[1] == pytest.approx(-0.3e-3, abs=2e-6)
    twice = press.judged([runs[1]], press.law(curves, MOONEY, -0.1), {"X_1": 9e3})
    assert twice["mu"].item() == 9e3 and twice[0.5].item() < -10.0


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [("load_N", "load", "no line"), (",B1,", ",C1,", "no sample B of X_1"), ("X_1,A1,0", "X_1,A9,0", "ends at")],
)
def test_a_file_that_cannot_be_judged_is_refused(written, old, new, words):
    written.write_text(written.read_text().replace(old, new))
    with pytest.raises(StudyError, match=words):
        press.judged(press.read_runs(written), sliding)


def test_the_command_makes_the_published_tables_of_the_published_curves(tmp_path, monkeypatch):
    monkeypatch.setattr(sys, "argv", ["", "cylinder_press", "--curves", str(CURVES), "--results", str(tmp_path)])
    command.main()
    for name in ("press", "press_laws"):
        made, published = (pd.read_csv(folder / f"{name}.csv") for folder in (tmp_path / "silicone", PUBLISHED))
        pd.testing.assert_frame_equal(made, published, rtol=1e-2, atol=1e-2)
    assert (tmp_path / "silicone" / "press.png").stat().st_size > 10_000


@pytest.mark.parametrize(
    ("content", "words"), [(b"material,run\n", "lacks .*reference"), (b"", "is no table"), (b"\xff\xfe\x00", "is no")]
)
def test_other_files_are_refused(tmp_path, content, words):
    other = tmp_path / "other.csv"
    other.write_bytes(content)
    with pytest.raises(StudyError, match=words):
        press.read_curves(other)
    with pytest.raises(StudyError, match=r"no line|is no text"):
        press.read_runs(other)
