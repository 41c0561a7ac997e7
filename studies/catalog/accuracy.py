"""Which body is how accurate, at what cost, on every organ: from the paper's surface to graded quadratic elements?"""

from dataclasses import replace
from typing import Literal

from massspring import ExplicitElements, ImplicitElements, ImplicitVolume
from studies.catalog.study import Chart, Study
from studies.runs.case import Case
from studies.runs.recipes import ADAPTIVE, BodyRecipe, QuadraticBody, SurfaceBody, TetrahedralBody, neighbours
from studies.scene.inertia import why_inertia_matters, why_not_heavier
from studies.scene.kind import NOT_ADAPTIVE, has_wall, load_of
from studies.scene.library import JUDGED
from studies.scene.scene import Scene
from studies.store.schema import Status

BUDGETS = (594, 994, 1194)
"""Nodes on the outer surface of a quadratic body, mid-side nodes among them: 4 v − 6 with v vertices (Euler)."""
FINEST = 1594
"""Nodes of an adaptive body of an organ nobody has tuned for; the accuracy study ends at three quarters of it."""
SHORT, LONG = 0.5, 0.8
"""Steps over the stability limit: of linear bodies, and of quadratic ones."""
COARSE = TetrahedralBody(nodes=150, law="cotangent", volumes="nodal"), QuadraticBody(294, contact="nodes")
COARSE_STEP = 0.01
"""Bodies that implicit elements advance, and their step [s]: they are not limited by stability."""


def judged_at_rest() -> tuple[Scene, ...]:
    """The scenes with a reference that end at rest: force and displacement are compared there."""
    return tuple(scene for scene in JUDGED if load_of(scene) != "motion")


def linear_bodies(scene: Scene) -> tuple[BodyRecipe, ...]:
    """The rungs below quadratic bodies, two sizes each: the paper's body; one volume; a volume for every four nodes;
    one per node with springs without length, of elements or smoothed over edges. A hollow organ has as many nodes again
    on its lumen, and a coarser surface of it folds."""
    hollow = has_wall(scene)
    sizes, share = ((550, 800), 2) if hollow else ((300, 550), 3)  # surface nodes in four nodes of all
    axis = "centre_line" if hollow else "straight"
    return tuple(
        recipe
        for nodes in sizes
        for recipe in (
            SurfaceBody(nodes, axis=axis),
            TetrahedralBody(nodes=nodes),
            TetrahedralBody(nodes=nodes, volumes="regions", regions=nodes // share),
            TetrahedralBody(nodes=nodes, law="cotangent", volumes="nodal"),
            TetrahedralBody(nodes=nodes, law="edge_smoothed", volumes="nodal"),
        )
    )


def headline(scene: Scene) -> BodyRecipe:
    """The finest of the graded bodies, or of the even ones where grading changes nothing, with the masses that allow
    the longest step."""
    return (graded(scene) or even(scene))[-1]


def headline_case(scene: Scene) -> Case:
    """The headline at the long step; it can be seen move (studies.runs.surface_frames)."""
    return replace(_timed(scene, headline(scene), LONG), recorded=("surface",))


def even(scene: Scene) -> tuple[BodyRecipe, ...]:
    """Quadratic bodies with elements of one size: the smallest, which is fast; all where grading changes nothing."""
    sizes = BUDGETS[:1] if graded(scene) else BUDGETS
    return tuple(QuadraticBody(nodes, mass=usual_mass(scene)) for nodes in sizes)


def graded(scene: Scene) -> tuple[BodyRecipe, ...]:
    """Quadratic bodies with smaller elements where the scene needs them, from the second size on; none where grading
    changes nothing."""
    if not is_adaptive(scene) and not can_be_graded(scene):
        return ()
    way = ADAPTIVE if is_adaptive(scene) else True
    return tuple(QuadraticBody(nodes, graded=way, mass=usual_mass(scene)) for nodes in BUDGETS[1:])


def mixed(scene: Scene) -> tuple[BodyRecipe, ...]:
    """Quadratic bodies whose elements keep a volume of their own where the scene holds them: with elements of one size
    in two sizes, and adaptive; none where nothing is held."""
    if not scene.held:
        return ()
    even = [QuadraticBody(size, mass=usual_mass(scene), volumes="mixed") for size in BUDGETS[:2]]
    fine = QuadraticBody(BUDGETS[1], graded=ADAPTIVE, mass=usual_mass(scene), volumes="mixed")
    return (*even, fine) if is_adaptive(scene) else tuple(even)


def is_adaptive(scene: Scene) -> bool:
    """Whether one solution of the coarse body can say where elements should be small."""
    return bool(scene.held) and load_of(scene) not in NOT_ADAPTIVE


def can_be_graded(scene: Scene) -> bool:
    """Whether grading changes a body: that of a hollow organ is graded at contacts alone."""
    return bool(scene.obstacles) or (bool(scene.held) and not has_wall(scene))


def quadratic_cases(scene: Scene) -> tuple[Case, ...]:
    """Even, graded and mixed bodies in all sizes at the long step, each on five neighbouring meshes. The headline is
    recorded, and the middle one of each five is timed."""
    best, cases = headline_case(scene), list[Case]()
    for body in (*even(scene), *graded(scene), *mixed(scene)):
        for mesh in neighbours(body):
            case = _timed(scene, mesh, LONG) if mesh == body else replace(_timed(scene, mesh, LONG), timed=False)
            cases.append(best if mesh == best.body else case)
    return tuple(cases)


def element_cases(scene: Scene) -> tuple[Case, ...]:
    """What is taken instead of mass-spring bodies: explicit elements on the larger linear body, and implicit ones on a
    coarse linear and a coarse quadratic body, but where a lumen is filled, whose volume they do not keep."""
    body = next(body for body in reversed(linear_bodies(scene)) if body.law == "cotangent")
    explicit = Case(scene, body, ExplicitElements(), dt_fraction=SHORT, timed=True)
    if scene.filled:
        return (explicit,)
    implicit = [Case(scene, coarse, ImplicitElements(), dt=COARSE_STEP, timed=True) for coarse in COARSE]
    return (explicit, *implicit)


def usual_mass(scene: Scene) -> Literal["lumped", "stiffness", "heavy"]:
    """The masses that allow the longest step. Hollow organs swing too slowly for loads of seconds to be heavier."""
    if why_inertia_matters(scene):
        return "lumped"
    return "stiffness" if has_wall(scene) or why_not_heavier(scene) else "heavy"


def _timed(scene: Scene, body: BodyRecipe, fraction: float) -> Case:
    return Case(scene, body, ImplicitVolume(), dt_fraction=fraction, timed=True)


ACCURACY = Study(
    name="accuracy",
    question=__doc__ or "",
    cases=tuple(
        case
        for scene in judged_at_rest()
        for case in (
            *(_timed(scene, body, SHORT) for body in linear_bodies(scene)),
            *quadratic_cases(scene),
            *element_cases(scene),
        )
    ),
    charts=(
        Chart("accuracy.png", "studies.plots.work_precision:draw"),
        Chart("overview.png", "studies.plots.overview:draw"),
        Chart("liver_probe.png", "studies.plots.probe:draw"),
    ),
    columns=(
        "force_end",
        "mean_error",
        "shape_error",
        "shape_volume",
        "real_time",
        "real_time_cpu",
        "step_time",
        "force_error",
        "surface_error",
        "interior_error",
        "silhouette_error",
        "pressure_error",
        "lumen_pressure_error",
        "volume_worst",
        "min_j",
        "alternation",
        "sway",
    ),
    expects=(Status.FOLDED, Status.INVERTED),  # springs with one volume, and the hanging spleen: docs/accuracy.md
)
