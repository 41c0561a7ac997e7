"""The paper's Figure 4: a thin probe touches the refined stomach, presses deep, then slides along its front.

A scene of the mass-spring body alone, without a reference: that would need contact of finite elements with a
point, under which a continuum gives way without limit (Boussinesq); a force or a depth there depends on the mesh.
"""

from massspring import Probe, Trajectory
from studies.geometry.organs.stomach import STOMACH_REGIONS, stomach_shape
from studies.scene.placing import along, probe_of, scaled
from studies.scene.scene import ForceOutput, Held, Organ, Scene
from studies.scene.tissues import STOMACH

NODES = 19_500
"""Surface nodes, with 38,996 triangles: the paper's refined stomach has 19,000 and 39,000, rounded."""
RADIUS = 0.0008  # m; half an edge of the refined surface
GAP = 0.0005  # m between tip and surface at the start
DEPTH = 0.012  # m
SLIDE = 0.025  # m
PRESS_END = 0.6  # s: 20 mm/s, and 42 mm/s along
SLIDE_END = 1.2  # s
DURATION = 1.5  # s
PROBE = probe_of(stomach_shape())
INWARD = scaled(PROBE.normal, -1.0)
DEEP = scaled(INWARD, DEPTH + GAP)
DOWN = along((0.0, 0.0, -1.0), PROBE.normal, PROBE.normal[2])
"""Towards the feet, in the tangent plane; a hundredth shorter than 1."""

STOMACH_SLIDE = Scene(
    name="stomach_slide",
    title="Refined stomach, a thin probe pushed in by 12 mm, then 25 mm along its front",
    organ=Organ("stomach"),
    tissue=STOMACH,
    duration=DURATION,
    frames=45,
    checkpoints=(PRESS_END, DURATION),
    obstacles=(
        Probe(
            along(PROBE.point, PROBE.normal, RADIUS + GAP),
            RADIUS,
            Trajectory((0.0, PRESS_END, SLIDE_END), ((0.0, 0.0, 0.0), DEEP, along(DEEP, DOWN, SLIDE))),
        ),
    ),
    held=tuple(Held(name, STOMACH_REGIONS[name]) for name in ("cardia", "pylorus")),
    probed=ForceOutput("obstacle", 0, INWARD),
    damping=8.0,
    reference=None,
    quantities=("force", "volume"),
)
