"""Scenes with a cut for programs that cannot cut: the mesh is cut from the start, and only checkpoints after the cut
count.

The tissue has no memory, so an equilibrium after the cut does not depend on when it was made.
"""

from dataclasses import replace

import numpy as np

from studies.base.errors import StudyError
from studies.reference.load import Reference
from studies.scene.scene import Scene
from studies.store.schema import REFERENCE_FIELDS


def given_scene(scene: Scene) -> Scene:
    """The scene for another program; for a scene with a cut, only with the checkpoints after it.

    Raises StudyError for a cut whose time matters: one in a scene without equilibria, one that allows free pieces, or
    one that opens a lumen; for several cuts, and for one after which there is no checkpoint.
    """
    if len(scene.cuts) > 1:
        raise StudyError(
            f"scene '{scene.name}' cannot be given away cut from the start: it has {len(scene.cuts)} cuts, and files "
            "and words of an export are of one"
        )
    cut = scene.cut
    if cut is None:
        return scene
    if cut.free or scene.start is not None:
        what = f"cut '{cut.name}' lets a piece go" if cut.free else "it starts in motion"
        raise StudyError(f"scene '{scene.name}' cannot be given away cut from the start: {what}, so its time matters")
    if cut.opens_lumen:
        raise StudyError(
            f"scene '{scene.name}' cannot be given away cut from the start: cut '{cut.name}' opens a lumen, whose "
            "volume is kept until then"
        )
    after = tuple(t for t in scene.checkpoints if t > cut.ends)
    if not after:
        raise StudyError(
            f"scene '{scene.name}' has no checkpoint after its cut '{cut.name}' at {cut.ends:g} s; add one"
        )
    return replace(scene, checkpoints=after)


def reference_of(scene: Scene, reference: Reference | None) -> Reference | None:
    """The reference of a scene at the checkpoints of the same scene as given_scene has it."""
    count = len(scene.checkpoints)
    if reference is None or count == len(reference.scene.checkpoints):
        return reference
    fields = dict(reference.record.fields)
    for name, stored in fields.items():
        lengths = REFERENCE_FIELDS[name].shape.split()
        if "K" in lengths:
            late = np.take(stored.values, range(-count, 0), axis=lengths.index("K"))
            fields[name] = replace(stored, values=late)
    return Reference(scene, replace(reference.record, fields=fields))
