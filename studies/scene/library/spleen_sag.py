"""A spleen hanging from its hilum: gravity alone, no contact. What holds it must carry its weight: a closed form."""

from studies.geometry.organs.spleen import SPLEEN_REGIONS
from studies.scene.scene import ForceOutput, Held, Organ, ReferencePlan, Scene
from studies.scene.tissues import SPLEEN

GRAVITY = (0.0, 0.0, -9.81)  # m/s²: the patient stands
DURATION = 4.0  # s: the swing of the drop has died away

SPLEEN_SAG = Scene(
    name="spleen_sag",
    title="Spleen sagging from its hilum under gravity",
    organ=Organ("spleen"),
    tissue=SPLEEN,
    duration=DURATION,
    frames=200,
    checkpoints=(DURATION,),
    held=(Held("hilum", SPLEEN_REGIONS["hilum"]),),
    probed=ForceOutput("held", 0, (0.0, 0.0, 1.0)),
    gravity=GRAVITY,
    damping=15.0,
    reference=ReferencePlan(),
    # The force is the weight for any model, so it gives no information.
    quantities=("surface", "interior", "silhouette", "volume"),
)
