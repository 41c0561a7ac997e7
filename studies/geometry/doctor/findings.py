"""The findings of the mesh doctor: for each one a sentence and the option that repairs it."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

from studies.geometry.files.units import FAR_AWAY, LEAST_VOLUME, UNITS, likely_units
from studies.geometry.mesh.quality import MIN_DIHEDRAL

POOR_TRIANGLE = 0.1
"""Radius ratio of a triangle below which springs on it are stiff and the fill gets slivers."""

SHELL = 0.02
"""Thickness 2 V / A over the diagonal below which a closed surface is a shell and no body; a ball has 0.19."""
TRY, COMMAND = "try ", "organbench mesh"
"""First words of advice that may fail, and of advice to use the mesh command."""
REMESH = "try organbench mesh --from FILE --nodes N: it makes a new, even surface"
EXPORT = "export the file again from the program that made it"


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


Rule = tuple[str, Callable[[dict[str, Any]], int], Callable[[dict[str, Any]], str], str]


def _number(name: str) -> Callable[[dict[str, Any]], int]:
    return lambda m: int(m.get(name) or 0)


def _poor(name: str, key: str, limit: float) -> Callable[[dict[str, Any]], int]:
    """Count of a rule: 1 if the value `key` of the spread `name` is below the limit, else 0."""
    return lambda m: int(bool(m.get(name)) and m[name][key] < limit)


def _unit_sentence(m: dict[str, Any]) -> str:
    side = max(m["size"]) / UNITS[m["unit"]]
    likely = " or ".join(likely_units(side)) or "no unit we know"
    return (
        f"the file does not say its unit, and its longest side of {side:.4g} is an organ's in {likely}; "
        f"the numbers here take it as {m['unit']}"
    )


def _size_sentence(m: dict[str, Any]) -> str:
    return (
        f"the longest side is {max(m['size']):.4g} m, not a plausible organ size: the unit is probably not {m['unit']}"
    )


def _wrong_size(m: dict[str, Any]) -> int:
    side = max(m.get("size", [0.0]))
    return int(m["unit_said"] and side > 0 and "m" not in likely_units(side))


def _too_small(m: dict[str, Any]) -> int:
    return int(m["unit_said"] and bool(m.get("closed")) and 0 < abs(m["volume"]) < LEAST_VOLUME)


def _open_sentence(m: dict[str, Any]) -> str:
    count, edges = m["holes"], m["open_edges"]
    holes = "a hole" if count == 1 else f"{count} holes"
    sentence = f"the surface has {holes} ({edges} edges with one triangle only), so it has no inside and no volume"
    for widest in m["hole_list"][:1]:
        where = ", ".join(f"{1e3 * x:.4g}" for x in widest["middle"])
        sentence += f"; the widest is {1e3 * widest['width']:.3g} mm wide, at ({where}) mm"
    return sentence


def _sliver_sentence(m: dict[str, Any]) -> str:
    ratio = m["triangle_radius_ratio"]
    return (
        f"triangle {m['worst_triangle']} is a sliver (radius ratio {ratio['min']:.2g}, 1 is equilateral; one in a "
        f"hundred is under {ratio['p1']:.2g}): springs on it are stiff and force a small time step"
    )


def _tet_sliver_sentence(m: dict[str, Any]) -> str:
    return (
        f"the flattest tetrahedron has an angle of {m['dihedral_angle']['min']:.2g} degrees between two faces (under "
        f"{MIN_DIHEDRAL:g}; radius ratio {m['tetrahedron_radius_ratio']['min']:.2g}): it stiffens the body and forces "
        "a small time step"
    )


def _is_shell(m: dict[str, Any]) -> int:
    return int(bool(m.get("closed")) and 0 < m["thickness"] < SHELL * m["diagonal"])


RULES: tuple[Rule, ...] = (
    (
        "bad_points",
        _number("bad_points"),
        lambda m: f"{m['bad_points']} points are not numbers (NaN or infinite)",
        EXPORT,
    ),
    (
        "unit",
        lambda m: int(not m["unit_said"] and "size" in m),
        _unit_sentence,
        "say --unit mm, cm or m, or --longest-side 19cm",
    ),
    ("size", _wrong_size, _size_sentence, "say another --unit"),
    (
        "small",
        _too_small,
        lambda m: f"it encloses {1e6 * abs(m['volume']):.2g} mL, and no organ is smaller than 1 mL",
        "give another --unit, or choose another --part",
    ),
    (
        "far_away",
        lambda m: int(m.get("distance", 0.0) > FAR_AWAY),
        lambda m: f"it lies {m['distance']:.3g} m from the origin of its coordinates, where coordinates lose precision",
        "move it to the origin in the program that made it",
    ),
    (
        "duplicate_points",
        _number("duplicate_points"),
        lambda m: f"{m['duplicate_points']} points coincide: triangles that look joined are not",
        "organbench mesh --from FILE joins (welds) them",
    ),
    (
        "unused_points",
        _number("unused_points"),
        lambda m: f"{m['unused_points']} points are not used by any triangle and would be masses without springs",
        "organbench mesh --from FILE leaves them out",
    ),
    (
        "collapsed",
        _number("collapsed_triangles"),
        lambda m: f"{m['collapsed_triangles']} triangles use a point twice and are only a line",
        "organbench mesh --from FILE leaves them out",
    ),
    (
        "duplicate_triangles",
        _number("duplicate_triangles"),
        lambda m: f"{m['duplicate_triangles']} triangles occur twice, so the surface is double there",
        "organbench mesh --from FILE leaves the second ones out",
    ),
    (
        "open",
        _number("open_edges"),
        _open_sentence,
        "organbench mesh --from FILE --close-holes puts flat lids on them; for large ones try --nodes N --solid L [mm]",
    ),
    (
        "shell",
        _is_shell,
        lambda m: (
            f"it is a thin shell, {1e3 * m['thickness']:.2g} mm thick (2 V / A) on {1e3 * m['diagonal']:.3g} mm: a "
            "capsule or a double wall, and no body"
        ),
        "try organbench mesh --from FILE --nodes N --solid 5: it fills what the shell encloses, holes of 5 mm closed",
    ),
    (
        "crowded",
        _number("crowded_edges"),
        lambda m: f"{m['crowded_edges']} edges have more than two triangles: inside and outside are not defined there",
        REMESH,
    ),
    (
        "one_sided",
        lambda m: int("two_sided" in m and not m["two_sided"]),
        lambda m: "the surface has one side only, like a Moebius band: it cannot enclose anything",
        EXPORT,
    ),
    (
        "disagreeing",
        lambda m: m["disagreeing_edges"] if m.get("two_sided") else 0,
        lambda m: (
            f"at {m['disagreeing_edges']} edges neighbouring triangles have opposite orientations, so the volume comes "
            "out wrong"
        ),
        "organbench mesh --from FILE flips them",
    ),
    (
        "inside_out",
        _number("inside_out_parts"),
        lambda m: f"the surface is inverted (volume {1e6 * m['volume']:.4g} mL): its triangles face inwards",
        "organbench mesh --from FILE flips it",
    ),
    (
        "pinched",
        _number("pinched_nodes"),
        lambda m: f"at {m['pinched_nodes']} points two sheets of the surface touch in one point only",
        REMESH,
    ),
    (
        "parts",
        lambda m: max(0, m.get("parts", 1) - m.get("lumens", 0) - 1),
        lambda m: f"there are {m['parts']} separate parts; a body is one",
        "organbench mesh --from FILE keeps the largest",
    ),
    (
        "handles",
        lambda m: max(0, m.get("genus") or 0),
        lambda m: f"the surface has {m['genus']} handles or tunnels, as a ring has one; organs have none",
        "try organbench mesh --from FILE --nodes N --smooth 3: it closes narrow ones",
    ),
    (
        "self_intersections",
        _number("self_intersections"),
        lambda m: f"{m['self_intersections']} pairs of triangles cut through each other: it cannot be filled",
        REMESH,
    ),
    (
        "flat",
        _number("flat_triangles"),
        lambda m: f"{m['flat_triangles']} triangles have practically no area, and so no normal",
        REMESH,
    ),
    (
        "slivers",
        lambda m: _poor("triangle_radius_ratio", "min", POOR_TRIANGLE)(m) if not m.get("flat_triangles") else 0,
        _sliver_sentence,
        REMESH,
    ),
    (
        "duplicate_tetrahedra",
        _number("duplicate_tetrahedra"),
        lambda m: f"{m['duplicate_tetrahedra']} tetrahedra occur twice",
        EXPORT,
    ),
    (
        "inverted",
        _number("inverted_tetrahedra"),
        lambda m: f"{m['inverted_tetrahedra']} tetrahedra have zero or negative volume: they are inverted",
        "try organbench mesh --from FILE: it fills the surface again",
    ),
    (
        "tetrahedron_slivers",
        _poor("dihedral_angle", "min", MIN_DIHEDRAL),
        _tet_sliver_sentence,
        "try organbench mesh --from FILE --nodes N: it makes a new body",
    ),
)


def findings_of(measures: dict[str, Any]) -> tuple[Finding, ...]:
    """All findings from the measures, in the order of RULES."""
    rows = [(code, count(measures), sentence, mend) for code, count, sentence, mend in RULES]
    return tuple(Finding(code, int(n), sentence(measures), mend) for code, n, sentence, mend in rows if n)
