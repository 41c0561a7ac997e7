"""A liver held at its bare area, palpated by a spherical probe low on the front of the right lobe."""

from studies.geometry.shape.levelset import PalpationPoint
from studies.scene.loads import held_of, probed

LIVER_PROBE = probed(
    "liver",
    "Liver held at its bare area, a spherical probe of 20 mm radius pushed in by 10 mm",
    # As a number: computed from the surface, its last bits would depend on the processor.
    PalpationPoint(
        (-0.0451478389765694, -0.058645481466503876, -0.03350042141479926),
        (-0.08765010953605712, -0.9535288492345018, -0.2882710390862113),
    ),
    radius=0.020,  # m, a thumb; twice the edge of the coarsest reference mesh, so that the contact is resolved
    depth=0.010,  # m
    seconds=(6.0, 8.0),
    frames=240,
    held=held_of("liver", "bare_area"),
    damping=2.0,
)
