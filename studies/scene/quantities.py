"""Which quantities of a scene may be compared with its reference."""

import math

from studies.scene.scene import Scene

ALWAYS = ("volume",)
"""Quantities with a truth of their own: a volume is compared with the body's own rest volume."""


GAUGE_FREE = ("pressure", "lumen")
"""Quantities that every scene at rest allows: a rigid turn does not change them."""


def allowed(scene: Scene, quantity: str) -> bool:
    """Whether the scene says that a quantity of its reference may be compared."""
    word = quantity.split("_")[0]
    if word == "lumen" and not scene.filled_at(math.inf):
        return False  # what a cut lets go has no pressure in the end
    if word == "opening":
        return bool(scene.cuts)
    moves = scene.reference is not None and scene.reference.dt is not None
    return word in ALWAYS or word in scene.quantities or (word in GAUGE_FREE and not moves)
