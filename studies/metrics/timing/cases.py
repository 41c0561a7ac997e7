"""Frame times of stored cases, in separate files, so that timing never changes results
(studies.metrics.timing.protocol)."""

import time
import warnings
from collections.abc import Callable, Iterable
from dataclasses import replace
from functools import partial
from pathlib import Path

import numpy as np

from massspring import Free, Setup, simulate
from studies.base.compile_watch import watching
from studies.base.doing import doing
from studies.base.errors import StudyError
from studies.metrics.timing.protocol import FrameTiming, interleave, pinned
from studies.metrics.timing.stage_cost import ROWS, stage_times
from studies.runs.case import Case
from studies.runs.current import case_fingerprint, case_path
from studies.runs.prepare import prepare
from studies.store.machine import machine_id
from studies.store.paths import timing_path
from studies.store.record import Record, Status, new_record, write_record

REPEATS, FEWEST = 5, 1
BUDGET = 6.0
"""Time for the repeats of a case [s]: a run of several seconds contains thousands of steps, and is repeated less
often."""
WARM_UP = 1.0
"""Longest run before measurement [s], which compiles the code for the case."""


def timing_file(root: Path, study: str, case: Case) -> Path:
    return timing_path(case_path(root, study, case), machine_id())


def timing_of(record: Record) -> FrameTiming:
    own, attributes = record.fields.get("cpu_ns"), record.attributes
    return FrameTiming(
        record.fields["frame_ns"].values,
        attributes.get("core"),
        attributes["threads"],
        cpu_ns=None if own is None else own.values,
        others=attributes.get("others"),
        processor=attributes.get("processor") or "",
    )


def time_cases(root: Path, study: str, cases: Iterable[Case], on_case: Callable[[str], None]) -> None:
    """Times cases on one pinned core, without other load. Cases that differ only by method are interleaved, so that
    their ratio is fair.

    Raises StudyError when a file cannot be written.
    """
    groups: dict[str, list[Case]] = {}
    for case in cases:
        groups.setdefault(case.replaced(method=Free()).key, []).append(case)
    with pinned(threads=1) as core:
        for group in groups.values():
            started = time.perf_counter()
            doing(f"frame times of {group[0].name}")
            with watching() as watch:
                with warnings.catch_warnings():
                    warnings.simplefilter("ignore", UserWarning)  # the run has stored the warnings of its preparation
                    setups = {case.key: prepare(case).setup for case in group}
                contestants = {key: partial(frames_of, setup) for key, setup in setups.items()}
                measured = interleave(contestants, max(map(repeats_for, setups.values())), warmups=0, core=core)
                stages = {case.key: stage_times(setups[case.key]) for case in group}
            seconds = (time.perf_counter() - started - watch.seconds) / len(group)
            for case in group:
                timing = replace(measured[case.key], stage_ns=stages[case.key], stages=ROWS)
                write_timing(root, study, case, timing, seconds)
                on_case(case.name)


def frames_of(setup: Setup) -> np.ndarray:
    """Wall and processor time of the frames of a run [ns], (2, F)."""
    history = simulate(setup)
    return np.stack([history.frame_ns, history.cpu_ns])


def repeats_for(setup: Setup) -> int:
    """Number of repeats of the run, from the time of its first frames."""
    simulate(setup, time_limit=0.0)
    first = simulate(setup, time_limit=WARM_UP)
    frames = max(first.good_frames, 1)
    whole = 1e-9 * first.frame_ns[:frames].mean() * setup.clock.frames
    return int(min(max(BUDGET / whole, FEWEST), REPEATS)) if whole > 0.0 else REPEATS


def write_timing(root: Path, study: str, case: Case, timing: FrameTiming, seconds: float | None = None) -> None:
    """Stores frame times next to the record of their case; `seconds`: time spent on measuring them."""
    if not (timing.frame_ns > 0).all():
        raise StudyError(f"case {case.name} broke off while it was timed; run it again")
    record = new_record(
        kind="timing",
        key=case.key,
        name=case.name,
        status=Status.OK,
        message="",
        fingerprint=case_fingerprint(case),
        attributes={**timing.attributes(), "seconds": seconds},
        fields=timing.fields(),
    )
    write_record(timing_file(root, study, case), record)
