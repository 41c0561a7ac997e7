"""Which way to keep a volume is how accurate, and what does it cost, on one body at one share of its step limit?"""

from dataclasses import replace

from massspring import (
    METHODS,
    Element,
    ExplicitElements,
    ImplicitElements,
    ImplicitSprings,
    Method,
    Xpbd,
    XpbdNeoHookean,
)
from studies.catalog.study import Chart, Study
from studies.runs.case import Case
from studies.runs.recipes import BodyRecipe, TetrahedralBody
from studies.scene.library.ball_squeeze import BALL_SQUEEZE
from studies.scene.library.liver_press import LIVER_PRESS
from studies.store.schema import Status

NODES = 200
"""So coarse that the dearest, a volume for every tetrahedron, is done in seconds; the same for all."""
OTHER_SETTINGS: tuple[Method, ...] = (
    Element(bulk_modulus=1e6, hard=True),
    Xpbd("whole", iterations=2),
    ExplicitElements(law="corotated"),
    XpbdNeoHookean(iterations=20),
)
"""Each runs after its method with the default settings."""
COROTATED = ImplicitElements(law="corotated")


def contestants() -> tuple[Method, ...]:
    """Every method that has a step limit to take a share of, and those with other settings."""
    limited = [kind() for kind in METHODS if kind.capabilities.conditionally_stable]
    return tuple(
        method for usual in limited for method in (usual, *(m for m in OTHER_SETTINGS if m.name == usual.name))
    )


def body_for(method: Method) -> BodyRecipe:
    """The same mesh for all; springs without length for methods whose elements are made of them."""
    plain = TetrahedralBody(nodes=NODES)
    return replace(plain, law="cotangent", volumes="nodal") if method.capabilities.keeps == "elements" else plain


SCENES = (BALL_SQUEEZE, LIVER_PRESS)
LONG = (0.02, 0.1)
"""Steps of the implicit springs [s]: 6 and 28 limits of the ball, 3 and 16 of the liver; frames as long as steps."""

METHODS_STUDY = Study(
    name="methods",
    question=__doc__ or "",
    cases=(
        *(Case(scene, body_for(method), method, timed=True) for scene in SCENES for method in contestants()),
        # One volume per node, beside one for the whole and one per tetrahedron.
        *(Case(scene, TetrahedralBody(nodes=NODES, volumes="nodal"), timed=True) for scene in SCENES),
        # No limit holds for implicit springs: what does a long step cost, and bring?
        *(
            Case(
                scene,
                TetrahedralBody(nodes=NODES),
                ImplicitSprings(),
                dt,
                frames=round(scene.duration / dt),
                timed=True,
            )
            for scene in SCENES
            for dt in LONG
        ),
        # What other engines take: corotated elements, implicit in time.
        *(
            Case(scene, body_for(COROTATED), COROTATED, LONG[0], frames=round(scene.duration / LONG[0]), timed=True)
            for scene in SCENES
        ),
    ),
    expects=(Status.SHAKEN,),  # implicit springs on the ball, with steps of 100 ms
    charts=(Chart("methods.png", "studies.plots.methods:draw"),),
    columns=(
        "force_error",
        "force_end",
        "silhouette_error",
        "shape_error",
        "shape_volume",
        "interior_error",
        "pressure_error",
        "volume_worst",
        "min_j",
        "j_spread",
        "step_time",
        "frame_time",
        "frame_cpu",
        "real_time",
        "real_time_cpu",
    ),
)
