"""What stands in a results file: every field and attribute with shape, kind, unit and description, in one table.

Writers, the reader's check and the tests take it from here.
"""

from collections.abc import Mapping
from enum import StrEnum
from typing import Any

import numpy as np

from studies.store.parts import (
    INDEX,
    NUMBER,
    TEXT,
    AttributeSpec,
    FieldSpec,
    Table,
    array,
    lines_of,
    optional_array,
    optional_value,
    value,
)


class Status(StrEnum):
    """How a case ended."""

    OK = "ok"  # finished without a failure
    DIVERGED = "diverged"  # values not finite, or nodes that left
    FOLDED = "folded"  # J of an element is below 0.1 after a frame
    INVERTED = "inverted"  # J of an element is 0 or less after a frame
    SHAKEN = "shaken"  # the body gains energy that nothing gives it
    TUNNELLED = "tunnelled"  # the middle of a sphere or capsule, or part of the surface, was inside the body
    DRIFTED = "drifted"  # a kept volume more than 1 % off
    NOT_CONVERGED = "not-converged"  # the reference found no equilibrium at a checkpoint
    BLOCKED = "blocked"  # a thin probe was driven through tissue that had nowhere to go
    TIMED_OUT = "timed-out"  # took more processor time than a run may
    FAILED = "failed"  # could not start, or its process died three times; the message says why
    SKIPPED = "skipped"  # the method does not apply to the scene or the body; the message says why


COMPARABLE = (Status.OK, Status.TUNNELLED, Status.FOLDED, Status.INVERTED, Status.SHAKEN, Status.DRIFTED)
"""Statuses of runs that reach the last checkpoint: all their frames can be compared and timed."""
WITHOUT_FIELDS = (Status.FAILED, Status.SKIPPED)
"""Nothing was computed: such a record has no fields, and no attributes but warnings."""


LENGTHS: dict[str, str] = {
    "F": "frames",
    "m": "kept volumes",
    "o": "obstacles",
    "g": "held regions",
    "K": "checkpoints reached; of a reference, all",
    "P": "moments of a replay: about 60 and the checkpoints",
    "v": "nodes of the outer surface",
    "n": "nodes; of a reference, of second order",
    "s": "surface triangles",
    "c": "tetrahedra",
    "u": "surface triangles on one side of the cut",
    "p": "pairs of nodes that it parts",
    "y": "vertices of the coarsest mesh that a cut parts",
    "r": "repeats",
    "q": "stages of a step",
    "f": "solutions of a reference's family",
    "b": "vertices of its coarsest mesh",
    "d": "tetrahedra of that",
}


class RunFields(Table):
    """Of a run. Entries after an early end are NaN; what is optional is there where the case asks (`recorded`)."""

    t = array("F", NUMBER, "s", "end of each frame")
    volume = array("F m", NUMBER, "m^3", "enclosed volume, one column per kept volume")
    volume_target = array("F m", NUMBER, "m^3", "what each kept volume should be")
    pressure = array("F m", NUMBER, "Pa", "multiplier of each kept volume in the last step of the frame")
    contact_force = array("F o 3", NUMBER, "N", "force of each obstacle on the body at the end of the frame")
    penetration = array("F o", NUMBER, "m", "depth of the deepest point of the surface in each obstacle")
    inside = optional_array("F o", INDEX, "1", "1 where the middle of an obstacle was inside the body, else 0")
    held_force = array("F g 3", NUMBER, "N", "force of each held region on the body at the end of the frame")
    iterations = array("F 2", INDEX, "1", "for the multipliers: sum of the frame, most in a step")
    frame_steps = optional_array(
        "F", INDEX, "1", "steps of each frame: more than at rest where a load lowers the limit"
    )
    min_j = array("F", NUMBER, "1", "least J of an element, of a quadratic one at its points; NaN without")
    snapshot_frame = array("K", INDEX, "1", "number of the frame after which each snapshot was taken")
    snapshots = array("K n 3", NUMBER, "m", "positions at the scene's checkpoints")
    rest = array("n 3", NUMBER, "m", "rest positions")
    mass = array("n", NUMBER, "kg", "mass of each node")
    triangles = array("s 3", INDEX, "1", "nodes of each surface triangle, outward")
    tetrahedra = array("c 4", INDEX, "1", "nodes of each tetrahedron")
    kinetic = optional_array("F", NUMBER, "J", "kinetic energy")
    elastic = optional_array("F", NUMBER, "J", "elastic energy")
    work = optional_array("F", NUMBER, "J", "work of obstacles, held regions, gravity and fills since the start")
    cut_faces = optional_array("u 3", INDEX, "1", "surface triangles behind the cut")
    cut_pairs = optional_array("p 2", INDEX, "1", "nodes behind the cut and in front of it, at one place at rest")
    cut_parts = optional_array("m", INDEX, "1", "the piece of the cut body that each kept volume is in")
    surface_frame = optional_array("P", INDEX, "1", "frames before each position of the surface, 0 at the start")
    surface_node = optional_array("v", INDEX, "1", "nodes of the outer surface")
    surface = optional_array("P v 3", NUMBER, "m", "their positions, float32")


SURFACE = ("surface_frame", "surface_node", "surface")
"""Fields of a run that the word "surface" asks for."""


class Timed(Table):
    """What took time."""

    seconds = optional_value(float, "s", "wall time without compiling, for estimates")


class RunAttributes(Timed):
    """Of a run."""

    rest_volume = value(float, "m^3", "volume of the body at rest")
    dt = value(float, "s", "time step at rest; under load it may be shorter")
    dt_limit = value(float, "s", "stability limit of the time step")
    steps = value(int, "1", "steps per frame at rest")
    frame = value(float, "s", "length of a frame")
    frames = value(int, "1", "frames of the run", "F")
    good_frames = value(int, "1", "frames before an early end")
    nodes = value(int, "1", "nodes of the body", "n")
    springs = value(int, "1", "springs of the body")
    triangles = value(int, "1", "surface triangles of the body", "s")
    law = value(str, "", "stiffness law")
    skipped_steps = value(int, "1", "steps in which a volume had no gradient to push on")
    capped_steps = value(int, "1", "steps that corrected only part of a volume error")
    volumes = value(int, "1", "kept volumes", "m")
    lumen_column = value(int, "1", "which kept volume is a lumen; -1: none")
    cut_frame = optional_value(int, "1", "frames before the cut; what it parts is recorded twice from the start")
    cut_events = optional_value(int, "1", "how often the body is replaced by one cut farther")
    cut_limit_ratio = optional_value(float, "1", "stability limit after the cut over that before")
    cut_energy = optional_value(float, "1", "largest change of the energy when the body is replaced by the cut one")
    cut_momentum = optional_value(float, "1", "the same of the momentum, over the sum of its sizes in all nodes")
    cut_seconds = optional_value(float, "s", "longest wall time of replacing it")
    unknowns_per_volume = optional_value(float, "1", "coordinates for each kept volume")
    alternation = optional_value(float, "1", "rms of pressure less the mean of its neighbours', over mu")
    volume_off = optional_value(float, "1", "largest error of all kept volumes together after any frame")
    sway = optional_value(float, "1", "range of the force at rest about its trend, over its mean")
    gained = optional_value(float, "1", "energy that the body gains by itself, over its largest energy")
    swing = optional_value(float, "1", "root of the kinetic over the largest energy at the end, where loads rest")
    shortened = optional_value(float, "1", "most steps of a frame over those at rest: loads shorten steps")
    pace = optional_value(float, "1", "how many times as fast as with the masses of the tissue the body moves")
    heaviness = optional_value(float, "1", "inertial mass of the body over that of its tissue")
    heaviness_limit = optional_value(str, "", "what keeps a heavy body from being heavier")
    damping_moving = optional_value(float, "1/s", "damping of a heavy body while loads move; else the scene's")
    damping_at_rest = optional_value(float, "1/s", "the same where nothing moves")
    unbalanced = optional_value(float, "1", "force at a checkpoint that moves the body, over the largest force")
    unsettled = optional_value(float, "1", "mean way of the nodes to rest at the end, over the largest displacement")
    crossed = optional_value(float, "1", "share of the surface inside the body itself, the most at a checkpoint")
    missed_at_outlines = optional_value(float, "1", "error by coarse elements where held tissue or contact ends")
    warnings = value(str, "", "what preparing the case warned of, and what its indicators report")
    entry = optional_value(str, "", "of an entry from outside: its file, with the SHA-256 of its positions")
    entry_seconds = optional_value(float, "s/s", "of an entry from outside: computing time for a simulated second")
    league = optional_value(str, "", "of an entry of the league: what its file says, as JSON")
    own_files = optional_value(str, "", "files of the user with the method and the law: JSON, path to SHA-256")


class ReferenceFields(Table):
    """Of a reference, a row per checkpoint; NaN where the path did not get there."""

    t = array("K", NUMBER, "s", "scene time of each equilibrium")
    contact_force = array("K o 3", NUMBER, "N", "force of each obstacle on the body")
    held_force = array("K g 3", NUMBER, "N", "force of each held region on the body")
    volume = array("K", NUMBER, "1", "volume over rest volume")
    pressure = array("K", NUMBER, "Pa", "volume mean of the pressure, compression positive")
    lumen_pressure = array("K", NUMBER, "Pa", "pressure of the lumen")
    min_j = array("K", NUMBER, "1", "smallest J at a quadrature point")
    max_j = array("K", NUMBER, "1", "largest J at a quadrature point")
    penetration = array("K", NUMBER, "m", "deepest penetration of an obstacle")
    newton = array("K", NUMBER, "1", "Newton iterations")
    energy = array("K", NUMBER, "J", "strain energy")
    kinetic = array("K", NUMBER, "J", "kinetic energy; NaN without motion")
    balance = array("K", NUMBER, "J", "energy gained by the time steps themselves")
    displacement = array("K n 3", NUMBER, "m", "displacement of the second-order nodes")
    nodes = array("n 3", NUMBER, "m", "rest positions of the second-order nodes")
    tetrahedra = array("c 4", INDEX, "1", "vertices of each tetrahedron")
    sample_variant = array("f", TEXT, "", "the setting that was refined; empty for a mesh of the family")
    sample_unknowns = array("f", INDEX, "1", "unknowns of each solution, meshes from fine to coarse, then variants")
    sample_size = array("f", NUMBER, "m", "mean edge of the elements; NaN for nested meshes")
    sample_force = array("f K", NUMBER, "N", "probed force; NaN where a mesh was not solved")
    sample_volume = array("f K", NUMBER, "1", "volume over rest volume")
    sample_pressure = array("f K", NUMBER, "Pa", "volume mean of the pressure, compression positive")
    sample_lumen_pressure = array("f K", NUMBER, "Pa", "pressure of the lumen")
    sample_frequency = array("f", NUMBER, "Hz", "of the ringing; NaN where nothing rings")
    sample_displacement = array("f b 3", NUMBER, "m", "displacement of the sample points at the last checkpoint")
    sample_opening = optional_array("f y 3", NUMBER, "m", "at the last checkpoint, displacement across the cut")
    sample_points = array("b 3", NUMBER, "m", "vertices of the coarsest mesh at rest")
    sample_tetrahedra = array("d 4", INDEX, "1", "their tetrahedra")


class ReferenceAttributes(Table):
    """Of a reference."""

    scene = value(str, "", "name of the scene")
    unknowns = value(int, "1", "unknowns of the finest mesh")
    steps_done = value(int, "1", "checkpoints that were reached")
    off_shape = value(int, "1", "boundary nodes that are not on the true shape, or elements would fold")
    shape_error = optional_value(float, "1", "largest distance of the finest mesh from the true shape, over the size")
    warnings = optional_value(str, "", "that the finest mesh is far from the true shape")
    stopped = value(str, "", "why refinement ended before the plan's tolerance; empty where it did not")
    set = optional_value(str, "", "the published set and file of references that it is of")
    seconds = value(float, "s", "wall time of all solutions")


class TimingFields(Table):
    """Of frame times."""

    frame_ns = array("r F", NUMBER, "ns", "wall time of each frame, (repeat, frame)")
    cpu_ns = optional_array("r F", NUMBER, "ns", "processor time of the thread in each frame, (repeat, frame)")
    stage_ns = optional_array("q F", NUMBER, "ns", "time of each stage in each frame, (stage, frame)")
    stages = optional_array("q", TEXT, "", "names of the stages")


class TimingAttributes(Timed):
    """Of frame times."""

    core = optional_value(int, "1", "core that the process was pinned to; none where it cannot be")
    threads = value(int, "1", "threads that compiled code was allowed")
    repeats = value(int, "1", "repeats", "r")
    others = optional_value(float, "1", "share of the processors that other processes took; none where not known")
    processor = optional_value(str, "", "its name")
    disturbed = optional_value(str, "", "why the times are not those of the program alone; empty where nothing says so")


RUN_FIELDS, RUN_ATTRIBUTES = lines_of(RunFields, FieldSpec), lines_of(RunAttributes, AttributeSpec)
REFERENCE_FIELDS = lines_of(ReferenceFields, FieldSpec)
REFERENCE_ATTRIBUTES = lines_of(ReferenceAttributes, AttributeSpec)
TIMING_FIELDS, TIMING_ATTRIBUTES = lines_of(TimingFields, FieldSpec), lines_of(TimingAttributes, AttributeSpec)
LAYOUTS: dict[str, tuple[dict[str, FieldSpec], dict[str, AttributeSpec]]] = {
    "run": (RUN_FIELDS, RUN_ATTRIBUTES),
    "reference": (REFERENCE_FIELDS, REFERENCE_ATTRIBUTES),
    "timing": (TIMING_FIELDS, TIMING_ATTRIBUTES),
}
"""Kind of a record -> its fields and attributes. A record of another kind is not checked."""
NUMBERS_OF = {
    "run": dict.fromkeys(("triangles", "tetrahedra", "cut_faces", "cut_pairs", "surface_node"), "n"),
    "reference": {"tetrahedra": "n", "sample_tetrahedra": "b"},
}
"""Fields of a record that number other things: the letter of the length of these."""
FINITE = {"run": ("rest", "mass"), "reference": ("nodes", "sample_points")}
NOTHING = np.empty(0, int)


def fault(kind: str, status: Status, attributes: Mapping[str, Any], fields: Mapping[str, Any]) -> str | None:
    """The first thing in which a record differs from its table, as the end of a sentence ("lacks 'volume'"), or None.

    fields: name -> anything with `values` and `unit`.
    """
    if kind not in LAYOUTS or status in WITHOUT_FIELDS:
        return None
    field_specs, attribute_specs = LAYOUTS[kind]
    wrong = next(filter(None, (spec.fault(attributes) for spec in attribute_specs.values())), None)
    if wrong:
        return wrong
    unknown = sorted(set(fields) - set(field_specs))
    if unknown:
        return f"holds {unknown[0]!r}, which is not a field of a {kind}"
    lengths = {spec.length: attributes[name] for name, spec in attribute_specs.items() if spec.length}
    wrong = next(filter(None, (spec.fault(fields, lengths) for spec in field_specs.values())), None)
    if wrong:
        return wrong
    values = {name: np.asarray(item.values) for name, item in fields.items()}
    for name, letter in NUMBERS_OF.get(kind, {}).items():
        array = values.get(name, NOTHING)
        if array.size and not 0 <= int(array.min()) <= int(array.max()) < lengths[letter]:
            return f"holds {name!r} with numbers of {LENGTHS[letter].partition(';')[0]} that do not exist"
    whole = [name for name in FINITE.get(kind, ()) if not np.isfinite(values[name]).all()]
    if kind == "run" and status in COMPARABLE and not (lengths["K"] and np.isfinite(values["snapshots"]).all()):
        whole.append("snapshots")
    return f"holds {whole[0]!r} without all its numbers" if whole else None
