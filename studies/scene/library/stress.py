"""A ball started from shapes that no organ has; nothing touches it. Not among SCENES: there is no reference."""

from studies.scene.scene import ForceOutput, Organ, Scene
from studies.scene.start import InitialConditions
from studies.scene.tissues import LIVER

DURATION = 4.0  # s: 3,000 steps and more of a fifth of the limit
RADIUS = 0.05  # m


def _scaled(x: float, y: float, z: float) -> InitialConditions:
    return InitialConditions(((x, 0.0, 0.0), (0.0, y, 0.0), (0.0, 0.0, z)))


STARTS = {
    "flattened": _scaled(1.0, 1.0, 0.0),
    "mirrored": _scaled(1.0, 1.0, -1.0),
    "scrambled": InitialConditions(_scaled(0.0, 0.0, 0.0).matrix, scatter=1.0),
    "stretched": _scaled(3.0, 1.0, 1.0),
    "shrunk": _scaled(1e-3, 1e-3, 1e-3),
    "line": _scaled(1.0, 0.0, 0.0),
}
"""Flat, inside out, every node anywhere, three times as long, a thousandth of its size, and without any area."""

STRESS_SCENES: tuple[Scene, ...] = tuple(
    Scene(
        name=f"stress_{name}",
        title=f"Ball at large, started {name}",
        organ=Organ("ball", {"radius": RADIUS}),
        tissue=LIVER,
        duration=DURATION,
        frames=200,
        checkpoints=(DURATION,),
        probed=ForceOutput("held", 0, (0.0, 0.0, 1.0)),
        reference=None,
        damping=20.0,  # a tenth of critical in the slowest mode
        quantities=("volume",),
        start=start,
    )
    for name, start in STARTS.items()
)
