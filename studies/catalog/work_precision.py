"""How much accuracy does run time buy: with the paper's body, one volume, and quadratic elements?"""

from massspring import ImplicitVolume
from studies.catalog.accuracy import LONG, SHORT, even, headline_case, linear_bodies
from studies.catalog.study import Chart, Study
from studies.runs.case import Case
from studies.scene.library.ball_clamped import BALL_CLAMPED
from studies.scene.library.liver_press import LIVER_PRESS
from studies.scene.scene import Scene
from studies.store.schema import Status


def cases(scene: Scene) -> tuple[Case, ...]:
    """Of the study accuracy: the paper's body and one volume in two sizes, the coarsest even quadratic body and the
    headline."""
    plain = [body for body in linear_bodies(scene) if body.volumes == "scene"]
    coarse = even(scene)[0]
    chosen = [*((body, SHORT) for body in plain), (coarse, LONG)]
    others = [Case(scene, body, ImplicitVolume(), dt_fraction=step, timed=True) for body, step in chosen]
    return (*others, headline_case(scene))


WORK_PRECISION = Study(
    name="work_precision",
    question=__doc__ or "",
    cases=(*cases(BALL_CLAMPED), *cases(LIVER_PRESS)),
    charts=(Chart("work_precision.png", "studies.plots.work_precision:draw"),),
    columns=(
        "force_end",
        "mean_error",
        "shape_error",
        "shape_volume",
        "real_time",
        "real_time_cpu",
        "step_time",
        "interior_error",
        "silhouette_error",
        "volume_worst",
    ),
    main=True,
    expects=(Status.FOLDED,),  # springs with one volume, as in the study accuracy
)
