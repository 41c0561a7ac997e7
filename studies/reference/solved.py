"""The reference of a scene, solved and loaded."""

from pathlib import Path

from studies.base.errors import StudyError
from studies.reference.load import Reference, load_reference
from studies.reference.reference_solves import ReferenceSolve
from studies.reference.solve import solve
from studies.scene.scene import Scene


def solve_reference(root: Path, scene: Scene) -> Reference:
    """Solves the scene by its plan, whatever is published of it, and stores that below `root`.

    Raises StudyError for a scene without a plan, for a mesh that cannot be made, and where a path broke off.
    """
    if scene.reference is None:
        raise StudyError(f"scene '{scene.name}' has no plan for a reference; give it a ReferencePlan")
    solve(root, ReferenceSolve(scene))
    reference = load_reference(root, scene)
    assert reference is not None  # it has a plan
    return reference
