"""The texts that are read off the results of a study, where each is stored, and the page that shows it."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

from studies.metrics.run import Run
from studies.report.population import members_of, trust_of, worst_of
from studies.report.summary import ladder_of, recommended_of, results_of


@dataclass(frozen=True)
class Summary:
    """A text that is read off a study, and the page that shows it between its marks."""

    study: str
    file: str
    """Below the results folder."""
    page: str
    """Below the folder of README.md."""
    name: str
    """In the marks."""
    text: Callable[[Sequence[Run]], str]

    @property
    def marks(self) -> tuple[str, str]:
        """The lines of the page between which it stands."""
        return f"<!-- {self.name}: begin -->", f"<!-- {self.name}: end -->"


SUMMARIES = (
    Summary("volume_loss", "summary.md", "docs/findings.md", "results", results_of),
    Summary("accuracy", "accuracy/recommended.md", "docs/findings.md", "recommended", recommended_of),
    Summary("accuracy", "accuracy/ladder.md", "docs/paper.md", "ladder", ladder_of),
    Summary("population", "population/population.md", "docs/population.md", "population", members_of),
    Summary("population", "population/worst.md", "docs/population.md", "worst", worst_of),
    Summary("population", "population/trust.md", "docs/population.md", "trust", trust_of),
)
