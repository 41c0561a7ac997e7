"""Samples of a reference's solutions are stored in the record and compared at the vertices of the coarsest mesh."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from reference_fem.uncertainty import NESTED_SAFETY
from studies.base.errors import StudyError
from studies.reference.nested import DISPLACEMENT, fine_enough
from studies.reference.sample import SERIES, Sample, SamplePoints, sample_fields, samples_in
from studies.reference.uncertainty import FACTORS, QUANTITIES, uncertainties, uncertainty_of_meshes
from studies.scene.library import BALL_CLAMPED, BALL_SQUEEZE
from studies.store.record import new_fields
from studies.store.schema import REFERENCE_FIELDS
from tests.studies.tiny import cube

POINTS, _, CELLS = cube(2, 2.0)
AT = SamplePoints(POINTS, CELLS)
UNKNOWNS = (40_000, 16_000, 7_000)
END = len(BALL_CLAMPED.checkpoints) - 1


def sample(left=0.0, variant="", unknowns=1_000, **changes):
    """A made-up solution whose every number is off by `left`, relative to 1 or to its size."""
    along = np.arange(1.0, END + 2)
    values = {
        "u": POINTS * [0.1, -0.1, 0.2] * (1 + left),
        "force": 4.0 * along * (1 + left),
        "volume": 1 + left * np.ones(END + 1),
        "pressure": -along * (1 + left),
        "lumen_pressure": np.full(END + 1, np.nan),
    }
    return Sample(variant, unknowns, 0.01, **(values | changes))


def family(rate=2 / 3, slope=0.5):
    """Three nested meshes whose errors fall with this power of the unknowns."""
    return [sample(slope * (n / 1000) ** -rate, unknowns=n) for n in UNKNOWNS]


def test_samples_come_back_from_a_record_bit_for_bit():
    samples = [*family(), sample(0.1, "steps"), sample(0.2, "kappa", force=np.full(END + 1, np.nan), frequency=3.25)]
    fields = new_fields(REFERENCE_FIELDS, empty_fields() | sample_fields(AT, samples, len(BALL_CLAMPED.checkpoints)))
    at, copies = samples_in(BALL_CLAMPED, SimpleNamespace(fields=fields))
    np.testing.assert_array_equal(at.points, POINTS)
    np.testing.assert_array_equal(at.tetrahedra, CELLS)
    none = new_fields(REFERENCE_FIELDS, empty_fields() | sample_fields(AT, [], len(BALL_CLAMPED.checkpoints)))
    assert samples_in(BALL_CLAMPED, SimpleNamespace(fields=none))[1] == []  # it broke off on its coarsest mesh
    assert not at.symmetric and samples_in(BALL_SQUEEZE, SimpleNamespace(fields=fields))[0].symmetric
    assert [one.variant for one in copies] == ["", "", "", "steps", "kappa"]
    for one, other in zip(samples, copies, strict=True):
        assert (one.unknowns, one.size) == (other.unknowns, other.size)
        np.testing.assert_array_equal([one.frequency], [other.frequency])
        for name in ("u", *SERIES):
            np.testing.assert_array_equal(getattr(other, name), getattr(one, name), err_msg=name)


def empty_fields():
    """All fields of a reference, of length zero where it has no values."""
    lengths = {"K": END + 1, "c": 1, "3": 3, "4": 4}
    return {
        name: np.zeros(
            [lengths.get(part, 0) for part in spec.shape.split()], dtype=int if name == "tetrahedra" else float
        )
        for name, spec in REFERENCE_FIELDS.items()
        if not name.startswith("sample_")
    }


def test_points_have_shares_of_the_volume_and_of_the_surface():
    """Of a cube of edge 2 m; an octant has no surface on its planes of symmetry, and half the size of its body."""
    assert AT.volumes.sum() == pytest.approx(8.0) and AT.areas.sum() == pytest.approx(24.0)
    assert (AT.areas > 0).sum() == len(POINTS) - 1 and AT.areas[np.abs(POINTS).max(axis=1) < 0.5] == 0
    octant = SamplePoints(POINTS + 1.0, CELLS, symmetric=True)
    assert octant.areas.sum() == pytest.approx(12.0) and octant.size == pytest.approx(2 * AT.size)


@pytest.mark.parametrize("name", ["force", "force_end", "pressure", "volume", "surface", "interior", "surface_mean"])
def test_a_bar_of_nested_meshes_is_the_safety_times_their_error(name):
    """Of what falls as it is taken to, to first order in the error."""
    meshes = family(slope=1e-4)
    error = 1e-4 * 40 ** (-2 / 3)
    scale = {"surface_mean": np.linalg.norm(POINTS * [0.1, -0.1, 0.2], axis=1)}.get(name)
    size = 1.0 if scale is None else AT.areas @ scale / AT.areas.sum() / scale.max()
    bar = uncertainty_of_meshes(BALL_CLAMPED, AT, meshes, name)
    assert bar.uncertainty == pytest.approx(NESTED_SAFETY * error * size, rel=1e-3)
    assert (bar.shift, bar.monotone) == (0.0, False)


def uncertainties_of(meshes, least_j=0.5):
    return uncertainties(BALL_CLAMPED, AT, meshes, {}, least_j)


def bars_of(meshes):
    return {name: bar.total for name, bar in uncertainties_of(meshes).items()}


def test_settings_are_compared_with_the_coarsest_mesh_and_add_to_the_bar():
    meshes = family()
    off = meshes[-1].force * 1.01
    better = {"steps": replace(meshes[-1], variant="steps", force=off), "kappa": replace(meshes[-1], variant="kappa")}
    bar = uncertainties(BALL_CLAMPED, AT, meshes, better, 0.5)["force_end"]
    assert bar.shares["kappa"] == 0.0 and set(bar.shares) == {"mesh", "steps", "kappa"}
    change = 1 - 1 / 1.01
    assert bar.shares["steps"] == pytest.approx(change / (1 - 1 / FACTORS["steps"]), rel=1e-9)
    assert bar.total == pytest.approx(np.hypot(bar.shares["mesh"], bar.shares["steps"]), rel=1e-12)


def test_a_strained_held_edge_has_a_share():
    """Of all quantities but the volume; not in a body that nothing holds, or whose least J is larger."""
    strained = uncertainties_of(family(), 0.09)
    assert {name for name, bar in strained.items() if "edge" in bar.shares} == set(strained) - {"volume"}
    assert strained["force"].total == pytest.approx(np.hypot(0.002, uncertainties_of(family())["force"].total))
    free = uncertainties(replace(BALL_CLAMPED, held=()), AT, family(), {}, 0.09)
    assert not any("edge" in bar.shares for bars in (free, uncertainties_of(family(), 0.11)) for bar in bars.values())


@pytest.mark.filterwarnings("error")
@pytest.mark.parametrize("scene", [BALL_CLAMPED, BALL_SQUEEZE], ids=lambda scene: scene.reference.mesh)
def test_a_force_that_is_zero_has_no_relative_bar(scene):
    """An obstacle that never touches: nested meshes, and octants by Richardson's extrapolation."""
    meshes = [replace(one, force=0.0 * one.force, size=0.01 * k) for k, one in enumerate(family(), 1)]
    bars = uncertainties(scene, AT, meshes, {"steps": replace(meshes[-1], variant="steps")}, 0.5)
    assert np.isnan(bars["force"].total) and np.isnan(bars["force_end"].total) and bars["volume"].total > 0


def test_every_quantity_that_is_compared_has_a_bar():
    assert set(uncertainties_of(family())) == set(QUANTITIES) - {"lumen", "frequency", "opening"}
    with pytest.raises(StudyError, match="one mesh only"):
        uncertainties_of(family()[:1])


def test_checkpoints_that_a_mesh_was_not_solved_at_are_left_out():
    """Coarser nested meshes have the last one alone."""
    meshes = family(slope=1e-4)
    alone = np.full(END + 1, np.nan)
    for k in (1, 2):
        alone = np.where(np.arange(END + 1) == END, meshes[k].force, np.nan)
        meshes[k] = replace(meshes[k], force=alone)
    bars = uncertainties_of(meshes)
    assert bars["force"].total == pytest.approx(bars["force_end"].total, rel=1e-6)


def test_meshes_are_fine_enough_when_force_and_displacement_are():
    """The bar of the mean displacement counts two and a half times."""
    moved = family(slope=1e-3)
    meshes = [replace(one, u=moved[0].u) for one in moved]
    force, mean = bars_of(meshes)["force_end"], bars_of(moved)["surface_mean"]
    assert fine_enough(BALL_CLAMPED, AT, meshes, force) and not fine_enough(BALL_CLAMPED, AT, meshes, 0.999 * force)
    assert mean < force < DISPLACEMENT * mean
    assert fine_enough(BALL_CLAMPED, AT, moved, 1.001 * DISPLACEMENT * mean)
    assert not fine_enough(BALL_CLAMPED, AT, moved, 0.999 * DISPLACEMENT * mean)
    alone = replace(BALL_CLAMPED, quantities=("force",))
    assert fine_enough(alone, AT, moved, force), "what the scene does not compare counts nothing"
