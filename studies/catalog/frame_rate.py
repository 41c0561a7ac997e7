"""What does a frame cost, with and without the constraint, and which deadlines does it meet?"""

from massspring import Free, ImplicitVolume
from studies.catalog.study import Chart, Study
from studies.runs.case import Case
from studies.runs.recipes import SurfaceBody, TetrahedralBody
from studies.scene.library.ball_squeeze import BALL_SQUEEZE
from studies.scene.library.liver_probe import LIVER_PROBE

BODIES = (
    (BALL_SQUEEZE, SurfaceBody(550)),
    (BALL_SQUEEZE, TetrahedralBody(550)),
    (LIVER_PROBE, SurfaceBody(550)),
    (LIVER_PROBE, TetrahedralBody(550)),
    (BALL_SQUEEZE, SurfaceBody(2200)),
    (BALL_SQUEEZE, TetrahedralBody(2200)),
)

FRAME_RATE = Study(
    name="frame_rate",
    question=__doc__ or "",
    cases=tuple(
        Case(scene, body, method, timed=True) for scene, body in BODIES for method in (Free(), ImplicitVolume())
    ),
    charts=(
        Chart("frame_time.png", "studies.plots.frame_time:draw"),
        Chart("cost_ratio.png", "studies.plots.cost_ratio:draw"),
    ),
    columns=("step_time", "frame_time", "frame_cpu", "frame_time_p99", "real_time", "real_time_cpu", "volume_worst"),
    main=True,
)
