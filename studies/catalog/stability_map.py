"""When does it break: over time step, stiffness and method?"""

from massspring import Free, ImplicitVolume
from studies.catalog.study import Chart, Study
from studies.runs.case import Case
from studies.runs.recipes import TetrahedralBody
from studies.scene.library.ball_squeeze import BALL_SQUEEZE
from studies.store.schema import Status

FRAMES = 100
STEPS_PER_FRAME = (4, 6, 8, 12, 16, 24, 32, 48, 64, 96)
"""Steps that divide the frame, so that every time step is exactly the one on the axis."""
STIFFNESS = (0.25, 1.0, 4.0, 16.0, 64.0)
"""Factors on the tissue's 1.8 kPa: from fat to cartilage."""

STABILITY_MAP = Study(
    name="stability_map",
    question=__doc__ or "",
    cases=tuple(
        Case(
            BALL_SQUEEZE,
            TetrahedralBody(300, stiffness=factor),
            method,
            dt=BALL_SQUEEZE.duration / FRAMES / steps,
            frames=FRAMES,
            beyond_limit=True,
        )
        for method in (Free(), ImplicitVolume())
        for factor in STIFFNESS
        for steps in STEPS_PER_FRAME
    ),
    charts=(Chart("stability.png", "studies.plots.campaigns.stability:draw"),),
    columns=("volume_worst", "min_j"),
    main=True,
    expects=(Status.DIVERGED,),
)
