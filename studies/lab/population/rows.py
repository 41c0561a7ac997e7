"""Rows of a population, a body on a member each: of runs that are stored here, and of tables from other machines."""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import pandas as pd

from studies import Case, Metric, Run, StudyError, study_table
from studies.metrics.distribution import Distribution, distribution_of
from studies.runs.recipe_text import body_words, recipe_text

KEY, CODE = ["scene", "recipe"], "code"
"""KEY: of a row. CODE: first digits of the fingerprints of the codes that made a run and its reference."""


def key(case: Case) -> tuple[str, str]:
    return case.scene.name, recipe_text(case)


def rows_of(runs: Sequence[Run], columns: Sequence[str | Metric]) -> pd.DataFrame:
    """A row for each run: `study_table` and CODE."""
    codes = [[run.record, *([run.reference.record] if run.reference else [])] for run in runs]
    return study_table(runs, columns).assign(**{CODE: ["+".join(one.fingerprint[:8] for one in two) for two in codes]})


def merged(tables: Iterable[pd.DataFrame], cases: Iterable[Case]) -> pd.DataFrame:
    """The rows of several tables in the order of `cases`; where two have the same case, that of the first.

    Raises StudyError for rows that do not name their code, and for those of one recipe that different codes made: they
    are no population.
    """
    rows = pd.concat(tables, ignore_index=True).drop_duplicates(KEY)
    if unnamed := list(rows.loc[rows[CODE].isna() if CODE in rows else slice(None), "scene"]):
        raise StudyError(f"the row of {unnamed[0]} does not name the code that made it; run the member again")
    order = {key(case): at for at, case in enumerate(cases)}
    rows = rows.assign(at=[order.get(row) for row in rows[KEY].itertuples(index=False, name=None)]).dropna(subset="at")
    rows = rows.sort_values("at", ignore_index=True).drop(columns="at")
    judged = rows.loc[rows["reference"].notna() & (rows["reference"] != "")]
    for recipe, some in judged.groupby("recipe", sort=False):
        if len(codes := some.drop_duplicates(CODE)) > 1:
            (first, one), (second, other) = codes[["scene", CODE]].to_numpy()[:2]
            raise StudyError(
                f"different code made the rows of {first} ({one}) and {second} ({other}), recipe {recipe}: "
                "run the older one again"
            )
    return rows


@dataclass(frozen=True, eq=False)
class Group:
    """One body on the members of one organ."""

    organ: str
    case: Case
    """On the first member."""
    rows: pd.DataFrame

    @property
    def body(self) -> str:
        return body_words(self.case.body)

    def of(self, entry: Metric) -> Distribution:
        return distribution_of(self.rows, entry)


def groups(rows: pd.DataFrame, cases: Iterable[Case]) -> list[Group]:
    """Rows by organ and body, in their order; organs from files are "file". Rows of none of the cases are left out."""
    known = {key(case): case for case in cases}
    members: dict[tuple[str, str], tuple[Case, list[int]]] = {}
    for at, row in enumerate(rows[KEY].itertuples(index=False, name=None)):
        if case := known.get(row):
            name = case.scene.organ.shape, body_words(case.body)
            members.setdefault(name, (case, []))[1].append(at)
    return [Group(organ, case, rows.iloc[some]) for (organ, _), (case, some) in members.items()]
