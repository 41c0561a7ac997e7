"""A calibration as lines for people, at most 80 letters wide."""

from collections.abc import Iterable
from textwrap import wrap

from studies.metrics.cells import MINUS, MISSING
from studies.tools.calibrate.parameters import parameters_of
from studies.tools.calibrate.stored import Calibration, SceneErrors, Trial
from studies.tools.calibrate.verdict import Compared, Verdict, worst

WIDTH = 80
HEAD = (
    f"  {'':<14}{'':<8}{'force [%]':>23}{'mean error [%]':>25}",
    f"  {'scene':<14}{'':<8}{'before':>9}{'after':>8}{'±':>6}{'before':>11}{'after':>8}{'±':>6}",
)
SENTENCES = {
    Verdict.HOLDS: "the fit generalises: unseen scenes gain at least half as much",
    Verdict.MEMORISES: "the fit overfits: unseen scenes gain less than half as much",
    Verdict.UNRESOLVED: "not resolvable: the fit changes less than the uncertainty of the reference",
}


def lines_of(calibration: Calibration) -> list[str]:
    """A calibration in words, line by line."""
    start = calibration.start
    lines = [f"{calibration.organ}: {start.series} body, {start.nodes:,} surface nodes", *HEAD]
    for trial in calibration.trials:
        lines += _trial(calibration, trial)
    for quantity in ("force", "displacement"):
        verdicts = [verdict for trial in calibration.trials if (verdict := getattr(trial, quantity)) is not None]
        if verdicts:
            lines += _wrapped(f"{quantity}: {SENTENCES[worst(verdicts)]}", "")
    own = " and ".join(calibration.fitted)
    return [*lines, *_wrapped(f"stored recipe, fitted on {own}: {_values(calibration, calibration.parameters)}", "")]


def _trial(calibration: Calibration, trial: Trial) -> Iterable[str]:
    yield from _wrapped(f"fitted on {' and '.join(trial.fitted)}: {_values(calibration, trial.parameters)}", "  ")
    for errors in trial.errors:
        yield _row(errors)
    by_quantity = {"force": trial.force, "displacement": trial.displacement}
    verdicts = ", ".join(f"{name} {verdict}" for name, verdict in by_quantity.items() if verdict is not None)
    yield from _wrapped("; ".join([f"verdict: {verdicts or 'nothing to compare'}", *trial.remarks]), "    ")


def _values(calibration: Calibration, values: dict[str, float]) -> str:
    """ "stiffness 1.35 (was 1)"."""
    first = {parameter.name: parameter.read(calibration.start) for parameter in parameters_of(calibration.start)}
    return ", ".join(f"{name} {value:.4g} (was {first[name]:.4g})" for name, value in values.items())


def _row(errors: SceneErrors) -> str:
    role = "fitted" if errors.fitted else "judged"
    return f"  {errors.scene:<14}{role:<8}{_cells(errors.force, 9, '+')}{_cells(errors.displacement, 11, '')}"


def _cells(pair: Compared | None, first: int, sign: str) -> str:
    if pair is None:
        return f"{MISSING:>{first}}{MISSING:>8}{MISSING:>6}"
    after = "lost" if pair.after is None else f"{pair.after:{sign}.1f}"
    return f"{f'{pair.before:{sign}.1f}':>{first}}{after:>8}{pair.uncertainty:>6.1f}".replace("-", MINUS)


def _wrapped(text: str, indent: str) -> list[str]:
    return wrap(text, WIDTH, initial_indent=indent, subsequent_indent=indent + "  ")
