"""What stands in a results file: every field and attribute with shape, kind, unit and description, in one table.

Writers, the reader's check, docs/results.md and the tests take it from here.
"""

from dataclasses import dataclass
from enum import StrEnum

NUMBER, INDEX, TEXT = "number", "whole number", "text"


class Status(StrEnum):
    """How a case ended."""

    OK = "ok"
    DIVERGED = "diverged"
    INVERTED = "inverted"
    DRIFTED = "drifted"
    NOT_CONVERGED = "not-converged"
    BLOCKED = "blocked"
    TIMED_OUT = "timed-out"
    FAILED = "failed"
    SKIPPED = "skipped"


STATUSES: dict[Status, str] = {
    Status.OK: "finished, with nothing to object to",
    Status.DIVERGED: "values not finite, or nodes that left",
    Status.INVERTED: "a tetrahedron ends inside out",
    Status.DRIFTED: "a kept volume more than 1 % off",
    Status.NOT_CONVERGED: "the reference found no equilibrium at a checkpoint",
    Status.BLOCKED: "a thin probe was driven through tissue that had nowhere to go",
    Status.TIMED_OUT: "took more processor time than a run may",
    Status.FAILED: "could not start, or its process died three times; the message says why",
    Status.SKIPPED: "the method does not apply to the scene or the body; the message says why",
}
WITHOUT_FIELDS = (Status.FAILED, Status.SKIPPED)
"""Nothing was computed: such a record has no fields, and no attributes but warnings."""


@dataclass(frozen=True)
class FieldSpec:
    """An array of a record. shape: lengths as letters (LENGTHS) or numbers, with blanks between."""

    shape: str
    kind: str
    unit: str
    description: str
    optional: bool = False


@dataclass(frozen=True)
class AttributeSpec:
    """A number or text of a record. length: the letter in shapes that it is the length of; optional: may be None or
    left out."""

    kind: str
    unit: str
    description: str
    length: str = ""
    optional: bool = False


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
    "r": "repeats",
    "q": "stages of a step",
}

RUN_FIELDS: dict[str, FieldSpec] = {
    "t": FieldSpec("F", NUMBER, "s", "end of each frame"),
    "volume": FieldSpec("F m", NUMBER, "m^3", "enclosed volume, one column per kept volume"),
    "volume_target": FieldSpec("F m", NUMBER, "m^3", "what each kept volume should be"),
    "pressure": FieldSpec("F m", NUMBER, "Pa", "multiplier of each kept volume in the last step of the frame"),
    "contact_force": FieldSpec("F o 3", NUMBER, "N", "force of each obstacle on the body, mean of the frame"),
    "penetration": FieldSpec("F o", NUMBER, "m", "depth of the deepest surface node in each obstacle"),
    "held_force": FieldSpec("F g 3", NUMBER, "N", "force of each held region on the body, mean of the frame"),
    "iterations": FieldSpec("F 2", INDEX, "1", "for the multipliers: sum of the frame, most in a step"),
    "min_j": FieldSpec("F", NUMBER, "1", "smallest tetrahedron volume ratio; NaN without tetrahedra"),
    "snapshot_frame": FieldSpec("K", INDEX, "1", "number of the frame after which each snapshot was taken"),
    "snapshots": FieldSpec("K n 3", NUMBER, "m", "positions at the scene's checkpoints"),
    "rest": FieldSpec("n 3", NUMBER, "m", "rest positions"),
    "mass": FieldSpec("n", NUMBER, "kg", "mass of each node"),
    "triangles": FieldSpec("s 3", INDEX, "1", "nodes of each surface triangle, outward"),
    "tetrahedra": FieldSpec("c 4", INDEX, "1", "nodes of each tetrahedron"),
    "kinetic": FieldSpec("F", NUMBER, "J", "kinetic energy", optional=True),
    "elastic": FieldSpec("F", NUMBER, "J", "energy of the springs", optional=True),
    "surface_frame": FieldSpec("P", INDEX, "1", "frames before each position of the surface, 0 at the start", True),
    "surface_node": FieldSpec("v", INDEX, "1", "nodes of the outer surface", True),
    "surface": FieldSpec("P v 3", NUMBER, "m", "their positions, float32", True),
}
"""Of a run. Entries after an early end are NaN; what is optional is there where the case asks (`recorded`)."""
SURFACE = ("surface_frame", "surface_node", "surface")
"""Fields of a run that the word "surface" asks for."""

SECONDS = {"seconds": AttributeSpec(NUMBER, "s", "wall time without compiling, for estimates", optional=True)}
RUN_ATTRIBUTES: dict[str, AttributeSpec] = SECONDS | {
    "rest_volume": AttributeSpec(NUMBER, "m^3", "volume of the body at rest"),
    "dt": AttributeSpec(NUMBER, "s", "time step"),
    "dt_limit": AttributeSpec(NUMBER, "s", "stability limit of the time step"),
    "steps": AttributeSpec(INDEX, "1", "steps per frame"),
    "frame": AttributeSpec(NUMBER, "s", "length of a frame"),
    "frames": AttributeSpec(INDEX, "1", "frames of the run", length="F"),
    "good_frames": AttributeSpec(INDEX, "1", "frames before an early end"),
    "nodes": AttributeSpec(INDEX, "1", "nodes of the body", length="n"),
    "springs": AttributeSpec(INDEX, "1", "springs of the body"),
    "triangles": AttributeSpec(INDEX, "1", "surface triangles of the body", length="s"),
    "law": AttributeSpec(TEXT, "", "stiffness law"),
    "skipped_steps": AttributeSpec(INDEX, "1", "steps in which a volume had nothing to push on"),
    "capped_steps": AttributeSpec(INDEX, "1", "steps that made up for a part of a wrong volume"),
    "volumes": AttributeSpec(INDEX, "1", "kept volumes", length="m"),
    "lumen_column": AttributeSpec(INDEX, "1", "which kept volume is a lumen; -1: none"),
    "unknowns_per_volume": AttributeSpec(NUMBER, "1", "coordinates for each kept volume", optional=True),
    "alternation": AttributeSpec(
        NUMBER, "1", "rms of pressure less the mean of its neighbours', over mu", optional=True
    ),
    "sway": AttributeSpec(NUMBER, "1", "range of the force at rest about its trend, over its mean", optional=True),
    "warnings": AttributeSpec(TEXT, "", "what preparing the case warned of, and what its indicators tell"),
    "entry": AttributeSpec(
        TEXT, "", "of an entry from outside: its file, with the SHA-256 of its positions", optional=True
    ),
    "entry_seconds": AttributeSpec(
        NUMBER, "s/s", "of an entry from outside: computing time for a simulated second", optional=True
    ),
    "own_files": AttributeSpec(
        TEXT, "", "files of the user with the method and the law: JSON, path to SHA-256", optional=True
    ),
    "portable": AttributeSpec(TEXT, "", "settings of a result that is equal on every x86-64 processor", optional=True),
}

REFERENCE_FIELDS: dict[str, FieldSpec] = {
    "t": FieldSpec("K", NUMBER, "s", "scene time of each equilibrium"),
    "contact_force": FieldSpec("K o 3", NUMBER, "N", "force of each obstacle on the body"),
    "held_force": FieldSpec("K g 3", NUMBER, "N", "force of each held region on the body"),
    "volume": FieldSpec("K", NUMBER, "1", "volume over rest volume"),
    "pressure": FieldSpec("K", NUMBER, "Pa", "volume mean of the pressure, compression positive"),
    "lumen_pressure": FieldSpec("K", NUMBER, "Pa", "pressure of the lumen"),
    "min_j": FieldSpec("K", NUMBER, "1", "smallest J at a quadrature point"),
    "max_j": FieldSpec("K", NUMBER, "1", "largest J at a quadrature point"),
    "penetration": FieldSpec("K", NUMBER, "m", "deepest penetration of an obstacle"),
    "newton": FieldSpec("K", NUMBER, "1", "Newton iterations"),
    "energy": FieldSpec("K", NUMBER, "J", "strain energy"),
    "kinetic": FieldSpec("K", NUMBER, "J", "kinetic energy; NaN without motion"),
    "balance": FieldSpec("K", NUMBER, "J", "energy gained by the time steps themselves"),
    "displacement": FieldSpec("K n 3", NUMBER, "m", "displacement of the second-order nodes"),
    "nodes": FieldSpec("n 3", NUMBER, "m", "rest positions of the second-order nodes"),
    "tetrahedra": FieldSpec("c 4", INDEX, "1", "vertices of each tetrahedron"),
}
"""Of a reference, a row per checkpoint; NaN where the path did not get there."""

REFERENCE_ATTRIBUTES: dict[str, AttributeSpec] = {
    "scene": AttributeSpec(TEXT, "", "name of the scene"),
    "level": AttributeSpec(NUMBER, "1", "mesh of the family: surface nodes, or element size over radius"),
    "variant": AttributeSpec(TEXT, "", "the setting that was made better; empty for none"),
    "unknowns": AttributeSpec(INDEX, "1", "unknowns of the finite-element problem"),
    "steps_done": AttributeSpec(INDEX, "1", "checkpoints that were reached"),
    "seconds": AttributeSpec(NUMBER, "s", "wall time of the solution"),
    "portable": AttributeSpec(TEXT, "", "settings of a result that is equal on every x86-64 processor", optional=True),
}

TIMING_FIELDS: dict[str, FieldSpec] = {
    "frame_ns": FieldSpec("r F", NUMBER, "ns", "time of each frame, (repeat, frame)"),
    "stage_ns": FieldSpec("q F", NUMBER, "ns", "time of each stage in each frame, (stage, frame)", optional=True),
    "stages": FieldSpec("q", TEXT, "", "names of the stages", optional=True),
}
TIMING_ATTRIBUTES: dict[str, AttributeSpec] = SECONDS | {
    "core": AttributeSpec(INDEX, "1", "core that the process was pinned to; none where it cannot be", optional=True),
    "threads": AttributeSpec(INDEX, "1", "threads that compiled code was allowed"),
    "repeats": AttributeSpec(INDEX, "1", "repeats", length="r"),
}

LAYOUTS: dict[str, tuple[dict[str, FieldSpec], dict[str, AttributeSpec]]] = {
    "run": (RUN_FIELDS, RUN_ATTRIBUTES),
    "reference": (REFERENCE_FIELDS, REFERENCE_ATTRIBUTES),
    "timing": (TIMING_FIELDS, TIMING_ATTRIBUTES),
}
"""Kind of a record -> its fields and attributes. A record of another kind is not checked."""


def tables() -> str:
    """The tables of docs/results.md in Markdown."""
    parts = []
    for kind, (fields, attributes) in LAYOUTS.items():
        parts += [f"### {kind}", "", "| dataset | shape | unit | |", "|---|---|---|---|"]
        for name, spec in fields.items():
            optional = " (optional)" if spec.optional else ""
            parts.append(
                f"| {name} | ({', '.join(spec.shape.split())}) | {spec.unit or 'text'} | {spec.description}{optional} |"
            )
        parts += ["", "| attribute | unit | |", "|---|---|---|"]
        parts += [f"| {name} | {spec.unit or 'text'} | {spec.description} |" for name, spec in attributes.items()]
        parts.append("")
    parts += ["| letter | number of |", "|---|---|"]
    parts += [*(f"| {letter} | {what} |" for letter, what in LENGTHS.items()), ""]
    parts += ["| status | |", "|---|---|", *(f"| `{status}` | {what} |" for status, what in STATUSES.items())]
    return "\n".join(parts)
