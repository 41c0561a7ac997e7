"""Writes a scene file for a user's organ that the user can read and change."""

import json
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

from studies.geometry.files.units import Source, stem_of
from studies.scene.chosen_place import DEPTH, GAP, RADIUS
from studies.scene.proposal import Proposal

TEXT = '''"""{name}: held at {where}, palpated on a patch. Written by `organbench place`; change what you like."""

from pathlib import Path

from massspring import Sphere, Trajectory
from studies import Case, Chart, ForceOutput, Held, ImplicitVolume, Organ, ReferencePlan, Scene, Study, {bodies}
from studies.geometry import {region}
from studies.scene.placing import along, press_times, scaled
from studies.scene.tissues import {tissue}

FILE = {file}
POINT = {point}  # m, on the surface
NORMAL = {normal}  # outward
RADIUS, DEPTH, GAP = {radius}, {depth}, {gap}  # m, of the probe
PRESS_END, DURATION = 6.0, 8.0  # s
INWARD = scaled(NORMAL, -1.0)

SCENE = Scene(
    name="{name}",
    title="{name}: held at {where}, a probe of {radius_mm:.3g} mm radius pushed in by {depth_mm:.3g} mm",
    organ=Organ("file", {{{organ}}}),
    tissue={tissue},
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
{lumen}    probed=ForceOutput("obstacle", 0, INWARD),
    damping=8.0,
    reference={reference},
)
CASES = (
{recommended}    # {kept}: quick, but inaccurate (docs/findings.md, the paper's body).
    Case(SCENE, TetrahedralBody({nodes}), ImplicitVolume(), timed=True, recorded=("surface",)),
)
CHARTS = (
    Chart("volume.png", "studies.plots.volume_history:draw"),
    Chart("force.png", "studies.plots.force_path:draw"),
    Chart("accuracy.png", "studies.plots.accuracy:draw"),
)
COLUMNS = ("force_end", "mean_error", "shape_error", "shape_volume", "volume_worst")
STUDY = Study("{name}", "{missing}How near are these bodies to the reference?", CASES, CHARTS, COLUMNS)
'''
RECOMMENDED = """    # {promise}.
    # Shape of this organ: {shape}.
    Case(
        SCENE,
        {body},
        ImplicitVolume(),
        dt_fraction={dt_fraction:g},
        timed=True,
        recorded=("surface",),
    ),
"""


@dataclass(frozen=True)
class Recommended:
    """The first body of a scene file."""

    body: str
    """As Python: "QuadraticBody(nodes=794)"."""
    dt_fraction: float
    """Time step over the stability limit."""
    promise: str
    """Its errors on random organs, in words."""
    shape: str
    """How far it is from the shape of this organ, in words."""
    keeps_shape: bool


def scene_text(
    proposal: Proposal,
    organ: Mapping[str, object],
    tissue: str,
    nodes: int,
    recommended: Recommended | None,
    folder: Path,
    reference: str = "ReferencePlan()",
) -> str:
    """A Python file, in `folder`, that defines SCENE and STUDY for the organ in a file.

    organ: parameters of Organ("file"), see organ_options; tissue: a name of TISSUES; nodes: of the body of one volume;
    recommended: a better body, None if none is known; reference: its plan, as Python."""
    path = Path(str(organ["path"]))
    given = {key: json.dumps(value) if isinstance(value, str) else repr(value) for key, value in organ.items()}
    entries = ", ".join(f'"{key}": {text}' for key, text in (given | {"path": "str(FILE)"}).items())
    radius, depth = (round(share * proposal.sides[0], 4) for share in (RADIUS, DEPTH))
    second, missing, hollow = "", "", "wall" in organ
    bodies = {"TetrahedralBody"} | ({"Lumen"} if hollow else set())
    if recommended is not None:
        bodies.add(recommended.body.split("(")[0])
        second = RECOMMENDED.format(**vars(recommended))
        missing = "" if recommended.keeps_shape else f"Part of the shape is missing: {recommended.shape}. "
    return TEXT.format(
        name=python_name(stem_of(path)),
        where=proposal.held_where,
        file=file_in_python(path, folder),
        point=proposal.palpation.point,
        normal=proposal.palpation.normal,
        radius=radius,
        depth=depth,
        gap=GAP,
        radius_mm=1e3 * radius,
        depth_mm=1e3 * depth,
        organ=entries,
        tissue=tissue.upper(),
        lumen="    lumen=Lumen(),  # a closed content, which keeps its volume\n" * hollow,
        region=type(proposal.hold).__name__,
        hold=", ".join(str(value) for value in vars(proposal.hold).values()).join(
            (f"{type(proposal.hold).__name__}(", ")")
        ),
        nodes=nodes,
        missing=missing,
        reference=reference,
        kept="Wall and content as two volumes" if hollow else "One volume, which the paper keeps",
        bodies=", ".join(sorted(bodies)),
        recommended=second,
    )


def organ_options(source: Source, how: Mapping[str, object]) -> dict[str, object]:
    """The parameters of Organ("file") that give the same body; how: options for the mesher, by the names of
    studies.geometry.api.scans.Remeshing."""
    given = {"path": str(source.path), "unit": source.unit, "scale": None if source.scale == 1.0 else source.scale}
    given |= {"longest_side": source.longest_side, "part": source.part, "remesh": True}
    given |= {key: value for key, value in how.items() if key != "smooth" or value}
    return {key: value for key, value in given.items() if value is not None and value is not False}


def file_in_python(path: Path, folder: Path) -> str:
    """The path as Python in a scene file: relative to its folder for a file below it, else whole."""
    path, folder = path.resolve(), folder.resolve()
    if not path.is_relative_to(folder):
        return f"Path({quoted(path.as_posix())})"
    return f"Path(__file__).parent / {quoted(path.relative_to(folder).as_posix())}"


def quoted(text: str) -> str:
    """A text of one line as Python."""
    return json.dumps(text, ensure_ascii=False)


def python_name(stem: str) -> str:
    """Letters, digits and underscores."""
    return "".join(c if c.isascii() and c.isalnum() else "_" for c in stem).strip("_")[:40] or "organ"
