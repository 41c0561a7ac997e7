"""A kidney held around its hilum, palpated by a spherical probe on its front: a concave organ."""

from studies.geometry.shape.levelset import PalpationPoint
from studies.scene.loads import held_of, probed

KIDNEY_PROBE = probed(
    "kidney",
    "Kidney held around its hilum, a spherical probe of 15 mm radius pushed in by 6 mm",
    # As a number: computed from the surface, its last bits would depend on the processor.
    PalpationPoint((0.009, -0.021079642908041606, 0.0), (0.2041860714122822, -0.9789320958274983, 0.0)),
    radius=0.015,  # m, a fingertip; twice the edge of the coarsest reference mesh
    depth=0.006,  # m, a seventh of the kidney's thickness
    seconds=(3.0, 4.0),  # slow enough that damping drags with less than 1 % of the force
    frames=200,
    held=held_of("kidney", "hilum"),
    damping=15.0,
)
