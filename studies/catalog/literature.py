"""How do the literature's other contestants do: angular springs, chain mail, linear modes, precomputed response?"""

from massspring import AngularSprings, ChainMail, ElasticResponse, ImplicitVolume, LinearModes
from studies.catalog.accuracy import LONG, SHORT, headline, judged_at_rest
from studies.catalog.study import Chart, Study
from studies.runs.case import Case
from studies.runs.recipes import QuadraticBody, TetrahedralBody
from studies.scene.kind import has_wall
from studies.scene.scene import Scene
from studies.store.schema import Status

STRAIGHT = TetrahedralBody(nodes=550)
"""Springs on edges: what angular springs are added to, and the links of a chain mail."""
WALL = TetrahedralBody(nodes=800)
"""The same for a hollow organ, whose coarser surface folds."""
CURVED = QuadraticBody(594, contact="nodes")
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


def ours(scene: Scene) -> tuple[Case, ...]:
    """What they are compared with: one volume on the springs of the first, and the body that is recommended."""
    springs = WALL if has_wall(scene) else STRAIGHT
    return (
        Case(scene, springs, ImplicitVolume(), dt_fraction=SHORT, timed=True),
        Case(scene, headline(scene), ImplicitVolume(), dt_fraction=LONG, timed=True),
    )


LITERATURE_STUDY = Study(
    name="literature",
    question=__doc__ or "",
    cases=tuple(case for scene in judged_at_rest() for case in (*ours(scene), *literature_cases(scene))),
    charts=(Chart("literature.png", "studies.plots.work_precision:draw"),),
    columns=(
        "force_end",
        "mean_error",
        "shape_error",
        "shape_volume",
        "real_time",
        "real_time_cpu",
        "step_time",
        "volume_worst",
        "min_j",
        "surface_error",
        "sway",
    ),
    expects=(Status.FOLDED, Status.INVERTED),  # springs with one volume, and the hanging spleen: docs/accuracy.md
)
