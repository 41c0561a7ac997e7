"""A path of the reference with contact: its wall time, a Newton iteration of it, and its memory."""

import os
import resource
import time

import numpy as np
from skfem import MeshTet

from reference_fem import NeoHookean, PrescribedDisplacement, Problem, RigidPlane, equilibrium_path


def contact_path(cells: int, steps: int) -> dict[str, float]:
    """A tilted plane pressed into a cube of `cells` along each edge in equal steps, on one core."""
    ticks = np.linspace(0.0, 1.0, cells + 1)
    plane = RigidPlane((1.0, 0.5, 1.0), (-0.2, 0.0, -1.0), lambda t: (0.0, 0.0, -0.2 * t))
    held = [PrescribedDisplacement(lambda x: x[2] < 1e-9)]
    problem = Problem(MeshTet.init_tensor(ticks, ticks, ticks), NeoHookean(1.0, 5000.0), held, [plane])
    cores = os.sched_getaffinity(0)
    os.sched_setaffinity(0, {max(cores)})  # the first cores serve the system
    try:
        start = time.perf_counter()
        path = equilibrium_path(problem, np.arange(1, steps + 1) / steps)
        seconds = time.perf_counter() - start
    finally:
        os.sched_setaffinity(0, cores)
    return {
        "unknowns": path[0].u.size + path[0].p.size,
        "wall": seconds,
        "iteration": seconds / sum(state.newton_iterations for state in path),
        "memory": 1024 * resource.getrusage(resource.RUSAGE_SELF).ru_maxrss,
    }


class Path:
    """Ten load steps, 49,000 unknowns."""

    timeout = 1200.0

    def setup_cache(self) -> dict[str, float]:
        """The path, once."""
        contact_path(2, 1)  # compiles
        return contact_path(12, 10)

    def track_wall(self, path: dict[str, float]) -> float:
        """Of the whole path."""
        return path["wall"]

    def track_iteration(self, path: dict[str, float]) -> float:
        """Assembly, factors, solution, and its share of all else."""
        return path["iteration"]

    def track_memory(self, path: dict[str, float]) -> float:
        """Peak of the process."""
        return path["memory"]

    track_wall.unit = track_iteration.unit = "s"  # pyright: ignore[reportFunctionMemberAccess]
    track_memory.unit = "bytes"  # pyright: ignore[reportFunctionMemberAccess]
