"""The texts that are read off the results of a study, and where each is stored."""

from collections.abc import Callable, Sequence

from studies.metrics.run import Run
from studies.report.summary import ladder_of, recommended_of, results_of

SUMMARIES: dict[str, dict[str, Callable[[Sequence[Run]], str]]] = {
    "volume_loss": {"summary.md": results_of},
    "accuracy": {"accuracy/recommended.md": recommended_of, "accuracy/ladder.md": ladder_of},
}
"""Study -> file below the results folder -> its text."""
