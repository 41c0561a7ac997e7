"""Which quantities of a scene may be compared with its reference."""

import math

from studies.scene.scene import Scene

ALWAYS = ("volume",)
"""Quantities that need no reference: a volume is compared with the rest volume of the body."""


GAUGE_FREE = ("pressure", "lumen")
"""Quantities that every scene ending at rest allows, since a rigid rotation does not change them."""


def allowed(scene: Scene, quantity: str) -> bool:
    """Whether a quantity of the reference may be compared in the scene."""
    word = quantity.split("_")[0]
    if word == "lumen" and not scene.filled_at(math.inf):
        return False  # content that a cut has drained has no pressure at the end
    if word == "opening":
        return bool(scene.cuts)
    moves = scene.reference is not None and scene.reference.dt is not None
    return word in ALWAYS or word in scene.quantities or (word in GAUGE_FREE and not moves)
