"""Walls: closed sheets of tissue, by triangle springs (Delingette 2008) or plain springs (Lloyd et al. 2007)."""

import numpy as np

from massspring.body.body import Body, Material
from massspring.body.springs import EDGES_OF_TRIANGLE, SpringKind, Springs, lengths, unique_edges
from massspring.body.surface import check_surface, checked_indices, checked_points
from massspring.errors import MassSpringError
from massspring.kernels.arrays.layout import Membrane

MEMBRANE_LAWS = ("delingette", "lloyd")


def triangle_springs(
    points: np.ndarray, triangles: np.ndarray, thickness: float, shear_modulus: float, poisson: float = 0.5
) -> Membrane:
    """Delingette's springs, exactly the St. Venant–Kirchhoff membrane of linear triangles (eq. 4.6, 4.7).

    `points` (n, 3) [m] at rest, `triangles` (t, 3); `thickness` h [m]; `shear_modulus` G [Pa]; plane stress with
    `poisson` [1]. In Delingette (2008) mu stands for 2 G and the energy for twice this one. Raises MassSpringError.
    """
    corners = points[triangles]
    edge = np.roll(corners, -2, axis=1) - np.roll(corners, -1, axis=1)  # of a: from b to c
    area = 0.5 * np.linalg.norm(np.cross(edge[:, 0], edge[:, 1]), axis=1)
    if not (area > 0).all():
        raise MassSpringError(f"triangle {int(np.argmin(area))} of the wall has no area; weld its nodes or remove it")
    turned = np.roll(edge, -1, axis=1), np.roll(edge, -2, axis=1)
    cotangent = -np.einsum("tai,tai->ta", *turned) / (2.0 * area[:, None])
    lame = 2.0 * shear_modulus * poisson / (1.0 - poisson)  # plane stress
    both = (lame + 2.0 * shear_modulus) * thickness / (16.0 * area[:, None])
    shear = shear_modulus * thickness / (16.0 * area[:, None])
    across = np.roll(cotangent, -1, axis=1) * np.roll(cotangent, -2, axis=1)
    return Membrane(
        np.ascontiguousarray(triangles, dtype=np.uint32),
        np.einsum("tai,tai->ta", edge, edge),
        both * cotangent**2 + shear,
        both * across - shear,
    )


def membrane_body(
    points: np.ndarray,
    triangles: np.ndarray,
    thickness: float,
    material: Material,
    law: str = "delingette",
    content: float = 0.0,
) -> Body:
    """A closed wall round its content, which is the volume kept: no inside springs, no bending.

    `points` (n, 3) [m], `triangles` (f, 3) outward; `thickness` [m]; `content` [kg/m³] density of what fills it,
    carried by the wall. `law`: "delingette", incompressible tissue (Poisson ratio ½); "lloyd", k_e = Σ (√3/4) E h with
    E = 3 mu, whose Poisson ratio is ⅓ (eq. 4.8). Raises MassSpringError.
    """
    points = checked_points(points)
    triangles = checked_indices("triangles", triangles, 3, len(points))
    check_surface(points, triangles)
    if law not in MEMBRANE_LAWS:
        raise MassSpringError(f"unknown law '{law}' of a wall; known: {', '.join(MEMBRANE_LAWS)}")
    if not (np.isfinite(thickness) and thickness > 0 and np.isfinite(content) and content >= 0):
        raise MassSpringError(
            f"the wall is {thickness} m thick round a content of {content} kg/m³; "
            "give a positive thickness, and a density that is not negative"
        )
    exact = triangle_springs(points, triangles, thickness, material.shear_modulus)
    body = Body(points, _masses(points, triangles, thickness * material.density), NO_SPRINGS, triangles, membrane=exact)
    mass = body.mass * (1.0 + content * body.volume / body.mass.sum())
    if law == "lloyd":
        springs = lloyd_springs(points, triangles, thickness, 3.0 * material.shear_modulus)
        return Body(points, mass, springs, triangles, law="lloyd")
    return Body(points, mass, NO_SPRINGS, triangles, law=law, membrane=exact)


def lloyd_springs(points: np.ndarray, triangles: np.ndarray, thickness: float, young: float) -> Springs:
    """k_e = Σ_t∋e (√3/4) E h [N/m] on the edges of `triangles` (t, 3) (Lloyd, Székely, Harders 2007; eq. 4.8).

    Exact for equilateral triangles of a material with Poisson ratio ⅓.
    """
    ends = unique_edges(triangles, EDGES_OF_TRIANGLE)
    every = np.sort(triangles[:, EDGES_OF_TRIANGLE].reshape(-1, 2), axis=1)
    _, count = np.unique(every, axis=0, return_counts=True)
    stiffness = np.sqrt(3.0) / 4.0 * young * thickness * count
    kind = np.full(len(ends), SpringKind.STRUCTURAL, dtype=np.uint8)
    return Springs(np.ascontiguousarray(ends, dtype=np.uint32), lengths(points, ends), stiffness, kind)


NO_SPRINGS = Springs(np.empty((0, 2), np.uint32), np.empty(0), np.empty(0), np.empty(0, np.uint8))


def _masses(points: np.ndarray, triangles: np.ndarray, per_area: float) -> np.ndarray:
    """A third of each triangle's `per_area` [kg/m²] at each of its nodes [kg], (n,)."""
    corners = points[triangles]
    area = 0.5 * np.linalg.norm(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1)
    return per_area / 3.0 * np.bincount(triangles.ravel(), weights=np.repeat(area, 3), minlength=len(points))
