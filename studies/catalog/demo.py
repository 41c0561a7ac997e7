"""Three bodies of one ball next to its published reference: springs alone, one kept volume, the recommended body."""

from massspring import Free, ImplicitVolume
from studies.catalog.study import Chart, Study
from studies.runs.case import Case
from studies.runs.recipes import QuadraticBody, TetrahedralBody
from studies.scene.library import BALL_SQUEEZE

BALL = TetrahedralBody(150)
RECOMMENDED = QuadraticBody(594, mass="stiffness")

DEMO = Study(
    name="demo",
    question="What do a kept volume and quadratic elements change on a squeezed ball?",
    cases=(
        Case(BALL_SQUEEZE, BALL, Free(), timed=True, recorded=("surface",)),
        Case(BALL_SQUEEZE, BALL, ImplicitVolume(), timed=True, recorded=("surface",)),
        Case(BALL_SQUEEZE, RECOMMENDED, ImplicitVolume(), dt_fraction=0.8, timed=True, recorded=("surface",)),
    ),
    charts=(
        Chart("squeeze.png", "studies.plots.squeeze:draw"),
        Chart("force.png", "studies.plots.force_path:draw"),
    ),
    columns=("volume_worst", "force_end", "shape_error", "shape_volume", "real_time", "real_time_cpu"),
)
WORDS = ("springs alone", "one kept volume", "recommended body")
"""What each case is called on the terminal."""
