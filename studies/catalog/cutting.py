"""Does an incision gape as in the reference, does a cut that closes bear a press, and do volumes follow?"""

from massspring import ImplicitVolume
from studies.catalog.study import Chart, Study
from studies.runs.case import BodyRecipe, Case
from studies.scene.library.ball_bisected import BALL_BISECTED
from studies.scene.library.ball_cut_pressed import BALL_CUT_PRESSED
from studies.scene.library.ball_incised import BALL_INCISED
from studies.scene.library.kidney_bisected import KIDNEY_BISECTED

BODIES = (
    BodyRecipe(nodes=350),
    BodyRecipe(nodes=350, law="cotangent", volumes="nodal"),
    BodyRecipe(nodes=700),
    BodyRecipe("quadratic", nodes=600),
    BodyRecipe("quadratic", nodes=1400, graded=True),
)
LONG = 0.8
"""Of the stability limit."""

CUTTING = Study(
    name="cutting",
    question=__doc__ or "",
    cases=tuple(
        Case(scene, body, ImplicitVolume(), dt_fraction=LONG)
        for scene in (BALL_INCISED, BALL_BISECTED, BALL_CUT_PRESSED, KIDNEY_BISECTED)
        for body in BODIES
    ),
    charts=(
        Chart("opening.png", "studies.plots.opening:draw"),
        Chart("force.png", "studies.plots.force_path:draw"),
        Chart("volume.png", "studies.plots.volume_history:draw"),
    ),
    columns=(
        "opening_error",
        "force_end",
        "mean_error",
        "overlap",
        "volume_worst",
        "volume_end",
        "min_j",
    ),
)
