"""How accurate is each quadratic body on organs nobody has seen, squeezed by 10 to 45 % between two planes?

`organbench run studies/lab/population/squeezes.py` brings it up to date.
"""

from studies.lab.population.draw import Population
from studies.lab.population.study import population_study, quadratic_for

MEMBERS = (
    Population("liver", 30, squeezed=True),
    Population("kidney", 30, squeezed=True),
    Population("spleen", 20, squeezed=True),
    Population("stomach", 10, squeezed=True),
    Population("bladder", 10, squeezed=True),
)

STUDY = population_study(MEMBERS, "squeezes", quadratic_for)
