"""How do other programs fare on the same ball and liver? Ours; theirs are entries (studies.exchange.peers.main).

No study of the catalogue: what others compute needs the extra `peers`. `make study-peers` runs both sides.
"""

from massspring import Free, ImplicitVolume, Xpbd
from studies import BALL_SQUEEZE, LIVER_PRESS, BodyRecipe, Case, Chart, Study

SCENES = (BALL_SQUEEZE, LIVER_PRESS)
NODES = (150, 300)
"""Vertices on the outer surface."""
STRAIGHT = tuple(BodyRecipe("tetrahedral", nodes) for nodes in NODES)
CURVED = tuple(BodyRecipe("quadratic", 4 * nodes - 6) for nodes in NODES)
"""The same number of vertices, and the nodes between them."""

STUDY = Study(
    name="peers",
    question=__doc__ or "",
    cases=tuple(
        Case(scene, body, method, timed=True)
        for scene in SCENES
        for bodies, methods in ((STRAIGHT, (Free(), Xpbd(), ImplicitVolume())), (CURVED, (ImplicitVolume(),)))
        for body in bodies
        for method in methods
    ),
    charts=(Chart("peers.png", "studies.plots.campaigns.peers:draw"),),
    columns=(
        "force_end",
        "mean_error",
        "shape_error",
        "shape_volume",
        "volume_worst",
        "real_time",
        "silhouette_error",
        "min_j",
    ),
)
