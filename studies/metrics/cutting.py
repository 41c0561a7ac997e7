"""Metrics of a run whose body is cut: volumes, and the effect of the cut on energy, momentum, stable step and computing
time."""

import numpy as np

from studies.metrics.metric import PERCENT
from studies.metrics.run import Run

THERE = 1e-12
"""Relative difference of the target of a volume from its final value below which the return of volumes after a cut has
ended."""


def piece_worst(run: Run) -> float:
    """100 max |V/V0 − 1| of a piece over all frames after the cut and the clock that leads volumes back [%].

    NaN without a cut, and for a run that ended before it."""
    if not run.case.scene.cuts:
        return float("nan")
    volume, target = run.part_volumes
    arrived = (np.abs(target / target[-1] - 1) < THERE).all(axis=1)
    arrived[: run.record.attributes["cut_frame"]] = False
    if not arrived.any():
        return float("nan")
    return PERCENT * float(np.abs(volume[arrived] / target[-1] - 1).max())


def piece_sum_worst(run: Run) -> float:
    """100 max |ΣV/ΣV0 − 1| of all pieces together over all frames [%]; NaN without a cut."""
    if not run.case.scene.cuts:
        return float("nan")
    volume, target = run.part_volumes
    return PERCENT * float(np.abs(volume.sum(axis=1) / target[-1].sum() - 1).max())


def _of_event(run: Run, name: str) -> float:
    return float(run.record.attributes.get(name, np.nan))


def cut_energy(run: Run) -> float:
    """100 × change of the energy over the energy when the body is replaced by the cut one [%], the largest of all
    events; NaN without a cut."""
    return PERCENT * _of_event(run, "cut_energy")


def cut_momentum(run: Run) -> float:
    """100 × change of the momentum over the sum of its sizes in all nodes at the cut [%], the largest of all events;
    NaN without a cut."""
    return PERCENT * _of_event(run, "cut_momentum")


def cut_limit(run: Run) -> float:
    """Stability limit of the step after the cut over that before [1]; NaN without a cut."""
    return _of_event(run, "cut_limit_ratio")


def cut_ms(run: Run) -> float:
    """Wall time of the cut, for which the bodies are made before the run [ms], the longest of all events; NaN without
    a cut."""
    return 1e3 * _of_event(run, "cut_seconds")
