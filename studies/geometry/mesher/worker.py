"""Process that meshes one recipe: `python -m studies.geometry.mesher.organ_recipe JOB.npz OUT.npz SECONDS`.

gmsh can hang without a message or crash; a separate process protects the caller. Scans use the module scan_recipe,
because their compiled distances take half a second to import.
"""

import json
import os
import signal
import time
from collections.abc import Callable
from typing import Any

import numpy as np

from studies.base.errors import StudyError
from studies.base.interrupts import end_after

Arrays = dict[str, np.ndarray]


LEAST = 1e-3
"""Smallest value [s] with which the timer starts."""


def work(build: Callable[[dict[str, Any], Arrays], Arrays], job_path: str, out_path: str, limit: str) -> int:
    """Reads the job and writes the arrays of `build`, or the message of its StudyError. Returns the exit code, 0 or 2.

    Standard input is a pipe that the caller keeps open; the process ends when it closes. The process also ends after
    `limit` seconds of processor time, even inside a library.
    """
    end_after(lambda: os.read(0, 1))
    if hasattr(signal, "setitimer"):  # Windows has none; there only the clock of the caller limits the time
        signal.setitimer(signal.ITIMER_PROF, max(float(limit) - time.process_time(), LEAST))
    with np.load(job_path, allow_pickle=False) as job:
        arrays = {key: job[key] for key in job.files if key != "recipe"}
        recipe = json.loads(str(job["recipe"]))
    try:
        result = build(recipe, arrays)
    except StudyError as error:
        np.savez(out_path, error=np.array(str(error)))
        return 2
    np.savez(out_path, allow_pickle=False, **result)
    return 0
