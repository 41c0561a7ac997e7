"""How accurate is the finest body on livers whose margins are as thin as in life, and how much does a finer one help?

`organbench run studies/lab/population/thin.py` brings it up to date.
"""

from dataclasses import replace

from studies import Scene
from studies.lab.population.draw import Population
from studies.lab.population.study import Recipes, population_study, quadratic_for

FINER = 2390
"""Surface nodes of the body that `organbench place` takes where the finest of the others loses the shape."""


def finest_for(scene: Scene) -> Recipes:
    """The finest body of the other populations, and the finer one."""
    body, step = quadratic_for(scene)[-1]
    return (body, step), (replace(body, nodes=FINER), step)


STUDY = population_study((Population("thin_liver", 30),), "thin", finest_for)
