"""`organbench calibrate`: springs fitted to the reference, and what such a fit is worth."""

from pathlib import Path
from typing import Annotated

import typer

from studies.base.errors import StudyError
from studies.base.lookup import lookup
from studies.cli.progress import TerminalProgress
from studies.cli.terminal import Results, console, say
from studies.runs.case import BodyRecipe
from studies.sweep.find_scene import SUFFIX
from studies.tools.calibrate.calibrate import calibrate as calibrated_on
from studies.tools.calibrate.calibrate import starting_recipe
from studies.tools.calibrate.folds import folds_of
from studies.tools.calibrate.parameters import KINDS
from studies.tools.calibrate.stored import Calibration, calibration_path, read_calibration
from studies.tools.calibrate.words import lines_of

BOTH = "both"


def calibrate(
    organ: Annotated[str, typer.Argument(help="an organ, or a FILE.json with a stored calibration to print")],
    body: Annotated[str, typer.Option(help="tetrahedral (one volume), surface (the paper's), or both")] = BOTH,
    nodes: Annotated[int, typer.Option(min=1, help="surface nodes")] = 550,
    jobs: Annotated[int, typer.Option(min=1, help="processes for references and first runs")] = 2,
    results: Results = Path("results"),
) -> None:
    """Fit a few numbers of a body to the reference in some scenes of an organ, and judge them in others.

    For a tetrahedral body the stiffness, for a surface body also the weight of the springs to its axis.
    """
    if organ.endswith(".json"):
        _tell(read_calibration(organ))
        return
    if organ.endswith(SUFFIX):
        raise StudyError(
            "springs are fitted in the scenes that the catalogue has of an organ, not in those of a file; give an "
            "organ, such as liver"
        )
    folds_of(organ)
    kind = lookup(body, (*KINDS, BOTH), "body")
    for start in [starting_recipe(organ, each, nodes) for each in (KINDS if kind == BOTH else (kind,))]:
        calibration = _calibrated(organ, start, results, jobs)
        _tell(calibration)
        say(f"stored in {calibration_path(results, calibration)}")


def _calibrated(organ: str, start: BodyRecipe, results: Path, jobs: int) -> Calibration:
    with TerminalProgress(console, (), jobs) as progress:
        return calibrated_on(organ, start, results, jobs, progress, progress.compiling)


def _tell(calibration: Calibration) -> None:
    for line in lines_of(calibration):
        say(line)
