"""Organs nobody has seen: members of a population drawn at random within anatomical ranges, each a scene of its own."""

from studies.catalog.population.draw import Population, member
from studies.catalog.population.folder import Placed, placed_organs, study_on
from studies.catalog.population.ranges import RANGES, Ranges
from studies.catalog.population.study import POPULATION, population_study, study_of_recipes

__all__ = [
    "POPULATION",
    "RANGES",
    "Placed",
    "Population",
    "Ranges",
    "member",
    "placed_organs",
    "population_study",
    "study_of_recipes",
    "study_on",
]
