"""The reference, from an octant solved on three very coarse meshes: right, whole, with an error bar."""

import shutil
from dataclasses import replace

import numpy as np
import pandas as pd
import pytest

from reference_fem import Checkpoint, ReferenceProblem
from studies import checkpoints
from studies import reference_solve as module
from studies.adapt_reference import whole_forces
from studies.distance import hausdorff
from studies.errors import StudyError
from studies.floors import QUANTITIES
from studies.geometry.mesh import signed_volume
from studies.reference import load_reference
from studies.reference_report import reference_listing, refresh_uncertainty
from studies.reference_solve import Piece, pieces, solve
from studies.scenes import ReferencePlan
from studies.scenes.ball_clamped import BALL_CLAMPED
from studies.scenes.ball_squeeze import BALL_SQUEEZE
from studies.store import Status, read_record
from studies.sweep import load_runs
from tests.studies.tiny import tiny_case, tiny_study

LEVELS = (0.5, 0.4, 0.32)
SCENE = replace(BALL_SQUEEZE, reference=ReferencePlan("octant", LEVELS), checkpoints=(1.0, 4.0))
RADIUS, SHEAR = 0.05, SCENE.tissue.shear_modulus
DEPTH = (0.10, 0.30)
"""Of the diameter, at the two checkpoints."""
FORCE = (0.19197, 1.25968)
EQUATOR = (1.01325, 1.08359)
"""F/(mu R²) and equator radius over R: docs, oracle of the squeezed ball (axisymmetric finite elements, to 1e-4)."""
ORACLE = 1e-4


@pytest.fixture(scope="module")
def solved(mesh_cache, tmp_path_factory):
    root = tmp_path_factory.mktemp("reference")
    for piece in pieces(SCENE):
        solve(root, piece)
    return root


@pytest.fixture(scope="module")
def found(solved):
    return load_reference(solved, SCENE)


def test_force_and_equator(found):
    # Some fifty curved quadratic tetrahedra: the force is then 1 % off, a plane too many or an octant too few 50 %.
    np.testing.assert_allclose(found.force / (SHEAR * RADIUS**2), FORCE, rtol=0.05)
    for checkpoint, radius in enumerate(EQUATOR):
        points, triangles = found.surface(checkpoint)
        used = points[np.unique(triangles)]
        assert np.linalg.norm(used[:, :2], axis=1).max() == pytest.approx(radius * RADIUS, rel=0.005)
        assert np.ptp(used[:, 2]) == pytest.approx(2 * RADIUS * (1 - DEPTH[checkpoint]), rel=2e-3)


def test_pressure_is_the_one_that_balances_the_planes(found):
    """Σ f·x = ∫ tr σ dv, and tr σ/3 is the pressure: two planes F at ± h press 2 F h/(3 V) into the ball on average."""
    height = RADIUS * (1 - np.array(DEPTH))
    volume = found.field("volume") * 4 / 3 * np.pi * RADIUS**3
    # 0.2 % is what this mesh leaves; a mean over nodes, most of which are near the pole, is three times too large.
    np.testing.assert_allclose(found.field("pressure"), 2 * found.force * height / (3 * volume), rtol=0.01)


def test_every_quantity_has_a_positive_floor_in_shares(found):
    # A ball has no lumen and does not ring, and this one may turn; what is not compared is not listed.
    assert set(found.floor) == set(QUANTITIES) - {"lumen", "frequency", "surface", "surface_mean", "interior"}
    for name, known in found.uncertainty.items():
        assert set(known.shares) == {"mesh", "steps", "contact", "kappa"}
        assert found.floor[name] == pytest.approx(np.sqrt(sum(share**2 for share in known.shares.values())), rel=1e-12)
        # Coarse, but neighbours: more than a fifth apart they would not describe the same thing.
        assert 0 < known.shares["mesh"] < 0.3, name
        # A path without friction or loss forgets its steps, but for how far points sink in: a thousandth is allowed.
        assert known.shares["steps"] < 3e-3, name
        assert known.shares["contact"] > 0
        assert known.shares["kappa"] > 0
    # kappa = 5000 mu lets the volume change by p/kappa, here under 2e-4; contact and mesh hardly do.
    volume = found.uncertainty["volume"]
    assert volume.shares["kappa"] == pytest.approx(np.abs(found.field("volume") - 1).max(), rel=0.05)


@pytest.mark.slow
@pytest.mark.parametrize("levels", [(0.6, 0.5, 0.4), (0.5, 0.4, 0.32), (0.4, 0.32, 0.25)])
def test_the_error_bar_covers_the_true_error_and_is_not_idle(found, solved, levels):
    """The ball between planes is known to 1e-4 (incompressible, converged): the bar holds it, within a factor 20."""
    scene = replace(SCENE, reference=ReferencePlan("octant", levels))
    for piece in pieces(scene):
        if not piece.is_current(solved):
            solve(solved, piece)
    reference = load_reference(solved, scene)
    scaled = reference.force / (SHEAR * RADIUS**2)
    error = np.linalg.norm(scaled - FORCE) / np.linalg.norm(FORCE), abs(scaled[-1] / FORCE[-1] - 1)
    for name, true in zip(("force", "force_end"), error, strict=True):
        assert true < reference.floor[name] + ORACLE < 20 * (true + ORACLE), name


def test_a_shift_is_told_and_not_applied(found):
    """The force that is compared with is that of the finest mesh."""
    known = found.uncertainty["force_end"]
    assert found.force[-1] == found.scene.probe(found.field("contact_force"), found.field("held_force"))[-1]
    assert abs(known.shift) <= known.shares["mesh"]


def test_two_meshes_have_a_larger_bar_and_one_has_none(found):
    pair = replace(found, coarser=found.coarser[:1])
    assert pair.floor["force"] > 0
    assert pair.uncertainty["silhouette"].shares["mesh"] > found.uncertainty["silhouette"].shares["mesh"]
    with pytest.raises(StudyError, match="one mesh only"):
        _ = replace(found, coarser=()).floor


def test_displacement_is_mirrored(found):
    points = RADIUS * np.random.default_rng(3).uniform(0.05, 0.55, (40, 3))
    truth = found.displacement(points)
    assert np.abs(truth).max() > 0.05 * RADIUS
    for sign in ([-1, 1, 1], [1, 1, -1], [-1, -1, -1]):
        np.testing.assert_array_equal(found.displacement(points * sign), truth * sign)
    axis = found.displacement(np.array([[0.0, 0.0, 0.5 * RADIUS]]))
    assert np.abs(axis[0, :2]).max() < 1e-9
    assert axis[0, 2] < 0


def test_displacement_at_a_node_is_the_stored_one(found):
    np.testing.assert_allclose(
        found.displacement(found.field("nodes")[:50]), found.field("displacement")[-1][:50], rtol=0, atol=1e-9 * RADIUS
    )


def test_surface_is_whole_and_outward(found):
    points, triangles = found.surface()
    used, inverse = np.unique(np.round(points / (1e-6 * RADIUS)), axis=0, return_inverse=True)
    welded = inverse.reshape(-1)[triangles]
    edges, count = np.unique(
        np.sort(welded[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2), axis=1), axis=0, return_counts=True
    )
    assert (count == 2).all()
    assert len(np.unique(welded)) - len(edges) + len(welded) == 2
    # Flat facets of a coarse mesh cut a little off the ball, whose volume is kept.
    assert signed_volume(points, triangles) == pytest.approx(4 / 3 * np.pi * RADIUS**3, rel=0.04)
    assert len(used) < len(points)
    mirrored = points * [1, -1, 1], triangles
    assert hausdorff(points, triangles, *mirrored) < 1e-9 * RADIUS


def test_whole_forces_mirror_and_multiply(found):
    octant = np.array([[[0.1, -0.2, -3.0]], [[0.0, 0.0, -5.0]]])
    whole = whole_forces(SCENE, octant)
    np.testing.assert_array_equal(whole[:, 0], [[0, 0, -12], [0, 0, -20]])
    np.testing.assert_array_equal(whole[:, 1], [[0, 0, 12], [0, 0, 20]])
    solid = replace(SCENE, reference=ReferencePlan("solid", (100, 200)))
    np.testing.assert_array_equal(whole_forces(solid, octant), octant)


def test_both_planes_are_felt(found):
    contact = found.field("contact_force")
    np.testing.assert_array_equal(contact[:, 0], -contact[:, 1])
    np.testing.assert_array_equal(found.force, -contact[:, 0, 2])


def test_current_until_the_load_or_the_code_changes(solved, monkeypatch):
    piece = Piece(SCENE, LEVELS[0])
    assert piece.is_current(solved)
    renamed_metric = replace(SCENE, damping=1.0, frames=7, title="another", quantities=("volume",))
    other_family = replace(renamed_metric, reference=ReferencePlan("octant", (0.5, 0.1), variants=()))
    assert Piece(other_family, LEVELS[0]).is_current(solved)
    assert Piece(replace(SCENE, gravity=(0.0, 0.0, -9.81)), 0.5).key != piece.key
    assert Piece(SCENE, 0.5, "kappa").key != piece.key
    assert not Piece(replace(SCENE, checkpoints=(1.0, 3.9)), LEVELS[0]).is_current(solved)
    monkeypatch.setattr(module, "reference_fingerprint", lambda: "other")
    assert not piece.is_current(solved)


def test_settings_are_varied_only_where_they_matter():
    assert [piece.variant for piece in pieces(SCENE)] == ["", "", "", "steps", "contact", "kappa"]
    assert {piece.level for piece in pieces(SCENE) if piece.variant} == {LEVELS[0]}
    untouched = replace(SCENE, obstacles=(), probed=BALL_CLAMPED.probed)
    assert [piece.variant for piece in pieces(untouched)] == ["", "", "", "steps", "kappa"]
    assert pieces(replace(SCENE, reference=None)) == []


def test_listing_says_how_every_piece_stands(solved, tmp_path, monkeypatch):
    root = shutil.copytree(solved, tmp_path / "results")
    Piece(SCENE, LEVELS[1]).path(root).unlink()
    damaged = Piece(SCENE, LEVELS[0], "kappa").path(root)
    damaged.write_bytes(damaged.read_bytes()[:500])
    whole, spoilt = reference_listing(solved, [SCENE]), reference_listing(root, [SCENE])
    assert whole["state"].tolist() == ["ok"] * 6
    assert whole["steps"].tolist() == ["2/2"] * 6
    assert (whole["seconds"] > 0).all()
    assert whole["unknowns"][:3].is_monotonic_increasing
    assert spoilt["state"].tolist() == ["ok", "missing", "ok", "ok", "ok", "unreadable"]
    bars = whole["force uncertainty [%]"]
    assert bars[2] > 0
    assert bars.drop(2).isna().all()
    assert spoilt["force uncertainty [%]"].isna().all()
    monkeypatch.setattr(module, "reference_fingerprint", lambda: "other")
    assert reference_listing(solved, [SCENE])["state"].tolist() == ["stale"] * 6


def test_error_bars_are_written_once_and_again_when_a_reference_changes(solved, tmp_path, found):
    root = shutil.copytree(solved, tmp_path / "results")
    table, chart = refresh_uncertainty(root, [SCENE, SCENE, replace(SCENE, name="bare", reference=None)])
    rows = pd.read_csv(table)
    assert rows["quantity"].tolist() == list(found.floor)
    shares = rows[["mesh [%]", "steps [%]", "contact [%]", "kappa [%]"]].to_numpy()
    np.testing.assert_allclose(np.linalg.norm(shares, axis=1), rows["uncertainty [%]"], rtol=1e-5)
    assert rows["uncertainty [%]"][0] == pytest.approx(100 * found.floor["force"], rel=1e-5)
    assert chart.read_bytes()[:4] == b"\x89PNG"
    chart.write_bytes(b"old")
    refresh_uncertainty(root, [SCENE])
    assert chart.read_bytes() == b"old"
    solve(root, Piece(SCENE, LEVELS[0]))
    refresh_uncertainty(root, [SCENE])
    assert chart.read_bytes()[:4] == b"\x89PNG"
    assert refresh_uncertainty(tmp_path / "empty", [SCENE]) == []


class Killed(BaseException):
    """What a process that dies leaves behind: nothing is caught, nothing tidied."""


def test_a_crash_half_way_costs_no_finished_step(solved, tmp_path, monkeypatch):
    """The second load step dies; the next run starts at the first one's end and finds the same."""
    piece, true_path, starts = Piece(SCENE, LEVELS[0]), module.equilibrium_path, []

    def dies(problem, times, settings, on_checkpoint, resume):
        def then_die(checkpoint):
            on_checkpoint(checkpoint)
            raise Killed

        return true_path(problem, times, settings, on_checkpoint=then_die, resume=resume)

    def watched(problem, times, settings, on_checkpoint, resume):
        starts.append(len(resume.path) if resume else 0)
        return true_path(problem, times, settings, on_checkpoint=on_checkpoint, resume=resume)

    monkeypatch.setattr(module, "equilibrium_path", dies)
    with pytest.raises(Killed):
        solve(tmp_path, piece)
    listing = reference_listing(tmp_path, [SCENE])
    assert listing["state"].tolist() == ["half-way", *["missing"] * 5]
    assert listing["steps"][0] == "1/2"
    monkeypatch.setattr(module, "equilibrium_path", watched)
    again, whole = read_record(solve(tmp_path, piece)), read_record(piece.path(solved))
    assert starts == [1]
    assert again.status == Status.OK
    for name in ("displacement", "contact_force", "pressure"):
        known = whole.fields[name].values
        # The factorisation may order its sums by the first matrix it sees: rounding, not Newton's tolerance of 1e-6.
        np.testing.assert_allclose(again.fields[name].values, known, rtol=0, atol=1e-9 * np.abs(known).max())
    assert reference_listing(tmp_path, [SCENE])["state"][0] == "ok"
    assert not list(tmp_path.rglob("*.steps"))


def test_steps_of_other_code_are_not_gone_on_from(tmp_path, monkeypatch):
    piece, asked = Piece(SCENE, LEVELS[0]), []
    checkpoints.keep(piece.path(tmp_path), "other code", Checkpoint([], None))

    def watched(problem, times, settings, on_checkpoint, resume):
        asked.append(resume)
        raise ReferenceProblem("enough")

    monkeypatch.setattr(module, "equilibrium_path", watched)
    solve(tmp_path, piece)
    checkpoints.steps_path(piece.path(tmp_path)).write_bytes(b"cut off")
    solve(tmp_path, piece)
    assert asked == [None, None]


def broken(problem, times, settings, **_):
    raise ReferenceProblem("no equilibrium found between t = 1 s and t = 4 s: the mesh folds; refine it", converged=[])


def test_a_path_that_breaks_off_is_stored_and_not_believed(solved, tmp_path, monkeypatch):
    root = shutil.copytree(solved, tmp_path / "results")
    true_path = module.equilibrium_path

    def half(problem, times, settings, **_):
        raise ReferenceProblem("the mesh folds; refine it", converged=true_path(problem, times[:1], settings))

    monkeypatch.setattr(module, "equilibrium_path", half)
    record = read_record(solve(root, Piece(SCENE, LEVELS[1])))
    assert record.status == Status.NOT_CONVERGED
    assert "mesh folds" in record.message
    force = record.fields["contact_force"].values
    assert np.isfinite(force[0]).all()
    assert np.isnan(force[1]).all()
    with pytest.raises(StudyError, match="not-converged: the mesh folds; refine it"):
        load_reference(root, SCENE)


def test_runs_are_loaded_without_a_reference_that_failed(solved, tmp_path, monkeypatch, mesh_cache):
    from studies.run import run_case

    root = shutil.copytree(solved, tmp_path / "results")
    study = tiny_study(cases=(tiny_case(scene=SCENE),))
    run_case(root, study.name, study.cases[0])
    runs, remarks = load_runs(root, study)
    assert remarks == []
    assert runs[0].reference.force[-1] > 0
    monkeypatch.setattr(module, "equilibrium_path", broken)
    solve(root, Piece(SCENE, LEVELS[1]))
    runs, remarks = load_runs(root, study)
    assert runs[0].reference is None
    assert len(remarks) == 1
    assert "not-converged" in remarks[0]
    Piece(SCENE, LEVELS[0]).path(root).unlink()
    assert "no results file" in load_runs(root, study)[1][0]


def test_no_plan_no_reference(tmp_path):
    assert load_reference(tmp_path, replace(SCENE, reference=None)) is None
    with pytest.raises(StudyError, match="two levels"):
        ReferencePlan("octant", (0.5,))
