"""Facets of a body that an obstacle touches."""

from massspring import Capsule, Sphere
from massspring.world.depth import facets_within
from studies.geometry.surface.sides import along_facets
from studies.meshing.bounds import FEW
from studies.meshing.rest_surface import OUTER
from studies.metrics.run import Run
from studies.runs.outlines import TOUCH


def contact_facets(run: Run) -> float:
    """Outer facets with a point within 0.1 % of the size of the probed obstacle at the last checkpoint [1].

    NaN if the force is not that of an obstacle, or the facets are unknown."""
    scene, sides = run.case.scene, run.sides
    if scene.probed.what != "obstacle" or sides is None or scene.probed.number >= len(scene.obstacles):
        return float("nan")
    facets = sides[OUTER].facets
    places, _ = along_facets(run.fields.snapshots[-1], facets)
    gap = scene.obstacles[scene.probed.number].gap(places, scene.checkpoints[-1])
    return float((gap.reshape(len(facets), -1) < TOUCH * run.size).any(axis=1).sum())


def few_facets(run: Run) -> bool:
    """Whether a sphere or capsule touches at least one and fewer than FEW outer facets at the last checkpoint: its
    nearest point of each within 0.1 % of the size."""
    scene = run.case.scene
    sides = run.sides if run.record.fields else None  # a case that failed has none
    if sides is None or not len(run.fields.snapshots):
        return False
    x, facets, t = run.fields.snapshots[-1], sides[OUTER].facets, scene.checkpoints[-1]
    rounds = [one for one in scene.obstacles if isinstance(one, Sphere | Capsule)]
    return any(0 < facets_within(one, x, facets, t, TOUCH * run.size).sum() < FEW for one in rounds)
