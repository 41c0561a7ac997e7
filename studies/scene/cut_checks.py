"""Checks of a scene's cuts before meshing: their times, the kind of organ, and whether all pieces are held."""

import numpy as np

from massspring import Probe
from studies.base.errors import StudyError
from studies.geometry import BallRegion
from studies.geometry.surface.sheet import Sheet, check_apart, check_sheet
from studies.scene.clock import check_judged_after_cut, event_frames
from studies.scene.cut import Cut
from studies.scene.kind import has_wall
from studies.scene.scene import Scene


def check_cuttable(scene: Scene, cut: Cut) -> None:
    """Raises StudyError for an invalid time of a cut, and for a scene that cannot be cut."""
    event_frames(scene, cut, scene.frames)
    check_judged_after_cut(scene)
    if scene.organ.shape == "file":
        raise StudyError(f"scene '{scene.name}' cuts an organ of a file; only organs of the catalogue are cut so far")
    if cut.contact != scene.cuts[0].contact:
        raise StudyError(
            f"scene '{scene.name}': the faces of one cut touch and those of another do not; give all of them contact, "
            "or none"
        )
    if has_wall(scene):
        _check_wall(scene, cut)
    elif cut.opens_lumen:
        raise StudyError(f"scene '{scene.name}': cut '{cut.name}' opens a lumen, and its organ is solid; leave it out")
    if any(isinstance(obstacle, Probe) for obstacle in scene.obstacles):
        raise StudyError(f"scene '{scene.name}' has a thin probe, which feels no cut; leave one of them out")


def _check_wall(scene: Scene, cut: Cut) -> None:
    """Raises StudyError for a cut through the wall of a hollow organ that neither run nor reference supports."""
    name = f"scene '{scene.name}': cut '{cut.name}'"
    if len(scene.cuts) > 1:
        raise StudyError(f"scene '{scene.name}' cuts the wall of a hollow organ {len(scene.cuts)} times; cut it once")
    if not cut.opens_lumen:
        raise StudyError(f"{name} goes through the wall of a hollow organ; let what fills it go: opens_lumen=True")
    if isinstance(cut.within, BallRegion):
        raise StudyError(f"{name} is a disc inside the body, and the organ is hollow; give a half space as blade")
    if cut.contact:
        raise StudyError(f"{name} has faces that touch, which no cut through a wall has yet; leave out contact")


def check_cuts(scene: Scene, surface: tuple[np.ndarray, np.ndarray]) -> None:
    """Raises StudyError for cuts through the true `surface` of the organ, points (n, 3) [m] and triangles (t, 3), that
    cannot be meshed, and for a piece without a held region."""
    sheets = {cut.name: (cut.plane, _sheet(scene, cut, surface)) for cut in scene.cuts}
    check_apart(f"scene '{scene.name}'", sheets)


def _sheet(scene: Scene, cut: Cut, surface: tuple[np.ndarray, np.ndarray]) -> Sheet:
    name, regions = f"scene '{scene.name}'", [held.region for held in scene.held]
    sheet = check_sheet(name, cut.name, surface, cut.plane, cut.within, regions)
    for piece in [] if cut.within is not None or cut.free else sheet.pieces:
        if not any((region.level(piece.surface) <= 0).any() for region in regions):
            raise StudyError(
                f"{name}: cut '{cut.name}' leaves a piece that nothing holds; hold it, or let it go: free=True"
            )
    return sheet
