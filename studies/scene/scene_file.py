"""A scene file for an organ of one's own, written for a person to read and change."""

import json
from pathlib import Path

from studies.geometry.files.units import Source
from studies.scene.proposal import Proposal

TEXT = '''"""{name}: held at an end, palpated on a flat side. Proposed by `organbench place`; change what you like."""

from pathlib import Path

from massspring import Sphere, Trajectory
from studies import BodyRecipe, Case, ForceOutput, Held, ImplicitVolume, Organ, ReferencePlan, Scene, Study
from studies.geometry import HalfSpace
from studies.scene.placing import along, press_times, scaled
from studies.scene.tissues import LIVER

FILE = Path(__file__).parent / "{file}"
POINT = {point}  # m, on the surface
NORMAL = {normal}  # outward
RADIUS, DEPTH, GAP = {radius}, {depth}, 0.0005  # m, of the probe
PRESS_END, DURATION = 6.0, 8.0  # s
INWARD = scaled(NORMAL, -1.0)

SCENE = Scene(
    name="{name}",
    title="{name}: held at one end, a probe of {radius_mm:.3g} mm radius pushed in by {depth_mm:.3g} mm",
    organ=Organ("file", {{{organ}}}),
    tissue=LIVER,
    duration=DURATION,
    frames=240,
    checkpoints=press_times(0.0, PRESS_END, 5, DURATION),
    obstacles=(
        Sphere(
            along(POINT, NORMAL, RADIUS + GAP),
            RADIUS,
            Trajectory((0.0, PRESS_END), ((0.0, 0.0, 0.0), scaled(INWARD, DEPTH + GAP))),
        ),
    ),
    held=(Held("end", {hold}),),
    probed=ForceOutput("obstacle", 0, INWARD),
    damping=8.0,
    reference=ReferencePlan("solid", (250, 360, 550), at_outlines=(1, 2, 3), at_contact=(3, 4, 5)),
)
CASE = Case(SCENE, BodyRecipe("tetrahedral", {nodes}), ImplicitVolume())
COLUMNS = ("force_end", "mean_error", "volume_worst")
STUDY = Study("{name}", "How near is it to the reference?", (CASE,), (), COLUMNS)
'''
RADIUS, DEPTH = 0.10, 0.05
"""Of the longest side: the probe's radius, and how far it goes in."""


def scene_text(found: Proposal, source: Source, options: dict[str, object], nodes: int, folder: Path) -> str:
    """A Python file, in `folder`, that defines SCENE and STUDY for the organ in a file.

    options: of Organ("file") beside path, unit, scale, longest_side and part."""
    given = {"unit": source.unit, "scale": None if source.scale == 1.0 else source.scale}
    given |= {"longest_side": source.longest_side, "part": source.part, "remesh": True}
    shown = {key: value for key, value in (given | options).items() if value is not None}
    texts = {key: json.dumps(value) if isinstance(value, str) else repr(value) for key, value in shown.items()}
    entries = ", ".join(['"path": str(FILE)', *(f'"{key}": {text}' for key, text in texts.items())])
    radius, depth = (round(share * found.sides[0], 4) for share in (RADIUS, DEPTH))
    return TEXT.format(
        name=python_name(source.path.stem),
        file=relative(source.path, folder),
        point=found.palpation.point,
        normal=found.palpation.normal,
        radius=radius,
        depth=depth,
        radius_mm=1e3 * radius,
        depth_mm=1e3 * depth,
        organ=entries,
        hold=f"HalfSpace({found.hold.point}, {found.hold.normal})",
        nodes=nodes,
    )


def relative(path: Path, folder: Path) -> str:
    """The path as seen from the folder, where there is a way without going up; else the whole path."""
    path, folder = path.resolve(), folder.resolve()
    return path.relative_to(folder).as_posix() if path.is_relative_to(folder) else path.as_posix()


def python_name(stem: str) -> str:
    """Letters, digits and underscores."""
    return "".join(c if c.isascii() and c.isalnum() else "_" for c in stem).strip("_")[:40] or "organ"
