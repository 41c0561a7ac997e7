"""How do other programs fare on the same ball and the same liver? Ours; theirs are entries (studies.peers.main).

No study of the catalogue: what others compute needs the extra `peers`. `make study-peers` runs both sides.
"""

from massspring import Free, ImplicitElements, ImplicitVolume, Xpbd
from studies.catalog.study import Chart, Study
from studies.runs.case import BodyRecipe, Case
from studies.scenes import BALL_SQUEEZE, LIVER_PRESS

SCENES = (BALL_SQUEEZE, LIVER_PRESS)
NODES = (150, 300)
"""Vertices on the outer surface."""
METHODS = (Free(), Xpbd(), ImplicitVolume(), ImplicitElements())

STUDY = Study(
    name="peers",
    question=__doc__ or "",
    cases=tuple(
        Case(scene, BodyRecipe(kind, nodes if kind == "tetrahedral" else 4 * nodes - 6), method, timed=True)
        for scene in SCENES
        for nodes in NODES
        for kind, methods in (("tetrahedral", METHODS), ("quadratic", METHODS[2:]))
        for method in methods
    ),
    charts=(Chart("peers.png", "studies.plots.peers:draw"),),
    columns=("force_end", "mean_error", "volume_worst", "real_time", "silhouette_error", "min_j"),
)
