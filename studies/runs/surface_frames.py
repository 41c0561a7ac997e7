"""Positions of the outer surface at several times of a run, for a replay, if a case records them."""

import numpy as np

from massspring import History
from studies.runs.prepare import Prepared
from studies.store.schema import SURFACE

MOMENTS = 60
"""Number of evenly spaced times over the duration; start, checkpoints, last frame and those of `resting_frames` are
added."""


def moments(frames: int, checkpoints: list[int]) -> list[int]:
    """Numbers (1 … F) of the frames after which the surface is kept, ascending: at most MOMENTS and the checkpoints."""
    even = {max(1, round(frames * part / MOMENTS)) for part in range(1, MOMENTS + 1)}
    return sorted(even.union(checkpoints))


def surface_fields(prepared: Prepared, history: History) -> dict[str, np.ndarray]:
    """The fields SURFACE of a run: at its snapshots, `moments` among them, from the start to the last good frame.

    Positions (P, v, 3) [m] are rounded to float32, to 6e-8 of their distance from the origin.
    """
    setup = prepared.setup
    nodes = np.unique(prepared.mesh.outer_triangles)
    start = prepared.body.rest if setup.positions is None else setup.positions
    frames, seen = [0, *history.snapshot_frames], [start, *history.snapshots]
    if frames[-1] < history.good_frames:  # the run ended between two of these times
        frames.append(history.good_frames)
        seen.append(history.final)
    places = np.array(seen) if prepared.tissue is None else prepared.tissue.places(np.array(seen))
    values = np.array(frames, dtype=np.int64), nodes.astype(np.int64), places[:, nodes].astype(np.float32)
    return dict(zip(SURFACE, values, strict=True))
