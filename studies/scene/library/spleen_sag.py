"""A spleen hanging from its hilum: gravity alone, no contact. What holds it must carry its weight: a closed form."""

from studies.scene.loads import clamped, held_of

DURATION = 4.0  # s: the swing of the drop has died away

SPLEEN_SAG = clamped(
    "spleen_sag",
    "spleen",
    "Spleen sagging from its hilum under gravity",
    held_of("spleen", "hilum"),
    (0.0, 0.0, 1.0),
    seconds=(0.0, DURATION),
    frames=200,
    checkpoints=(DURATION,),
    gravity=(0.0, 0.0, -9.81),  # m/s²: the patient stands
    damping=15.0,
    # The force is the weight for any model, so it gives no information.
    quantities=("surface", "interior", "silhouette", "volume"),
)
