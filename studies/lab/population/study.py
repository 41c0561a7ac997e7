"""How accurate is each body on organs nobody has seen: the median, and the worst of twenty?

`organbench run studies/lab/population/study.py` brings it up to date.
"""

from collections.abc import Callable, Sequence
from dataclasses import replace

from massspring import ImplicitVolume
from studies import BodyRecipe, Case, Chart, Scene, Study, SurfaceBody, TetrahedralBody
from studies.catalog.accuracy import FINEST, LONG, SHORT, even, graded
from studies.lab.population.draw import Population

POPULATION = "population"
MEMBERS = (
    Population("liver", 100),
    Population("kidney", 100),
    Population("stomach", 50),
    Population("spleen", 30),
    Population("bladder", 30),
)
Recipes = tuple[tuple[BodyRecipe, float], ...]
"""Bodies and their step over the limit."""
NODES = 550
"""Surface nodes of the linear bodies, of a hollow organ as many again on its lumen."""


def recipes_for(scene: Scene) -> Recipes:
    """The bodies that every member gets: the paper's; one volume; one volume per node; and the quadratic ones."""
    axis = "centre_line" if "wall" in scene.organ.parameters else "straight"
    return (
        (SurfaceBody(NODES, axis=axis), SHORT),
        (TetrahedralBody(nodes=NODES), SHORT),
        (TetrahedralBody(nodes=NODES, law="cotangent", volumes="nodal"), SHORT),
        *quadratic_for(scene),
    )


def quadratic_for(scene: Scene) -> Recipes:
    """The fastest even quadratic body; the graded ones of the accuracy study, and a finer one, which shows what a
    larger budget of computing time is worth."""
    budgets = (*graded(scene), *(replace(body, nodes=FINEST) for body in graded(scene)[-1:]))
    return tuple((body, LONG) for body in (even(scene)[0], *budgets))


def population_study(
    populations: Sequence[Population] = MEMBERS,
    name: str = POPULATION,
    recipes: Callable[[Scene], Recipes] = recipes_for,
) -> Study:
    """Every recipe on every member, one member after the other. Organs take turns: a study cut short has whole members
    of each. The first member of each organ is timed.

    Raises StudyError for a member that cannot be drawn.
    """
    drawn = [population.scenes() for population in populations]
    first = [scenes[0] for scenes in drawn]
    turns = [scenes[at] for at in range(max(map(len, drawn), default=0)) for scenes in drawn if at < len(scenes)]
    return Study(
        name=name,
        question="How accurate is each body on organs nobody has seen: the median, and the worst of twenty?",
        cases=tuple(
            Case(scene, body, ImplicitVolume(), dt_fraction=fraction, timed=scene in first)
            for scene in turns
            for body, fraction in recipes(scene)
        ),
        charts=(
            Chart("distributions.png", "studies.lab.population.charts:draw"),
            Chart("front.png", "studies.lab.population.charts:draw_front"),
        ),
        counts_losses=True,
        scene_by_scene=True,
        columns=(
            "force_end",
            "mean_error",
            "shape_error",
            "shape_volume",
            "interior_error",
            "volume_worst",
            "min_j",
            "real_time",
            "real_time_cpu",
            "sway",
        ),
    )


STUDY = population_study()
