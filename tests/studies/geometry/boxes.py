"""Boxes: surfaces whose distance, volume and faults are known by hand."""

import numpy as np

CORNERS = np.array([[x, y, z] for x in (0, 1) for y in (0, 1) for z in (0, 1)], float)
QUADS = np.array([[0, 1, 3, 2], [4, 6, 7, 5], [0, 4, 5, 1], [2, 3, 7, 6], [0, 2, 6, 4], [1, 5, 7, 3]])
FACES = QUADS[:, [0, 1, 2, 0, 2, 3]].reshape(-1, 3)


def box(low=(0, 0, 0), high=(1, 1, 1)):
    """Eight points and twelve outward triangles."""
    return np.asarray(low) + CORNERS * (np.asarray(high, float) - low), FACES.copy()


def together(*surfaces):
    """Several surfaces in one."""
    firsts = np.cumsum([0, *(len(points) for points, _ in surfaces)])
    points = np.vstack([points for points, _ in surfaces])
    return points, np.vstack([faces + k for (_, faces), k in zip(surfaces, firsts, strict=False)])


def split(points, faces, times=1):
    """Every triangle in four, `times` times; shared points stay shared."""
    for _ in range(times):
        edges = np.sort(faces[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2), axis=1)
        unique, which = np.unique(edges, axis=0, return_inverse=True)
        a, b, c = faces.T
        ab, bc, ca = (which.reshape(-1, 3) + len(points)).T
        points = np.vstack([points, points[unique].mean(axis=1)])
        faces = np.vstack([np.column_stack(rows) for rows in ((a, ab, ca), (ab, b, bc), (ca, bc, c), (ab, bc, ca))])
    return points, faces


def box_distance(queries, low=(0, 0, 0), high=(1, 1, 1)):
    """Signed distance to a box, (q,): the closed form."""
    low, high = np.asarray(low, float), np.asarray(high, float)
    beyond = np.abs(queries - (low + high) / 2) - (high - low) / 2
    outside = np.linalg.norm(np.maximum(beyond, 0), axis=1)
    return np.where((beyond <= 0).all(axis=1), beyond.max(axis=1), outside)
