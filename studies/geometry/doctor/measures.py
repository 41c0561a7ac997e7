"""The measures of the mesh doctor."""

from typing import Any

import numpy as np
from scipy.spatial.distance import pdist

from massspring import MassSpringError, Material, step_limit, surface_body, tetrahedral_body
from studies.base.errors import StudyError
from studies.geometry.mesh.checks import SLIVER, pinched_nodes
from studies.geometry.mesh.organ_mesh import (
    connected,
    counted_edges,
    signed_volume,
    tetrahedron_volumes,
    triangle_areas,
    unique_edges,
)
from studies.geometry.mesh.quality import dihedral_angles, tetrahedron_radius_ratio, triangle_radius_ratio
from studies.geometry.surface.intersections import crossing_triangles
from studies.geometry.surface.repair import border, edge_pairs, encloses, largest, oriented, part_of, without_repeats

MEASURED_BODY = 6000
"""Most nodes of a body for which the largest frequency of the springs is computed, which takes seconds."""
OVERLAP = 1e-9
"""Share of the volume below which tetrahedra only seem to overlap, by rounding."""
RIM = 500
"""Most nodes of a border between which distances are measured; of more, every k-th is taken."""


def describe_surface(points: np.ndarray, triangles: np.ndarray) -> dict[str, Any]:
    """Measures of welded triangles (t, 3) on points (n, 3) [m]: topology, orientation, size and quality."""
    sound = without_repeats(triangles)
    rows = np.sort(triangles, axis=1)
    collapsed = int((rows[:, 1:] == rows[:, :-1]).any(axis=1).sum())
    measures: dict[str, Any] = {"nodes": len(points), "triangles": len(triangles), "collapsed_triangles": collapsed}
    measures["duplicate_triangles"] = len(triangles) - len(sound) - collapsed
    measures |= describe_edges(sound)
    measures |= describe_parts(points, sound, measures) | describe_size(points, sound)
    listed = measures["holes"] and measures["two_sided"]
    measures["hole_list"] = hole_list(points, oriented(sound, "")[0]) if listed else []
    measures["self_intersections"] = len(crossing_triangles(points, sound))
    return measures


def describe_edges(triangles: np.ndarray) -> dict[str, Any]:
    """Connections of triangles (t, 3): open, crowded and disagreeing edges, holes, pinched nodes."""
    _, counts = counted_edges(triangles)
    _, agree = edge_pairs(triangles)
    open_edges, crowded = int((counts == 1).sum()), int((counts > 2).sum())
    try:
        turned, two_sided = oriented(triangles, "")[0], True
    except StudyError:
        turned, two_sided = triangles, False
    measures: dict[str, Any] = {
        "open_edges": open_edges,
        "holes": len(set(borders(turned)[1])) if open_edges else 0,
        "crowded_edges": crowded,
        "two_sided": two_sided,
        "disagreeing_edges": int((~agree).sum()),
        "closed": open_edges == 0 and len(triangles) > 0,
    }
    whole = measures["closed"] and two_sided and not crowded
    measures["pinched_nodes"] = len(pinched_nodes(turned)) if whole else 0
    measures["manifold"] = not crowded and not measures["pinched_nodes"]
    measures["oriented"] = two_sided and measures["disagreeing_edges"] == 0
    return measures


def borders(triangles: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Nodes on borders (n,), and the number of the border of each (n,)."""
    nodes, local = np.unique(border(triangles), return_inverse=True)
    return nodes, connected(local.reshape(-1, 2), len(nodes))


def hole_list(points: np.ndarray, triangles: np.ndarray) -> list[dict[str, Any]]:
    """Width and middle [m] of each hole, the widest first; the width is the largest distance between border nodes."""
    nodes, number = borders(triangles)
    rims = [points[nodes[number == k]] for k in range(number.max() + 1)]
    thinned = [rim[:: -(-len(rim) // RIM)] for rim in rims]
    rows = [
        {"width": float(pdist(few).max(initial=0.0)), "middle": rim.mean(axis=0).tolist()}
        for rim, few in zip(rims, thinned, strict=True)
    ]
    return sorted(rows, key=lambda row: -row["width"])


def describe_parts(points: np.ndarray, triangles: np.ndarray, surface: dict[str, Any]) -> dict[str, Any]:
    """Numbers of separate parts, lumens, inverted parts, and handles ("genus"); surface: measures of `describe_edges`.

    An inverted part inside the largest part bounds a lumen. Counted only for closed, oriented surfaces,
    handles only if they are also manifold.
    """
    parts = part_of(triangles)
    pieces = [triangles[parts == k] for k in range(int(parts.max()) + 1)] if len(parts) else []
    measures: dict[str, Any] = {"parts": len(pieces), "lumens": 0, "inside_out_parts": 0, "genus": None}
    measures["lumen_volume"] = 0.0
    if not pieces or not (surface["closed"] and surface["oriented"]):
        return measures
    main = largest(points, triangles, parts)
    for k, piece in enumerate(pieces):
        volume = signed_volume(points, piece)
        if volume < 0 and k != main and encloses(points, pieces[main], piece):
            measures["lumens"] += 1
            measures["lumen_volume"] -= volume
        elif volume < 0:
            measures["inside_out_parts"] += 1
    if surface["manifold"]:
        euler = len(np.unique(triangles)) - len(unique_edges(triangles)) + len(triangles)
        measures["genus"] = len(pieces) - euler // 2
    return measures


def describe_size(points: np.ndarray, triangles: np.ndarray) -> dict[str, Any]:
    """Box, distance from the origin, edges and thickness [m], area [m^2], volume [m^3], and quality of triangles."""
    used = points[np.unique(triangles)]
    size = np.ptp(used, axis=0) if len(used) else np.zeros(3)
    edges = unique_edges(triangles)
    ratio = triangle_radius_ratio(points, triangles)
    area = float(triangle_areas(points, triangles).sum())
    volume = signed_volume(points, triangles) if len(triangles) else 0.0
    return {
        "size": [float(side) for side in size],
        "diagonal": float(np.linalg.norm(size)),
        "distance": float(np.linalg.norm(used.mean(axis=0))) if len(used) else 0.0,
        "area": area,
        "volume": volume,
        "thickness": 2.0 * abs(volume) / area if area > 0 else 0.0,
        "edge": spread(np.linalg.norm(points[edges[:, 0]] - points[edges[:, 1]], axis=1)),
        "triangle_radius_ratio": spread(ratio),
        "worst_triangle": int(ratio.argmin()) if len(ratio) else None,
        "flat_triangles": int((ratio < SLIVER).sum()),
    }


def describe_tetrahedra(points: np.ndarray, tetrahedra: np.ndarray, enclosed: float) -> dict[str, Any]:
    """Numbers and quality of tetrahedra (k, 4) on points (n, 3) [m], and whether they overlap, so that their volumes
    are together more than the volume `enclosed` [m^3] by their boundary; angles in degrees."""
    ratio, volumes = tetrahedron_radius_ratio(points, tetrahedra), tetrahedron_volumes(points, tetrahedra)
    distinct = np.unique(np.sort(tetrahedra, axis=1), axis=0)
    return {
        "nodes": len(points),
        "tetrahedra": len(tetrahedra),
        "duplicate_tetrahedra": len(tetrahedra) - len(distinct),
        "inverted_tetrahedra": int((volumes <= 0).sum()),
        "overlapping": bool(np.abs(volumes).sum() > (1 + OVERLAP) * enclosed),
        "tetrahedron_radius_ratio": spread(ratio),
        "dihedral_angle": spread(dihedral_angles(points, tetrahedra).min(axis=1)),
        "worst_tetrahedron": int(ratio.argmin()),
    }


def spread(values: np.ndarray) -> dict[str, float] | None:
    """Minimum, 1st, 5th and 50th percentile and maximum of values (n,); None without values."""
    if not len(values):
        return None
    return dict(zip(("min", "p1", "p5", "p50", "max"), np.percentile(values, [0, 1, 5, 50, 100]).tolist(), strict=True))


def describe_springs(
    points: np.ndarray,
    triangles: np.ndarray,
    tetrahedra: np.ndarray | None,
    surface: dict[str, Any],
    tissue: tuple[float, float],
) -> dict[str, Any]:
    """Shortest edge [m] of the surface and largest stable time step [s] of springs on it (docs/theory.md, eq. 5.2,
    undamped).

    surface: measures of `describe_surface`; tissue: shear modulus [Pa] and density [kg/m^3]. The step follows from the
    largest frequency of the body, if one can be made with up to MEASURED_BODY nodes ("measured"). Else it is the time
    in which a wave in a Cauchy solid, E = 2.5 mu, crosses the shortest edge ("estimated").
    """
    modulus, density = tissue
    material = Material(modulus, density)
    shortest = surface["edge"]["min"] if surface["edge"] else 0.0
    answer = {"shortest_edge": shortest, "shear_modulus": modulus, "density": density}
    sound = surface["closed"] and surface["manifold"] and surface["oriented"] and not surface["collapsed_triangles"]
    try:
        if len(points) > MEASURED_BODY or not sound or surface["duplicate_triangles"]:
            raise MassSpringError("no body, or one too large for its frequencies in a moment")
        if tetrahedra is not None:
            body = tetrahedral_body(points, triangles, tetrahedra, material)
        else:
            body = surface_body(points, triangles, material)
        return answer | {"dt_limit": step_limit(body).undamped, "how": "measured"}
    except MassSpringError:
        return answer | {"dt_limit": shortest / float(np.sqrt(2.5 * modulus / density)), "how": "estimated"}
