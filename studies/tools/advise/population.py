"""What a recipe did on organs it was never chosen on: the bound that 95 of 100 members of a population kept."""

import re
from dataclasses import dataclass
from pathlib import Path

import pandas as pd

from studies.base.errors import StudyError
from studies.metrics.distribution import Distribution, distribution
from studies.metrics.judged import DISPLACEMENT, FORCE
from studies.metrics.metric import Metric
from studies.runs.case import Case
from studies.runs.recipe_text import recipe_text
from studies.store.record import Status
from studies.tools.advise.campaign import PUBLISHED, published_for

POPULATION = "population"
"""Folder and table of the study of random organs, which studies/lab/population draws."""


@dataclass(frozen=True)
class Unseen:
    """Errors of one recipe on the members of a population of the same organ."""

    organ: str
    force: Distribution
    displacement: Distribution
    where: str


def unseen(results: Path, case: Case) -> Unseen | None:
    """Of the recipe of a case on organs of the kind of its scene; None where no such member was ever run.

    Raises StudyError for a table that cannot be read.
    """
    roots = (results, results / PUBLISHED, published_for(results))
    tables = [root / POPULATION / f"{POPULATION}.csv" for root in roots]
    path = next((table for table in tables if table.is_file()), None)
    if path is None:
        return None
    try:
        rows = pd.read_csv(path)
        organ = case.scene.organ.shape
        rows = rows.loc[(rows["scene"].map(organ_of) == organ) & (rows["recipe"] == recipe_text(case))]
        force, displacement = (_of(rows, entry) for entry in (FORCE, DISPLACEMENT))
    except (KeyError, ValueError, OSError) as error:
        raise StudyError(
            f"{path} cannot be read ({error}); remove it, or run studies/lab/population/study.py again"
        ) from error
    return Unseen(organ, force, displacement, str(path)) if displacement.count else None


def organ_of(name: str) -> str | None:
    """The organ of a member by its name, such as liver_0_007; None where it is none."""
    found = re.fullmatch(r"([a-z]+)_\d+_\d+", name)
    return found[1] if found else None


def _of(rows: pd.DataFrame, entry: Metric) -> Distribution:
    """Of a column; what ended badly counts as lost."""
    column = f"{entry.name} [{entry.unit}]"
    values = rows[column].where(rows["status"] == Status.OK)
    floors = rows[f"{entry.name} floor [{entry.unit}]"]
    names = [str(name) for name in rows["scene"]]
    return distribution(dict(zip(names, values, strict=True)), dict(zip(names, floors, strict=True)))


def words(sample: Unseen) -> str:
    """ "on 40 other organs of this kind the median force error is 1.2 %, 95 % are below 8.1 % (6 to 12), ..."."""

    def bound(name: str, one: Distribution) -> str:
        low, high = one.bound_interval
        sign = "+" if name == "force" else ""
        middle = f"the median {name} error is {one.median:{sign}.2g} %"
        return f"{middle}, 95 % are below {one.bound:.2g} % ({low:.2g} to {high:.2g})"

    pairs = (("force", sample.force), ("displacement", sample.displacement))
    errors = [bound(name, one) for name, one in pairs if one.count]
    lost = f", {sample.displacement.lost} more failed" if sample.displacement.lost else ""
    return f"on {sample.displacement.count} other organs of this kind ({sample.organ}{lost}) {', '.join(errors)}"
