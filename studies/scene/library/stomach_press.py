"""A filled stomach before the back wall, pressed from the front by a plane or a probe: wall and content are two
volumes."""

from massspring import Plane
from studies.geometry.shape.levelset import PalpationPoint
from studies.scene.loads import held_of, pressed, probed
from studies.scene.scene import Lumen, ReferencePlan

FRONT, BACK = -0.0487, 0.0630  # m: the stomach reaches from FRONT to 0.0621, and a coarse curved mesh a little farther
GAP = 0.0008  # m between plane and stomach at the start
DEPTH = 0.020  # m, a sixth of the stomach's depth
WALL = Plane((0.0, BACK, 0.0), (0.0, -1.0, 0.0))
ENDS = held_of("stomach", "cardia", "pylorus")

STOMACH_PRESS = pressed(
    "stomach",
    "Filled stomach held at cardia and pylorus, pressed 20 mm against the back wall by a frictionless plane",
    (0.0, FRONT - GAP, 0.0),
    DEPTH + GAP,
    seconds=(6.0, 8.0),
    frames=240,
    behind=(WALL,),
    held=ENDS,
    lumen=Lumen(),
    damping=2.0,
    reference=ReferencePlan(base=430, at_contact=0),
)

STOMACH_PROBE = probed(
    "stomach",
    "Filled stomach before the back wall, a spherical probe of 25 mm radius pushed in by 12 mm",
    # As a number: computed from the surface, its last bits would depend on the processor.
    PalpationPoint((0.0415, -0.04116513145931427, 0.0), (0.16318724755802705, -0.9764054177097882, 0.1414297794009782)),
    radius=0.025,  # m; twice the edge of the coarsest reference mesh, so that the contact is resolved
    depth=0.012,  # m
    seconds=(6.0, 8.0),
    frames=240,
    behind=(WALL,),
    held=ENDS,
    lumen=Lumen(),
    damping=2.0,
    reference=ReferencePlan(base=430),
)
