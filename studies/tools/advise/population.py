"""What a recipe did on organs it was never chosen on: the bound that 95 of 100 members of a population kept."""

import re
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, replace
from pathlib import Path

import pandas as pd

from massspring import ImplicitVolume
from studies.base.errors import StudyError
from studies.catalog.accuracy import usual_mass
from studies.metrics.distribution import BOUND, Distribution, distribution, distribution_of
from studies.metrics.judged import DISPLACEMENT, FORCE
from studies.metrics.wish import Wish, usual_wish
from studies.runs.case import Case
from studies.runs.recipe_text import recipe_text
from studies.runs.recipes import BodyRecipe, QuadraticBody
from studies.scene.kind import has_wall, load_of
from studies.scene.scene import Scene
from studies.scene.tissues import TISSUES
from studies.tools.advise.campaign import PUBLISHED, published_for

PROBED = {"liver": False, "kidney": False, "stomach": True}
"""Organs of the population that a probe presses -> whether they are hollow."""
LOADED = {"spleen": "hanging", "bladder": "filled"}
"""Other organs of the population and their load; the rest are under a probe."""
SIZES, SPEED = (1194, 1594), "real_time [s/s]"
"""Surface nodes of the two adaptive bodies that ran on most members; column of simulated over computing time."""
OTHER_MASS = {"heavy": "stiffness", "stiffness": "heavy"}
"""Two masses whose bodies end within a tenth of the targets of each other (docs/accuracy.md)."""
NAMES = "force", "displacement"
POPULATION, PAIRS = "population", "pairs.csv"
"""Folder and table of the study of random organs, which studies/lab/population draws, and next to it the table of the
sizes of the errors of the bodies of SIZES, where the reference decides them."""


@dataclass(frozen=True)
class Unseen:
    """Errors of one recipe on the members of a population of the same organ."""

    organ: str
    force: Distribution
    displacement: Distribution
    where: str
    cost: float = float("nan")
    """Median of computing over simulated time [1]."""
    mass: str = ""
    """That of the members where the recipe has the other one of OTHER_MASS."""
    undecided: int = 0
    """Members that do not count, because the reference does not decide the error of the displacement."""

    def meets(self, wish: Wish) -> bool:
        """Whether 95 of 100 members do."""
        pairs = (self.force.bound, wish.force), (self.displacement.bound, wish.displacement)
        return all(bound is None or error <= bound for error, bound in pairs)

    @property
    def promise(self) -> str:
        """ "95 of 100 random livers: force within 1.7 %, mean displacement within 0.95 %"."""
        errors = f"force within {self.force.bound:.2g} %, mean displacement within {self.displacement.bound:.2g} %"
        count = self.displacement.count
        more = f" ({self.undecided} more undecided)" if self.undecided else ""
        return f"{int(BOUND * count)} of {count} random {self.organ}s{more}: {errors}"


def unseen(results: Path, case: Case) -> Unseen | None:
    """Of the recipe of a case on organs of the kind of its scene, for a probed organ from a file those of its tissue;
    None where no such member was ever run.

    Raises StudyError for a table that cannot be read.
    """
    scene, organ = case.scene, case.scene.organ.shape
    if organ == "file" and load_of(scene) == "probe":
        organ = drawn_for(scene, next((name for name, tissue in TISSUES.items() if tissue == scene.tissue), ""))
    return _unseen(results, case, organ)


def drawn_for(scene: Scene, tissue: str) -> str:
    """The probed organs of the population that stand for those of a tissue: those it is named after or, where these
    were not probed or are not as hollow as that of the scene, livers or stomachs."""
    hollow = has_wall(scene)
    return tissue if PROBED.get(tissue) == hollow else "stomach" if hollow else "liver"


def supported(results: Path, scene: Scene, tissue: str) -> tuple[Case, Unseen] | None:
    """The smallest adaptive body with which 95 of 100 random organs under a probe meet the usual targets, the largest
    where none does, as a case of `scene`; None where no such member was ever run.

    The organs are those of `drawn_for`. Raises StudyError for a table that cannot be read.
    """
    organ, best = drawn_for(scene, tissue), None
    for nodes in SIZES:
        body = QuadraticBody(nodes, graded="adaptive", mass=usual_mass(scene))
        case = Case(scene, body, ImplicitVolume(), dt_fraction=0.8)
        sample = _unseen(results, case, organ)
        if sample is not None:
            best = case, sample
            if sample.meets(usual_wish(scene)):
                break
    return best


def _unseen(results: Path, case: Case, organ: str) -> Unseen | None:
    found = _with_recipe(results, case, organ)
    if found is None and (mass := OTHER_MASS.get(case.body.mass)):
        found = _with_recipe(results, replace(case, body=replace(case.body, mass=mass)), organ)
        found = found and replace(found, mass=mass)
    return found


def _with_recipe(results: Path, case: Case, organ: str) -> Unseen | None:
    recipe, body = recipe_text(case), case.body
    roots = (results, results / PUBLISHED, published_for(results))
    tables = [root / POPULATION / f"{POPULATION}.csv" for root in roots]
    path = next((table for table in tables if table.is_file()), None)
    if path is None:
        return None
    with _reading(path):
        rows = pd.read_csv(path)
        rows = rows.loc[(rows["scene"].map(organ_of) == organ) & (rows["recipe"] == recipe)]
        force, displacement = (distribution_of(rows, entry) for entry in (FORCE, DISPLACEMENT))
        cost = 1.0 / rows[SPEED].median() if SPEED in rows else float("nan")
    undecided = 0
    if len(rows) and (pairs := path.with_name(PAIRS)).is_file() and is_of_pairs(body):
        with _reading(pairs):
            more = pd.read_csv(pairs)
            more = more.loc[more["organ"] == organ]
            if len(more) >= len(rows):
                force, displacement = (_sizes(more, name, body.nodes) for name in NAMES)
                undecided = len(more) - displacement.count
    return Unseen(organ, force, displacement, str(path), cost, undecided=undecided) if displacement.count else None


@contextmanager
def _reading(path: Path) -> Iterator[None]:
    """Turns what is wrong with the table at `path` into a StudyError."""
    try:
        yield
    except (KeyError, ValueError, OSError) as error:
        raise StudyError(
            f"{path} cannot be read ({error}); remove it, or run studies/lab/population/study.py again"
        ) from error


def is_of_pairs(body: BodyRecipe) -> bool:
    """Whether PAIRS has a body."""
    return isinstance(body, QuadraticBody) and body.graded == "adaptive" and body.nodes in SIZES


def _sizes(members: pd.DataFrame, name: str, nodes: int) -> Distribution:
    """Of the errors that the reference decides."""
    known = members.set_index("scene")[f"{name}_{nodes}"].dropna()
    return distribution(known.to_dict(), {})


def organ_of(name: str) -> str | None:
    """The organ of a member by its name, such as liver_0_007; None where it is none."""
    found = re.fullmatch(r"([a-z]+)_\d+_\d+", name)
    return found[1] if found else None


def words(sample: Unseen) -> str:
    """ "on 40 other organs (liver, under a probe) the median force error is 1.2 %, 95 % are below 8 %, ..."."""

    def bound(name: str, one: Distribution) -> str:
        low, high = one.bound_interval
        middle = f"the median {name} error is {one.median:.2g} %"
        return f"{middle}, 95 % are below {one.bound:.2g} % ({low:.2g} to {high:.2g})"

    errors = [
        bound(name, one) for name, one in zip(NAMES, (sample.force, sample.displacement), strict=True) if one.count
    ]
    lost = f", {sample.displacement.lost} more failed" if sample.displacement.lost else ""
    lost += f", {sample.undecided} more that the reference does not decide" if sample.undecided else ""
    mass = {"": "", "stiffness": ", masses by stiffness", "heavy": ", heavy masses"}[sample.mass]
    kind = f"{sample.organ}, {LOADED.get(sample.organ, 'under a probe')}"
    return f"on {sample.displacement.count} other organs ({kind}{mass}{lost}) {', '.join(errors)}"
