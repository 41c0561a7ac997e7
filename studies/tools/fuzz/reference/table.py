"""What a campaign against the reference stores."""

from collections.abc import Iterable
from io import BytesIO

import numpy as np
import pandas as pd

from studies.tools.fuzz.campaign import counts
from studies.tools.fuzz.outcome import Outcome
from studies.tools.fuzz.reference.outcome import ReferenceOutcome

CHOICES = "element", "law", "kappa/mu", "load", "body"


def counts_by_choice(table: pd.DataFrame) -> pd.DataFrame:
    """How many trials ended how: a row for each value of some choices and one for all, a column for each status."""
    low = 2 * np.floor(np.log10(table["bulk"]) / 2.0).astype(int)
    trials = table.assign(**{"kappa/mu": [f"1e{k} to 1e{k + 2}" for k in low], "body": table["shape"]})
    rows = []
    for choice in CHOICES:
        part = counts(trials, choice).reset_index(names="value")
        rows.append(part[part["value"] != "all"].assign(choice=choice))
    rows.append(part[part["value"] == "all"].assign(choice="all"))
    whole = pd.concat(rows, ignore_index=True)
    return whole.reindex(columns=["choice", *(name for name in whole if name != "choice")])


def last_states(outcomes: Iterable[Outcome]) -> bytes:
    """Of each trial that did not reach its end, the last state that converged: its number, t [s], u and p, as .npz."""
    arrays = dict[str, np.ndarray]()
    for outcome in outcomes:
        if not isinstance(outcome, ReferenceOutcome) or outcome.status not in ("not-converged", "timed-out"):
            continue
        equilibrium = outcome.reached.equilibrium
        if equilibrium is not None:
            parts = {"t": np.asarray(equilibrium.t), "u": equilibrium.u, "p": equilibrium.p}
            arrays |= {f"{outcome.trial.number}/{name}": values for name, values in parts.items()}
    target = BytesIO()
    np.savez_compressed(target, allow_pickle=False, **arrays)
    return target.getvalue()
