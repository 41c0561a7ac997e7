"""A free ball struck so that it stretches and flattens in turn: does it ring as fast as the continuum does?"""

from studies.scene.scene import ForceOutput, Organ, ReferencePlan, Scene
from studies.scene.start import InitialConditions
from studies.scene.tissues import LIVER

RADIUS = 0.05  # m
STRETCHING = 3.5  # 1/s: a swing of 5 % of the radius, an angular frequency of 2.6656 √(mu/rho)/R = 69 1/s
FRAME = 2.5e-3  # s, a thirty-sixth of a period
FRAMES = 80  # two periods and a fifth

BALL_RINGING = Scene(
    name="ball_ringing",
    title="Free ball that starts to stretch at 3.5 1/s and rings in its slowest mode that changes shape",
    organ=Organ("ball", {"radius": RADIUS}),
    tissue=LIVER,
    duration=FRAMES * FRAME,
    frames=FRAMES,
    checkpoints=tuple(FRAME * (k + 1) for k in range(FRAMES)),
    probed=ForceOutput("obstacle", 0, (0.0, 0.0, -1.0)),  # nothing touches it: its force is not among the quantities
    damping=1.0,  # a hundredth of critical
    start=InitialConditions(
        speed=((-0.5 * STRETCHING, 0.0, 0.0), (0.0, -0.5 * STRETCHING, 0.0), (0.0, 0.0, STRETCHING)),
    ),
    reference=ReferencePlan("octant", (0.5, 0.36, 0.26), variants=("steps", "kappa"), dt=FRAME / 2.0),
    quantities=("frequency", "volume"),
)
