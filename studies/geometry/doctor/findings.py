"""The findings of the mesh doctor: for each one a sentence and the option that repairs it."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

from studies.geometry.files.units import FAR_AWAY, LEAST_VOLUME, ORGAN, SMALLEST, UNITS, likely_units
from studies.geometry.mesh.quality import MIN_DIHEDRAL

POOR_TRIANGLE = 0.1
"""Radius ratio of a triangle below which springs on it are stiff and the fill gets slivers."""
SHELL = 0.02
"""Thickness 2 V / A over the diagonal below which a closed surface is a shell and no body; a ball has 0.19."""
TRY, COMMAND = "try ", "organbench mesh"
"""First words of advice that may fail, and of advice to use the mesh command."""
MESH = "organbench mesh --from FILE"
REMESH = f"try {MESH} --nodes N: it makes a new, even surface"
EXPORT = "export the file again from the program that made it"

REMARKS = {"small"}
"""Codes of findings that are no faults."""

Measures = dict[str, Any]


@dataclass(frozen=True)
class Finding:
    """One kind of fault of a mesh."""

    code: str
    """Stable name, for programs."""
    count: int
    """How often the fault occurs."""
    sentence: str
    mend: str
    """Advice on the repair."""


def _unit_sentence(m: Measures) -> str:
    side = max(m["size"]) / UNITS[m["unit"]]
    likely = " or ".join(likely_units(side)) or "no unit we know"
    return (
        f"the file does not say its unit, and its longest side of {side:.4g} is an organ's in {likely}; "
        f"the numbers here take it as {m['unit']}"
    )


def _wrong_size(m: Measures) -> bool:
    side = max(m.get("size", [0.0]))
    return m["unit_said"] and side > 0 and not SMALLEST <= side <= ORGAN[1]


def _small(m: Measures) -> bool:
    little = max(m.get("size", [0.0])) < ORGAN[0] or (m["closed"] and 0 < abs(m["volume"]) < LEAST_VOLUME)
    return m["unit_said"] and "size" in m and not _wrong_size(m) and little


def _inverted_sentence(m: Measures) -> str:
    if m["overlapping"]:
        return f"{m['inverted_tetrahedra']} tetrahedra have zero or negative volume: they are inverted"
    return f"{m['inverted_tetrahedra']} of {m['tetrahedra']} tetrahedra are numbered by the other hand"


def _open_sentence(m: Measures) -> str:
    count, edges = m["holes"], m["open_edges"]
    holes = "a hole" if count == 1 else f"{count} holes"
    sentence = f"the surface has {holes} ({edges} edges with one triangle only), so it has no inside and no volume"
    for widest in m["hole_list"][:1]:
        where = ", ".join(f"{1e3 * x:.4g}" for x in widest["middle"])
        sentence += f"; the widest is {1e3 * widest['width']:.3g} mm wide, at ({where}) mm"
    return sentence


def _below(m: Measures, name: str, limit: float) -> bool:
    return bool(m.get(name)) and m[name]["min"] < limit


RULES: tuple[tuple[str, str | Callable[[Measures], int], str | Callable[[Measures], str], str], ...] = (
    ("bad_points", "bad_points", "{bad_points} points are not numbers (NaN or infinite)", EXPORT),
    (
        "unit",
        lambda m: not m["unit_said"] and "size" in m,
        _unit_sentence,
        "say --unit mm, cm or m, or --longest-side 19cm",
    ),
    (
        "size",
        _wrong_size,
        lambda m: (
            f"the longest side is {max(m['size']):.4g} m, not a plausible organ size: the unit is probably not "
            + m["unit"]
        ),
        "say another --unit",
    ),
    (
        "small",
        _small,
        lambda m: (
            f"it is {1e3 * max(m['size']):.3g} mm long and encloses {1e6 * abs(m['volume']):.2g} mL, the size of an "
            "organ of a small animal"
        ),
        "if it is none, give another --unit, or choose another --part",
    ),
    (
        "far_away",
        lambda m: m.get("distance", 0.0) > FAR_AWAY,
        "it lies {distance:.3g} m from the origin of its coordinates, where coordinates lose precision",
        "move it to the origin in the program that made it",
    ),
    (
        "duplicate_points",
        "duplicate_points",
        "{duplicate_points} points coincide: triangles that look joined are not",
        f"{MESH} joins (welds) them",
    ),
    (
        "unused_points",
        "unused_points",
        "{unused_points} points are not used by any triangle and would be masses without springs",
        f"{MESH} leaves them out",
    ),
    (
        "collapsed",
        "collapsed_triangles",
        "{collapsed_triangles} triangles use a point twice and are only a line",
        f"{MESH} leaves them out",
    ),
    (
        "duplicate_triangles",
        "duplicate_triangles",
        "{duplicate_triangles} triangles occur twice, so the surface is double there",
        f"{MESH} leaves the second ones out",
    ),
    (
        "open",
        "open_edges",
        _open_sentence,
        f"{MESH} --close-holes puts flat lids on them; for large ones try --nodes N --solid L [mm]",
    ),
    (
        "shell",
        lambda m: bool(m.get("closed") and 0 < m["thickness"] < SHELL * m["diagonal"]),
        lambda m: (
            f"it is a thin shell, {1e3 * m['thickness']:.2g} mm thick (2 V / A) on {1e3 * m['diagonal']:.3g} mm: "
            "a capsule or a double wall, and no body"
        ),
        f"try {MESH} --nodes N --solid 5: it fills what the shell encloses, holes of 5 mm closed",
    ),
    (
        "crowded",
        "crowded_edges",
        "{crowded_edges} edges have more than two triangles: inside and outside are not defined there",
        REMESH,
    ),
    (
        "one_sided",
        lambda m: not m.get("two_sided", True),
        lambda m: f"the surface has one side only near {m['disagreeing_edges']} edges, like a Moebius band",
        f"try {MESH} --nodes N: it leaves out the triangles there",
    ),
    (
        "disagreeing",
        lambda m: m["disagreeing_edges"] if m.get("two_sided") else 0,
        "at {disagreeing_edges} edges neighbouring triangles have opposite orientations, so the volume comes out wrong",
        f"{MESH} flips them",
    ),
    (
        "inside_out",
        "inside_out_parts",
        lambda m: f"the surface is inverted (volume {1e6 * m['volume']:.4g} mL): its triangles face inwards",
        f"{MESH} flips it",
    ),
    (
        "pinched",
        "pinched_nodes",
        "at {pinched_nodes} points two sheets of the surface touch in one point only",
        REMESH,
    ),
    (
        "parts",
        lambda m: max(0, m.get("parts", 1) - m.get("lumens", 0) - 1),
        "there are {parts} separate parts; a body is one",
        f"{MESH} keeps the largest",
    ),
    (
        "handles",
        lambda m: max(0, m.get("genus") or 0),
        "the surface has {genus} handles or tunnels, as a ring has one; organs have none",
        f"try {MESH} --nodes N --smooth 3: it closes narrow ones",
    ),
    (
        "self_intersections",
        "self_intersections",
        "{self_intersections} pairs of triangles cut through each other: it cannot be filled",
        REMESH,
    ),
    ("flat", "flat_triangles", "{flat_triangles} triangles have practically no area, and so no normal", REMESH),
    (
        "slivers",
        lambda m: not m.get("flat_triangles") and _below(m, "triangle_radius_ratio", POOR_TRIANGLE),
        "triangle {worst_triangle} is a sliver (radius ratio {triangle_radius_ratio[min]:.2g}, 1 is equilateral; one "
        "in a hundred is under {triangle_radius_ratio[p1]:.2g}): springs on it are stiff and force a small time step",
        REMESH,
    ),
    ("duplicate_tetrahedra", "duplicate_tetrahedra", "{duplicate_tetrahedra} tetrahedra occur twice", EXPORT),
    (
        "inverted",
        "inverted_tetrahedra",
        _inverted_sentence,
        f"try {MESH}: it fills the surface again",
    ),
    (
        "tetrahedron_slivers",
        lambda m: _below(m, "dihedral_angle", MIN_DIHEDRAL),
        "the flattest tetrahedron has an angle of {dihedral_angle[min]:.2g} degrees between two faces (under "
        f"{MIN_DIHEDRAL:g}; radius ratio {{tetrahedron_radius_ratio[min]:.2g}}): it stiffens the body and forces a "
        "small time step",
        f"try {MESH} --nodes N: it makes a new body",
    ),
)
"""Code, count (a measure or a function of all), sentence (with measures in braces, or a function) and advice."""


def findings_of(measures: Measures) -> tuple[Finding, ...]:
    """All findings from the measures, in the order of RULES."""
    found = []
    for code, count, sentence, mend in RULES:
        times = int(measures.get(count) or 0) if isinstance(count, str) else int(count(measures))
        if times:
            said = sentence.format_map(measures) if isinstance(sentence, str) else sentence(measures)
            found.append(Finding(code, times, said, mend))
    return tuple(found)
