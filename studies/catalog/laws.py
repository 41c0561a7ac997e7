"""What does the stiffness law do to the force and to the time step, with one volume and with one per node?"""

from massspring import ImplicitVolume
from massspring.body.laws import LAWS
from studies.catalog.study import Chart, Study
from studies.runs.case import Case
from studies.runs.recipes import SurfaceBody, TetrahedralBody
from studies.scene.library.ball_squeeze import BALL_SQUEEZE
from studies.store.schema import Status

NODES = (150, 300, 550)

LAWS_STUDY = Study(
    name="laws",
    question=__doc__ or "",
    cases=(
        *(
            Case(BALL_SQUEEZE, TetrahedralBody(nodes=nodes, law=law.name, volumes=volumes), ImplicitVolume())
            for law in LAWS
            if law.rest_length
            for volumes in ("scene", "nodal")
            for nodes in NODES
        ),
        # Springs without length need a volume at every node.
        *(
            Case(BALL_SQUEEZE, TetrahedralBody(nodes=nodes, law=law.name, volumes="nodal"), ImplicitVolume())
            for law in LAWS
            if not law.rest_length
            for nodes in NODES
        ),
        *(
            Case(BALL_SQUEEZE, SurfaceBody(nodes, weights=weights), ImplicitVolume())
            for weights in (None, (1.0, 1.0, 1.0, 1.0))
            for nodes in NODES
        ),
    ),
    charts=(Chart("laws.png", "studies.plots.laws:draw"),),
    columns=(
        "force_error",
        "force_end",
        "silhouette_error",
        "shape_error",
        "shape_volume",
        "pressure_error",
        "volume_worst",
        "min_j",
    ),
    expects=(Status.INVERTED,),  # two laws with one volume
)
