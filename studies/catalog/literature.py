"""The other contestants of the literature, beside ours in every scene that ends at rest; no study of its own."""

from massspring import AngularSprings, ChainMail, ElasticResponse, LinearModes
from studies.runs.case import BodyRecipe, Case
from studies.scene.kind import has_wall
from studies.scene.scene import Scene

STRAIGHT = BodyRecipe(nodes=550)
"""Springs on edges: what angular springs are added to, and the links of a chain mail."""
WALL = BodyRecipe(nodes=800)
"""The same for a hollow organ, whose coarser surface folds."""
CURVED = BodyRecipe("quadratic", 594, contact="nodes")
"""Linear elements of linear shape would lock; obstacles meet the nodes."""
FRAME_STEP = 0.02
"""Of what no stability limits [s]."""


def literature_cases(scene: Scene) -> tuple[Case, ...]:
    """Each contestant once, whether it can do the scene or not: what it cannot is a skip with its reason."""
    springs = WALL if has_wall(scene) else STRAIGHT
    return (
        Case(scene, springs, AngularSprings(), timed=True),
        Case(scene, springs, ChainMail(), dt=FRAME_STEP, timed=True),
        Case(scene, CURVED, LinearModes(), dt=FRAME_STEP, timed=True),
        Case(scene, CURVED, ElasticResponse(), dt=FRAME_STEP, timed=True),
    )
