"""A liver held at its bare area and pressed from the front by a frictionless plane, as by the flat of a hand."""

from studies.geometry import LIVER_PRESS_DIRECTION
from studies.scene.loads import held_of, pressed
from studies.scene.placing import scaled
from studies.scene.scene import ReferencePlan

FRONT = -0.0686  # m: where the liver begins along the press direction
GAP = 0.0014  # m between plane and liver at the start: curved facets of a coarse mesh bulge that far
DEPTH = 0.020  # m, a sixth of the liver's depth

LIVER_PRESS = pressed(
    "liver",
    "Liver held at its bare area, pressed 20 mm by a frictionless plane from the front",
    scaled(LIVER_PRESS_DIRECTION, FRONT - GAP),
    DEPTH + GAP,
    seconds=(6.0, 8.0),
    frames=240,
    held=held_of("liver", "bare_area"),
    damping=2.0,
    reference=ReferencePlan(at_contact=0),
)
