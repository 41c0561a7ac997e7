"""Does an incision gape as in the reference, does a cut that closes bear a press, and do volumes follow?"""

from dataclasses import replace

from massspring import ImplicitVolume
from studies.catalog.study import Chart, Study
from studies.runs.case import Case
from studies.runs.recipes import VIRTUAL, BodyRecipe, QuadraticBody, SurfaceBody, TetrahedralBody
from studies.scene.library import CUT
from studies.scene.library.ball_cuts import BALL_BISECTED, BALL_INCISED
from studies.scene.scene import Scene
from studies.store.schema import Status

BODIES = (
    TetrahedralBody(nodes=350),
    TetrahedralBody(nodes=350, law="cotangent", volumes="nodal"),
    TetrahedralBody(nodes=700),
    QuadraticBody(nodes=594, mass="stiffness"),
    QuadraticBody(nodes=794, graded="adaptive", mass="stiffness"),
    QuadraticBody(nodes=994, graded="adaptive", mass="stiffness"),
)
PAPER = SurfaceBody(nodes=350)
"""The paper's body, which is cut in pieces alone."""
UNFORESEEN = tuple(replace(body, cut=VIRTUAL) for body in BODIES if body.kind == "tetrahedral")
"""The same on meshes that do not know the cut."""
ADVANCING = BODIES[1], BODIES[3], BODIES[5]
"""Of scenes whose cut advances: with one volume elements turn over next to the tip."""
WALLS = (
    TetrahedralBody(nodes=400),
    TetrahedralBody(nodes=400, law="cotangent", volumes="nodal"),
    TetrahedralBody(nodes=700),
    QuadraticBody(nodes=994, mass="stiffness"),
    QuadraticBody(nodes=994, graded="adaptive", mass="stiffness"),
    QuadraticBody(nodes=1194, graded="adaptive", mass="stiffness"),
)
"""Of hollow organs."""
LONG = 0.8
"""Of the stability limit."""


def bodies_of(scene: Scene) -> tuple[BodyRecipe, ...]:
    """The bodies that run a scene with a cut."""
    if scene.lumen is not None:
        return WALLS
    if any(cut.until is not None for cut in scene.cuts):
        return ADVANCING
    return BODIES if any(cut.within is not None for cut in scene.cuts) else (PAPER, *BODIES)


CUTTING = Study(
    name="cutting",
    question=__doc__ or "",
    cases=tuple(
        Case(scene, body, ImplicitVolume(), dt_fraction=LONG, timed=scene.reference is not None)
        for scene, bodies in (
            *((scene, bodies_of(scene)) for scene in CUT),
            (BALL_INCISED, UNFORESEEN),
            (BALL_BISECTED, UNFORESEEN),
        )
        for body in bodies
    ),
    charts=(
        Chart("cut_open.png", "studies.plots.cut_open:draw"),
        Chart("opening.png", "studies.plots.opening:draw"),
        Chart("force.png", "studies.plots.force_path:draw"),
        Chart("pieces.png", "studies.plots.pieces:draw"),
        Chart("volume.png", "studies.plots.volume_history:draw"),
        Chart("cost.png", "studies.plots.work_precision:draw"),
    ),
    columns=(
        "opening_error",
        "force_error",
        "force_end",
        "mean_error",
        "shape_error",
        "shape_volume",
        "overlap",
        "piece_worst",
        "piece_sum_worst",
        "cut_energy",
        "cut_momentum",
        "cut_limit",
        "cut_ms",
        "min_j",
        "real_time",
        "real_time_cpu",
    ),
    expects=(Status.INVERTED, Status.SHAKEN),  # springs with one volume of stomach_opened; linear kidneys cut in two
)
