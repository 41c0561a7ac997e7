"""From which starts does a body find its rest shape again, and what does it need for that?"""

from massspring import Free, ImplicitVolume, Shake
from studies.catalog.study import Chart, Study
from studies.runs.case import Case
from studies.runs.recipes import TetrahedralBody
from studies.scene.library.stress import STRESS_SCENES
from studies.store.schema import Status

NODES = 230
"""On the surface: about 316 with those inside."""
ONE, MANY = TetrahedralBody(nodes=NODES), TetrahedralBody(nodes=NODES, volumes="nodal")
TAUT = TetrahedralBody(nodes=NODES, law="cotangent", volumes="nodal")
FRACTION = 0.2
BACK = ImplicitVolume(recovers=True)

STRESS = Study(
    name="stress",
    question=__doc__ or "",
    cases=tuple(
        Case(scene, body, method, dt_fraction=FRACTION)
        for scene in STRESS_SCENES
        for body, method in (
            (ONE, Free()),
            (ONE, ImplicitVolume()),
            (ONE, Shake()),
            (MANY, ImplicitVolume()),
            (TAUT, ImplicitVolume()),
            (MANY, BACK),
            (TAUT, BACK),
        )
    ),
    charts=(Chart("recovery.png", "studies.plots.campaigns.recovery:draw"),),
    columns=("inverted_share", "rest_distance", "volume_end", "min_j"),
    expects=(Status.INVERTED, Status.SHAKEN),  # a volume that comes back from such a start gives energy
)
