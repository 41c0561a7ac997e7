"""How a mesh of a scan deviates from the file: distances in both directions, volume, handles."""

from typing import Any

import numpy as np

from studies.geometry.mesh.organ_mesh import Surface, mean_edge, signed_volume, triangle_areas
from studies.geometry.surface.distance import distance_to_surface
from studies.geometry.surface.node_count import handles_of

MOST = 40_000
"""Most points of a surface that are measured; of more, every k-th is taken."""
NOTABLE = 0.02
"""The user is warned of a distance beyond this share of the diagonal or beyond the mean edge, whichever is smaller, and
of a relative change of the volume beyond this share."""


def fidelity(file: Surface, mesh: Surface) -> dict[str, Any]:
    """Deviations of a mesh from the surface of a file, JSON-able: file_to_mesh, mesh_to_file: mean, p95 and max of the
    distance [m], and where the largest is [m]; volume_file, volume_mesh [m^3]; diagonal: of the box of the file [m];
    edge: mean edge of the mesh [m]; handles: of the mesh."""
    return {
        "file_to_mesh": spread(file, mesh),
        "mesh_to_file": spread(mesh, file),
        "volume_file": signed_volume(*file),
        "volume_mesh": signed_volume(*mesh),
        "diagonal": float(np.linalg.norm(np.ptp(file[0][np.unique(file[1])], axis=0))),
        "handles": handles_of(mesh[0][np.unique(mesh[1])], mesh[1]),
        "edge": mean_edge(*mesh),
    }


def spread(one: Surface, other: Surface) -> dict[str, Any]:
    """Mean, p95 and max [m] of the distance of `one` surface from the `other`, and the point [m] of the largest, at the
    nodes, edge midpoints and centroids of `one`; mean and 95th percentile are weighted by area."""
    places, weights = samples(*one)
    away = distance_to_surface(places, *other)
    order = np.argsort(away)
    share = np.cumsum(weights[order]) / weights.sum()
    farthest = int(order[-1])
    return {
        "mean": float((weights * away).sum() / weights.sum()),
        "p95": float(away[order[min(int(np.searchsorted(share, 0.95)), len(order) - 1)]]),
        "max": float(away[farthest]),
        "where": [float(x) for x in places[farthest]],
    }


def samples(points: np.ndarray, triangles: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Nodes, edge midpoints and centroids (m, 3) [m] of a surface and the area [m^2] that each represents, (m,)."""
    corners, areas = points[triangles], triangle_areas(points, triangles)
    middles = 0.5 * (corners + np.roll(corners, -1, axis=1))
    places = np.concatenate([corners.mean(axis=1), middles.reshape(-1, 3), points[np.unique(triangles)]])
    at_nodes = np.bincount(triangles.ravel(), np.repeat(areas, 3) / 6.0, len(points))[np.unique(triangles)]
    weights = np.concatenate([areas / 4.0, np.repeat(areas / 12.0, 3), at_nodes])
    step = -(-len(places) // MOST)
    return places[::step], weights[::step]


def warnings_of(lost: dict[str, Any], filled: bool = False) -> list[str]:
    """Sentences that warn the user of deviations, as `fidelity` returns them; empty if all are small. filled: whether
    the user asked for more volume than the surface has."""
    sentences = []
    for key, what in (
        ("file_to_mesh", "this part of the file is missing from the mesh"),
        ("mesh_to_file", "the mesh has a part here that the file does not"),
        ("lumen", "the lumen of the file has another place or another thickness of the wall"),
    ):
        if key not in lost:
            continue
        far, place = lost[key]["max"], lost[key]["where"]
        if far > min(NOTABLE * lost["diagonal"], lost["edge"]):
            where = ", ".join(f"{1e3 * x:.4g}" for x in place)
            share = f"{100 * far / lost['diagonal']:.2g} % of the diagonal"
            sentences.append(
                f"the surface is up to {1e3 * far:.3g} mm off ({share}) at ({where}) mm: {what}; use more nodes, or "
                "remove it with --smooth"
            )
    if lost["handles"]:
        sentences.append(
            f"the body has {lost['handles']} handles or tunnels, as a ring has one; organs have none: close narrow "
            "ones with --smooth"
        )
    change = lost["volume_mesh"] / lost["volume_file"] - 1.0
    if abs(change) > NOTABLE and not filled:
        sentences.append(
            f"the volume is {1e6 * lost['volume_mesh']:.4g} mL, that of the file {1e6 * lost['volume_file']:.4g} mL "
            f"({100 * change:+.2g} %)"
        )
    return sentences
