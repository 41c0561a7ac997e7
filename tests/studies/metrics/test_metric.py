"""The contract of every metric: what it declares, where it has no value, and when a value is doubtful."""

from dataclasses import replace

import numpy as np
import pytest

from studies.catalog import STUDIES
from studies.metrics import metrics as module
from studies.metrics.metric import Metric
from studies.metrics.metrics import METRICS
from studies.metrics.table import UNRESOLVED, metric, study_table
from studies.metrics.timing.protocol import FrameTiming
from studies.scene.library import JUDGED
from studies.scene.library.ball_squeeze import BALL_SQUEEZE
from studies.scene.quantities import ALWAYS, GAUGE_FREE
from studies.store.record import Status
from tests.studies.made_up_run import SCENE, of, run


@pytest.mark.parametrize("entry", METRICS, ids=lambda entry: entry.name)
def test_every_metric_explains_itself(entry):
    assert entry.name.isidentifier()
    assert entry.unit
    assert entry.better in ("lower", "higher", "-")
    assert f"[{entry.unit}]" in entry.description or (entry.unit == "s/s" and "[1]" in entry.description)
    assert isinstance(entry(run()), float)


@pytest.mark.parametrize("entry", METRICS, ids=lambda entry: entry.name)
@pytest.mark.parametrize("status", [Status.DIVERGED, Status.TIMED_OUT, Status.FAILED, Status.NOT_CONVERGED])
def test_a_run_that_ended_early_has_no_numbers(entry, status):
    timing = FrameTiming(np.full((2, 4), 1e6))
    assert np.isnan(entry(run(status=status, timing=timing)))


def test_names_are_unique_and_studies_use_known_ones():
    assert len({m.name for m in METRICS}) == len(METRICS)
    for study in STUDIES:
        assert all(isinstance(metric(name), Metric) for name in study.columns)


@pytest.mark.parametrize("entry", METRICS, ids=lambda entry: entry.name)
def test_every_metric_is_a_number_somewhere(entry):
    """A metric that no scene allows would be an empty column in every table."""
    # Of many checkpoints: tests/studies/reference/test_ringing.py; of obstacles: tests/studies/metrics/test_metrics.py.
    if entry.quantity == "frequency" or entry.name.startswith("contact"):
        return
    # Of scenes with a cut: tests/studies/runs/test_cutting.py.
    if entry.name in ("opening_error", "overlap") or entry.name.startswith(("piece_", "cut_")):
        return
    # Of two meshes: tests/studies/metrics/test_interval.py.
    if entry.name.endswith("_within"):
        return
    timing = FrameTiming(np.full((2, 4), 1e6), cpu_ns=np.full((2, 4), 1e6))
    kept = {"attributes": {"lumen_column": 0}} if entry.quantity == "lumen" else {}
    values = [
        entry(run(scene=replace(scene, checkpoints=(2.0, 4.0), probed=SCENE.probed), timing=timing, **kept))
        for scene in JUDGED
    ]
    assert np.isfinite(values).any()


@pytest.mark.parametrize("entry", METRICS, ids=lambda entry: entry.name)
def test_what_a_scene_does_not_allow_is_nan(entry):
    """A metric of the run alone keeps its value in a scene that compares no quantity."""
    mute = replace(SCENE, quantities=())
    judged = entry.quantity not in (None, *ALWAYS, *GAUGE_FREE) or entry.name in ("sway", "unbalanced")  # of forces
    expected = np.nan if judged else entry(run())
    assert np.array_equal(entry(run(scene=mute)), expected, equal_nan=True)


def test_a_free_turn_forbids_displacement_but_not_silhouette():
    free = replace(BALL_SQUEEZE, checkpoints=(2.0, 4.0), probed=SCENE.probed)
    for name in ("surface_error", "interior_error", "mean_error"):
        assert np.isnan(of(name, scene=free))
        assert np.isnan(metric(name).uncertainty(run(scene=free)))
    assert of("silhouette_error", scene=free) == pytest.approx(0.0, abs=1e-12)


def test_without_a_reference_only_the_own_volume_is_judged():
    alone = run(volume=(1.0, 0.97, 1.01, 0.98), reference=None)
    assert metric("volume_worst")(alone) == pytest.approx(3.0, rel=1e-12)
    assert metric("volume_end")(alone) == pytest.approx(-2.0, rel=1e-12)
    assert np.isnan([metric(name)(alone) for name in ("force_error", "surface_error", "silhouette_error")]).all()
    assert np.isnan(metric("volume_worst").uncertainty(alone))


def test_floor_stands_beside_the_number_in_the_table():
    table = study_table([run(), run(reference=None, status=Status.DIVERGED)], ["force_error", "min_j"])
    assert table["force_error floor [%]"].tolist()[0] == pytest.approx(1.0, rel=1e-12)
    assert np.isnan(table["force_error floor [%]"].tolist()[1])
    assert table["status"].tolist() == ["ok", "diverged"]
    assert table["dt [ms]"].tolist() == [50.0, 50.0] and table["dt/dt_c"].tolist() == [0.5, 0.5]
    assert "min_j floor [1]" not in table
    names = list(study_table([run(reference=None), run()], ["force_error", "min_j"]))
    assert names.index("force_error floor [%]") == names.index("force_error [%]") + 1


def test_doubtful_is_what_the_reference_knows_less_than_ten_times_better():
    """The floor of the force error is 1 %, of the last force 2 %: 10 and 20 % are just good enough."""
    force = metric("force_error")
    assert force.uncertainty(run()) == pytest.approx(1.0, rel=1e-12)
    assert not force.unresolved(run(force=(9.0, 1.11, 9.0, 2.22)))
    assert force.unresolved(run(force=(9.0, 0.91, 9.0, 1.82)))
    assert metric("force_end").unresolved(run(force=(9.0, 9.0, 9.0, 1.62)))
    assert not metric("force_end").unresolved(run(force=(9.0, 9.0, 9.0, 1.58)))
    # A volume has a truth of its own, and without a reference there is nothing to doubt.
    assert not metric("volume_worst").unresolved(run())
    assert not force.unresolved(run(reference=None))
    table = study_table([run(force=(9.0, 0.91, 9.0, 1.82)), run(reference=None)], ["force_error", "min_j"])
    assert table[UNRESOLVED].tolist() == ["force_error", ""]


def test_what_is_compared_with_a_reference_obeys_the_scene_wherever_it_is_called():
    """Charts call metrics by their functions: the chart of all results drew forces of scenes that compare none."""
    for one in METRICS:
        if one.quantity is not None and one.quantity not in ALWAYS:
            assert getattr(module, one.name) is one
    turned = run(scene=replace(SCENE, quantities=("surface",)))
    assert np.isnan(module.force_end(turned)) and np.isfinite(module.force_end(run()))
