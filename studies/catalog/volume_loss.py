"""How much volume does each model lose, and how far is it from the reference? The paper's Figure 3."""

from massspring import Free, ImplicitVolume
from studies.catalog.study import Chart, Study
from studies.runs.case import Case
from studies.runs.recipes import SurfaceBody, TetrahedralBody
from studies.scene.library import BALL_CLAMPED, BALL_SQUEEZE, LIVER_PRESS, LIVER_PROBE
from studies.store.schema import Status

TETRAHEDRAL, SURFACE = TetrahedralBody(), SurfaceBody()
REPLAYED = (BALL_SQUEEZE, LIVER_PRESS, LIVER_PROBE)
"""The scenes of which all bodies can be seen move (studies.runs.surface_frames)."""
FINE_STEP = 0.05
"""The headline is repeated at a tenth of the step, so that it is seen not to depend on it."""
CHARTS = (
    Chart("volume.png", "studies.plots.volume_history:draw"),
    Chart("force.png", "studies.plots.force_path:draw"),
    Chart("accuracy.png", "studies.plots.accuracy:draw"),
)
COLUMNS = (
    "volume_worst",
    "force_end",
    "interior_error",
    "mean_error",
    "shape_error",
    "shape_volume",
    "silhouette_error",
    "min_j",
    "force_error",
    "surface_error",
    "pressure_error",
)

VOLUME_LOSS = Study(
    name="volume_loss",
    question=__doc__ or "",
    cases=(
        *(
            Case(scene, body, method, recorded=("surface",) if scene in REPLAYED else ())
            for scene in (BALL_SQUEEZE, BALL_CLAMPED, LIVER_PRESS, LIVER_PROBE)
            for body in (TETRAHEDRAL, SURFACE)
            for method in (Free(), ImplicitVolume())
        ),
        *(Case(BALL_SQUEEZE, body, ImplicitVolume(), dt_fraction=FINE_STEP) for body in (TETRAHEDRAL, SURFACE)),
    ),
    charts=(*CHARTS, Chart("squeeze.png", "studies.plots.squeeze:draw")),
    columns=(*COLUMNS, "volume_end"),
    main=True,
    expects=(Status.FOLDED,),  # ball_clamped, springs with one volume
)
