"""The promised speeds of the reference: assembly, a Newton iteration, a path with contact."""

from reference_fem.bench import contact_path, iteration_costs
from studies.metrics.timing.protocol import pinned


class Iteration:
    """Least of several repeats on one pinned core."""

    timeout = 600.0

    def setup_cache(self) -> dict[str, float]:
        """What an iteration costs, by part."""
        with pinned(threads=1):
            return iteration_costs(cells=7)

    def track_assembly(self, costs: dict[str, float]) -> float:
        """Tangent and residual."""
        return costs["assembly_s"]

    def track_iteration(self, costs: dict[str, float]) -> float:
        """Assembly, factors and solution."""
        return costs["iteration_s"]

    track_assembly.unit = track_iteration.unit = "s"  # pyright: ignore[reportFunctionMemberAccess]


class Path:
    """Ten load steps with contact, 49,000 unknowns."""

    timeout = 1200.0

    def setup_cache(self) -> dict[str, object]:
        """The path, once."""
        with pinned(threads=1):
            return contact_path(cells=12, steps=10)

    def track_wall(self, path: dict[str, float]) -> float:
        """Of the whole path."""
        return path["wall_s"]

    def track_memory(self, path: dict[str, float]) -> float:
        """Peak of the process."""
        return path["peak_bytes"]

    track_wall.unit, track_memory.unit = "s", "bytes"  # pyright: ignore[reportFunctionMemberAccess]
