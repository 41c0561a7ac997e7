"""A folder of surfaces as a study: each one meshed, held and palpated by rule, or refused with a reason."""

import warnings
from collections.abc import Iterator
from dataclasses import dataclass, replace
from pathlib import Path

import studies.geometry as geometry
from massspring import Sphere, Trajectory
from studies.base.errors import StudyError
from studies.catalog.study import Study
from studies.geometry.files.opening import ENDINGS
from studies.geometry.files.units import Source, check_unit, stem_of
from studies.scene.chosen_place import DEPTH, RADIUS
from studies.scene.kind import has_wall
from studies.scene.placing import along, press_times, scaled
from studies.scene.proposal import Proposal, proposal
from studies.scene.scene import ForceOutput, Held, Lumen, Organ, ReferencePlan, Scene
from studies.scene.scene_file import organ_options, python_name
from studies.scene.tissues import LIVER, Tissue
from studies.store.paths import readable

NODES = 550
"""Of the mesh on which hold and probe are placed."""
DURATION, DAMPING = 8.0, 8.0
"""[s], [1/s]: as in the scenes of the liver."""
GAP, PRESSED = 0.0005, 0.6
"""Between probe and surface at the start [m]; share of the duration in which the probe moves."""
CHECKPOINTS, FRAMES = 2, 80
PLAN = ReferencePlan(variants=(), tolerance=0.01, most=90e3)
"""A minute of processor time; bars of up to half of the target in force, 0.6 % in mean displacement."""


@dataclass(frozen=True)
class Placed:
    """A file and its scene, or the reason for its refusal."""

    path: Path
    scene: Scene | None
    """None where it was refused."""
    words: tuple[str, ...]
    """The repairs, or the reason."""


def placed_organs(folder: Path, unit: str | None = None) -> Iterator[Placed]:
    """Every surface in a folder, by name, as soon as it is placed.

    unit: of files that do not state one. Raises StudyError for a folder that does not exist, or holds no surface.
    """
    if not folder.is_dir():
        raise StudyError(f"there is no folder {folder}; give one with surfaces ({', '.join(ENDINGS)})")
    files = sorted(path for path in folder.iterdir() if path.is_file() and path.name.lower().endswith(ENDINGS))
    if not files:
        raise StudyError(f"{folder} has no surface; supported formats are {', '.join(ENDINGS)}")
    names = dict[str, int]()
    for path in files:
        name = python_name(stem_of(path))
        names[name] = names.get(name, 0) + 1
        yield _placed(path, unit, name if names[name] == 1 else f"{name}_{names[name]}")


def _placed(path: Path, unit: str | None, name: str) -> Placed:
    with warnings.catch_warnings(record=True) as remarks:
        warnings.simplefilter("always")
        try:
            source = Source(path.absolute(), unit)
            mesh = geometry.scan(source, NODES, fill=False)
            source = replace(source, unit=mesh.recipe["unit"])
            scene = placed_scene(name, Organ("file", organ_options(source, {})), proposal(mesh))
        except StudyError as error:
            return Placed(path, None, (str(error),))
    return Placed(path, scene, tuple(str(warning.message) for warning in remarks))


def placed_scene(
    name: str,
    organ: Organ,
    placing: Proposal,
    tissue: Tissue = LIVER,
    end: float = PRESSED * DURATION,
    checkpoints: int = CHECKPOINTS,
    frames: int = FRAMES,
) -> Scene:
    """The scene of a body from a file: held at an end, palpated as proposed by a probe in proportion to its size until
    `end` [s]. The content of a hollow organ is closed."""
    radius, depth = (round(share * placing.sides[0], 4) for share in (RADIUS, DEPTH))
    point, outward = placing.palpation.point, placing.palpation.normal
    inward = scaled(outward, -1.0)
    path = Trajectory((0.0, end), ((0.0, 0.0, 0.0), scaled(inward, depth + GAP)))
    pressed = f"a probe of {1e3 * radius:.3g} mm radius pushed in by {1e3 * depth:.3g} mm"
    return Scene(
        name=name,
        title=f"{name}: held at {placing.held_where}, {pressed}",
        organ=organ,
        lumen=Lumen() if "wall" in organ.parameters else None,
        tissue=tissue,
        duration=DURATION,
        frames=frames,
        checkpoints=press_times(0.0, end, checkpoints, DURATION),
        obstacles=(Sphere(along(point, outward, radius + GAP), radius, path),),
        held=(Held("end", placing.hold),),
        probed=ForceOutput("obstacle", 0, inward),
        damping=DAMPING,
        reference=PLAN,
    )


def study_on(study: Study, folder: Path, unit: str | None = None) -> tuple[Study, list[Placed]]:
    """A study with its cases on pressed solid organs transferred to the organs in a folder, and the result for each
    file. Of a study that presses none, all cases on solid organs are transferred.

    Raises StudyError for a unit or folder that is none, one whose every file is refused, and a study without a solid
    organ.
    """
    if unit is not None:
        check_unit(unit)
    solid = [case for case in study.cases if not has_wall(case.scene)]
    if not solid:
        raise StudyError(f"study '{study.name}' needs hollow organs, but a surface from a file is solid")
    placed = list(placed_organs(folder, unit))
    scenes = [one.scene for one in placed if one.scene is not None]
    if not scenes:
        raise StudyError(f"no file in {folder} can be used; the first: {placed[0].words[0]}")
    pressed = [case for case in solid if case.scene.obstacles] or solid  # as the organs in the folder are
    recipes = {case.replaced(scene=scenes[0], frames=None).key: case for case in pressed}
    cases = tuple(case.replaced(scene=scene, frames=None) for scene in scenes for case in recipes.values())
    name = readable(f"{study.name}-{folder.resolve().name}")
    return replace(study, name=name, cases=cases, main=False), placed
