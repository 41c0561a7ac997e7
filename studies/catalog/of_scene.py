"""The study of a single scene, for a file of the user that defines SCENE and no STUDY."""

from dataclasses import replace

from massspring import Free, ImplicitVolume
from studies.catalog.accuracy import FINEST, LONG, SHORT, even, graded
from studies.catalog.study import Chart, Study
from studies.runs.case import Case
from studies.runs.recipes import BodyRecipe, TetrahedralBody
from studies.scene.library import LIVER_PROBE
from studies.scene.scene import Scene

RECORDED = ("surface",)
SHARES = SHORT, LONG
"""Of the step limit, for the coarser and the finer of the two meshes: they do not share what a long step does."""
BODIES = "bodies"
"""Stands for the study of a folder of surfaces where no other is named."""


def study_of(scene: Scene) -> Study:
    """Springs alone, one kept volume, and quadratic elements on two meshes in `scene`, with charts and a recorded
    surface. The study has the name of the scene. The difference of the two meshes bounds the errors of both
    (studies.metrics.interval)."""
    cases = (
        Case(scene, TetrahedralBody(), Free(), recorded=RECORDED),
        Case(scene, TetrahedralBody(), ImplicitVolume(), recorded=RECORDED),
        *(
            Case(scene, body, ImplicitVolume(), dt_fraction=share, recorded=RECORDED)
            for body, share in zip(_two_meshes(scene), SHARES, strict=True)
        ),
    )
    charts = (
        Chart("volume.png", "studies.plots.volume_history:draw"),
        Chart("force.png", "studies.plots.force_path:draw"),
    )
    columns = (
        "volume_worst",
        "force_end",
        "mean_error",
        "force_within",
        "mean_within",
        "shape_error",
        "shape_volume",
        "silhouette_error",
        "min_j",
    )
    return Study(scene.name, f"How do four bodies do in {scene.title}?", cases, charts, columns)


def bodies() -> Study:
    """The same four bodies, to be taken to the organs of a folder (studies.catalog.folder)."""
    return replace(study_of(LIVER_PROBE), name=BODIES, question="How do four bodies do in each organ?")


def _two_meshes(scene: Scene) -> tuple[BodyRecipe, ...]:
    bodies = graded(scene)
    finest = tuple(replace(body, nodes=FINEST) for body in bodies[-1:])
    return (*bodies, *finest)[-2:] or even(scene)[-2:]
