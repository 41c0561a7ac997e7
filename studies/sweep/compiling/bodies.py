"""The smallest bodies of every kind that compiled code is made for; no mesher is needed."""

from functools import cache

import numpy as np

from massspring import Body, Material, Volumes, membrane_body, quadratic_body, tetrahedral_body
from massspring.body.points import PAIRS
from reference_fem.oracles.bodies import block

TISSUE = Material(shear_modulus=1800.0, density=1060.0)
EDGE = 0.04
"""Of the block of 2 × 2 × 2 cells [m]."""
KINDS = ("whole", "several", "quadratic", "nodal", "membrane", "prestressed")
"""What is kept: one volume; some; one per vertex of quadratic elements; one per node; what a wall encloses; one per
node, with springs without length."""


@cache
def tiny_body(kind: str) -> Body:
    """The body of a kind of KINDS. Raises KeyError for another."""
    points, triangles, tetrahedra = tiny_block()
    if kind == "membrane":
        outer, renumbered = np.unique(triangles, return_inverse=True)
        return membrane_body(points[outer], renumbered.reshape(-1, 3), 0.1 * EDGE, TISSUE)
    if kind == "quadratic":
        return quadratic_body(*with_middles(points, tetrahedra), TISSUE)
    law = {"prestressed": "cotangent"}.get(kind, "uniform")
    body = tetrahedral_body(points, triangles, tetrahedra, TISSUE, law)
    if kind == "whole":
        return body
    makers = {"several": lambda: Volumes.regions(body, 3), "nodal": lambda: Volumes.nodal(body)}
    return body.keeping(makers["nodal" if kind == "prestressed" else kind]())


def with_middles(points: np.ndarray, tetrahedra: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Points (n, 3) [m] and cells (k, 10) in VTK's order of the same elements with nodes between corners."""
    ends = np.sort(tetrahedra[:, PAIRS].reshape(-1, 2), axis=1)
    sides, middle = np.unique(ends, axis=0, return_inverse=True)
    cells = np.hstack([tetrahedra, len(points) + middle.reshape(-1, len(PAIRS))])
    return np.vstack([points, points[sides].mean(axis=1)]), cells


def tiny_block() -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Points (27, 3) [m], outward boundary triangles, tetrahedra of positive volume; the inner node moved a little."""
    mesh = block((2, 2, 2), skew=0.1)
    points, tetrahedra = EDGE * mesh.p.T, mesh.t.T.astype(np.int64)
    a, b, c, d = points[tetrahedra].transpose(1, 0, 2)
    negative = np.einsum("ij,ij->i", np.cross(b - a, c - a), d - a) < 0
    tetrahedra[negative] = tetrahedra[negative][:, [0, 2, 1, 3]]
    faces = tetrahedra[:, [[1, 2, 3], [0, 3, 2], [0, 1, 3], [0, 2, 1]]].reshape(-1, 3)
    _, first, count = np.unique(np.sort(faces, axis=1), axis=0, return_index=True, return_counts=True)
    return np.ascontiguousarray(points), faces[first[count == 1]], np.ascontiguousarray(tetrahedra)
