"""How a trial ends: ok, or a failure with a name; everything else is unexplained. And many trials."""

import time
import warnings
from collections.abc import Callable, Iterable
from contextlib import closing
from dataclasses import asdict, dataclass

import numpy as np
import pandas as pd

from massspring import History, MassSpringError, Plane, Probe, Setup, simulate
from studies.base.errors import StudyError
from studies.base.processes import run_each
from studies.geometry.mesh.organ_mesh import signed_volume
from studies.runs.status import folding, tunnelling
from studies.store.schema import Status
from studies.sweep.local import environment
from studies.tools.fuzz.trial import Trial
from studies.tools.fuzz.world import setup_of

UNEXPLAINED = "unexplained"
SECONDS = 20.0
"""After which a trial is given up."""
DRIFT = 0.01
"""A kept volume this far off has drifted, as in studies.runs."""
INSIDE = 1e-2
"""Of the body's size: a surface this deep in an obstacle has penetrated it."""
ROUND_OFF = {"float64": 1e-9, "float32": 1e-4}
"""Of the body's size and of its distance from the origin."""


@dataclass(frozen=True)
class Outcome:
    """Of a trial."""

    trial: Trial
    status: str
    """ "ok", "refused", "diverged", "blocked", "folded", "inverted", "drifted", "penetrated", "timed-out", or
    UNEXPLAINED."""
    message: str
    seconds: float


def tried(trial: Trial) -> Outcome:
    """What comes of a trial. Never raises: an error that is not ours is the finding."""
    begun = time.perf_counter()
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        try:
            setup = setup_of(trial)
            history = simulate(setup, time_limit=SECONDS)
            status, message = history.outcome, history.message
            if status == "finished":
                wrong = broken(setup, history)
                status, message = (UNEXPLAINED, wrong) if wrong else named(setup, history)
        except (MassSpringError, StudyError) as refused:
            status, message = "refused", str(refused)
        except Exception as error:  # whatever it is, it has no name
            status, message = UNEXPLAINED, f"{type(error).__name__}: {(str(error).splitlines() or [''])[0]}"
    return Outcome(trial, status, message, time.perf_counter() - begun)


def named(setup: Setup, history: History) -> tuple[str, str]:
    """What a finished run is called, and why: ok, tunnelled, folded, inverted, drifted or penetrated."""
    reason = tunnelling(history.inside)
    if reason:
        return Status.TUNNELLED, reason
    status, reason = folding(history.min_j, shaped=setup.positions is not None)
    if reason:
        return status, reason
    deepest = float(np.max(history.penetration[-1], initial=0.0))
    if deepest > INSIDE * setup.body.size:
        return "penetrated", f"the surface is {1e3 * deepest:.3g} mm deep in an obstacle"
    off = float(np.max(np.abs(history.volume[-1] / history.volume_target[-1] - 1.0)))
    if setup.method.volume_tol is not None and off > DRIFT:
        return "drifted", f"a kept volume ends {100 * off:.3g} % off"
    return "ok", ""


def broken(setup: Setup, history: History) -> str:
    """The first truth that a finished run does not meet, as a sentence; "" when all hold. Measured from its positions,
    not from its records."""
    body, final, end = setup.body, history.final, setup.clock.duration
    for name in ("volume", "pressure", "contact_force", "penetration", "held_force", "final"):
        if not np.isfinite(getattr(history, name)).all():
            return f"the history of '{name}' has a number that is not finite"
    allowed = ROUND_OFF[setup.precision] * max(body.size, float(np.abs(body.rest).max()))
    # The recorded volume of a body that keeps its whole is what its surface encloses.
    whole = np.array_equal(np.unique(np.abs(getattr(body.kept, "share", np.ones(1)).data)), [1.0])
    if body.kept.count == 1 and whole:
        volume = signed_volume(final - final.mean(axis=0), body.triangles.astype(np.int64))
        if abs(volume - float(history.volume[-1, 0])) > allowed * body.size**2:
            return f"the recorded volume is {history.volume[-1, 0]:.6g} m³, the surface encloses {volume:.6g} m³"
    for attachment in setup.attachments:
        positions = body.rest[attachment.nodes] + attachment.path(end)
        off = float(np.abs(final[attachment.nodes] - positions).max())
        if off > allowed:
            return f"a clamped node is {off:.3g} m from its prescribed position"
    for number, obstacle in enumerate(setup.obstacles):
        if isinstance(obstacle, Probe):
            continue
        gap, record = obstacle.gap(final, end), float(history.penetration[-1, number])
        least, most = depths(gap, body.surface_nodes, body.contact_facets)
        # Between nodes a round obstacle may be deeper.
        if record < least - allowed or (isinstance(obstacle, Plane) and record > most + allowed):
            depth = f"{least:.3g} to {most:.3g} m inside obstacle {number}"
            return f"the surface is {depth}, the record says {record:.3g} m"
    return ""


def depths(gap: np.ndarray, nodes: np.ndarray, curved: np.ndarray) -> tuple[float, float]:
    """How deep the deepest of the surface `nodes` is in a plane, and how deep the surface is at most, from the `gap` of
    each node [m], (n,): a curved facet, rows of `curved` (f, 6), lies within its Bézier control points."""
    least = most = max(0.0, -float(gap[nodes].min()))
    if len(curved):
        corners, sides = gap[curved[:, :3]], gap[curved[:, 3:]]
        middles = 0.5 * (corners + np.roll(corners, -1, axis=1))
        most = max(most, -float((sides + (sides - middles)).min()))
    return least, most


def run_trials(trials: Iterable[Trial], jobs: int, done: Callable[[Outcome], object]) -> list[Outcome]:
    """What came of every trial, in their order; `done` hears of each. A process that dies costs its trial alone."""
    outcomes: dict[int, Outcome] = {}
    with closing(run_each(list(trials), jobs, tried, environment=environment())) as ended:
        for trial, outcome, cause in ended:
            outcomes[trial.number] = outcome if cause is None else Outcome(trial, UNEXPLAINED, cause, float("nan"))
            done(outcomes[trial.number])
    return [outcomes[number] for number in sorted(outcomes)]


def table_of(outcomes: Iterable[Outcome]) -> pd.DataFrame:
    """A row for each trial."""
    rows = ({**asdict(o.trial), "status": o.status, "message": o.message, "seconds": o.seconds} for o in outcomes)
    return pd.DataFrame(rows)


def counts(table: pd.DataFrame) -> pd.DataFrame:
    """How many trials ended how: a row for each method, a column for each status, and of all."""
    tally = pd.DataFrame(pd.crosstab(table["method"], table["status"], margins=True, margins_name="all"))
    first = [name for name in ("ok", "refused") if name in tally]
    return tally.reindex(columns=[*first, *sorted(set(tally) - {*first, "all"}), "all"])
