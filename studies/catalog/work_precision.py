"""How much accuracy does run time buy: over mesh size, time step and method?"""

from massspring import Free, ImplicitVolume
from studies.catalog.study import Chart, Study
from studies.runs.case import BodyRecipe, Case
from studies.scenes.ball_clamped import BALL_CLAMPED
from studies.scenes.liver_press import LIVER_PRESS

NODES = (150, 300, 550, 1100)
FRACTIONS = (0.9, 0.3)
"""Of the stability limit."""

WORK_PRECISION = Study(
    name="work_precision",
    question=__doc__ or "",
    cases=tuple(
        Case(scene, BodyRecipe("tetrahedral", nodes), method, dt_fraction=fraction, timed=True)
        for scene in (BALL_CLAMPED, LIVER_PRESS)
        for nodes in NODES
        for fraction in FRACTIONS
        for method in (Free(), ImplicitVolume())
    ),
    charts=(Chart("work_precision.png", "studies.plots.work_precision:draw"),),
    columns=("real_time", "step_time", "force_error", "interior_error", "silhouette_error", "volume_worst"),
    main=True,
)
