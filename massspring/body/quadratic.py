"""Bodies of quadratic tetrahedra: springs without length in every element, a volume per vertex or element.

½ mu Σ_q w_q |F_q|² = ½ mu xᵀ K x with one constant matrix K_ab = Σ_q w_q ∇N_a·∇N_b, so that its forces are those of
springs k_ab = −mu K_ab without length (docs/theory.md, eq. 4.9). With the volumes of vertices it is the mixed element
of Taylor and Hood (1973) for an incompressible neo-Hookean solid. The pressure of an element with its own volume is
constant.
"""

from dataclasses import replace
from typing import Literal

import numpy as np
from scipy.sparse import coo_array, triu

from massspring.body.body import Body, Material
from massspring.body.points import PAIRS, PointVolumes, gradients
from massspring.body.springs import SpringKind, Springs
from massspring.body.surface import checked_indices, checked_points
from massspring.body.volumes import Volumes, tetrahedron_volumes
from massspring.errors import MassSpringError

Inertia = Literal["lumped", "stiffness"]
Contact = Literal["facets", "nodes"]

CORNER_MASS = 0.05
"""Of an element's mass at each corner, the rest at the mid-sides. Sums of rows would be negative at corners; 1/36 is
proportional to the consistent diagonal; .05 has the longest stable step (ω² 2812 against 3513 on a liver)."""
LOCAL_BULK = 1.0 / 3.0
"""Bulk modulus over mu of the pressure at the points: ½ mu |F|² lacks it between the volumes against mu/2 |F̄|²."""
FACETS = np.array([[0, 2, 1, 6, 5, 4], [0, 1, 3, 4, 8, 7], [1, 2, 3, 5, 9, 8], [0, 3, 2, 7, 9, 6]])
"""Sides of an element seen from outside: corners, then the nodes between first and second, second and third, third and
first."""
PARTS_OF_FACET = np.array([[0, 3, 5], [3, 1, 4], [5, 4, 2], [3, 4, 5]])
CORNER_PARTS = np.array([[0, 4, 6, 7], [4, 1, 5, 8], [6, 5, 2, 9], [7, 8, 9, 3]])
MIDDLE_PARTS = np.array(
    [
        [[4, 9, 6, 7], [4, 9, 7, 8], [4, 9, 8, 5], [4, 9, 5, 6]],
        [[5, 7, 4, 8], [5, 7, 8, 9], [5, 7, 9, 6], [5, 7, 6, 4]],
        [[6, 8, 7, 4], [6, 8, 4, 5], [6, 8, 5, 9], [6, 8, 9, 7]],
    ]
)
"""The octahedron in the middle cut along each of its three diagonals."""


def quadratic_body(
    points: np.ndarray,
    cells: np.ndarray,
    material: Material,
    lumen: np.ndarray | None = None,
    inertia: Inertia = "lumped",
    contact: Contact = "facets",
    own_volumes: np.ndarray | None = None,
) -> Body:
    """The body of a mesh of quadratic tetrahedra, straight or curved.

    `points` (n, 3) [m]; `cells` (k, 10) in VTK's order, positive; `lumen` (f, 6) facets that enclose a lumen with a
    positive volume, as in FACETS, kept beside the tissue. `inertia`: what resists motion, the lumped mass, or
    "stiffness": the total mass shared by the diagonal of K, for scenes in which inertia does not matter (longer steps).
    `contact`: where round obstacles touch it, at points inside its facets or at its nodes, as planes do; cheaper.
    `own_volumes` (k,) bool: the elements that keep their own volume, as where the pressure jumps; the rest keep one per
    vertex. Its surface and its tetrahedra are the four flat parts of each facet and the eight of each element. Raises
    MassSpringError for an element that folds at one of its points or whose parts do, and for other `own_volumes`.
    """
    points = checked_points(points)
    cells = checked_indices("cells", cells, 10, len(points))
    own = np.zeros(len(cells), dtype=bool) if own_volumes is None else np.asarray(own_volumes)
    if own.shape != (len(cells),) or own.dtype != bool:
        raise MassSpringError(
            f"own_volumes is an array of {own.dtype} with shape {own.shape}; give True or False for each of the "
            f"{len(cells)} elements"
        )
    slopes, weight = gradients(points, cells)
    _check_folds(points, cells, weight)
    springs = _springs(cells, weight, slopes, material.shear_modulus, len(points))
    mass = material.density * _lumped(cells, weight.sum(axis=1), len(points))
    parts = flat_parts(points, cells)
    outside = boundary_facets(cells)
    volumes = PointVolumes(cells, slopes, weight, _numbered_corners(cells, own))
    body = Body(
        points,
        mass,
        springs,
        parts_of_facets(outside),
        parts,
        "quadratic",
        volumes,
        rest_pressure=material.shear_modulus,
        local_bulk=LOCAL_BULK * material.shear_modulus,
        contact_facets=_touching(contact, outside),
        inertia=_inertia(inertia, mass, springs),
    )
    return body if lumen is None else _with_lumen(body, volumes, lumen)


def _numbered_corners(cells: np.ndarray, own: np.ndarray) -> np.ndarray:
    """The volume of each corner of the cells, (k, 4): those of the corners of cells that are not `own` (k,), then those
    of the cells that are."""
    number = np.empty((len(cells), 4), dtype=np.int64)
    number[~own] = np.unique(cells[~own, :4], return_inverse=True)[1].reshape(-1, 4)
    number[own] = number[~own].max(initial=-1) + 1 + np.arange(own.sum())[:, None]
    return number


def _with_lumen(body: Body, volumes: PointVolumes, lumen: np.ndarray) -> Body:
    """The body that keeps also the volume inside the facets `lumen` (f, 6)."""
    inside = Volumes.closed_surfaces(body, {"lumen": parts_of_facets(lumen)})
    return body.keeping(replace(volumes, closed=inside))


def _springs(cells: np.ndarray, weight: np.ndarray, slopes: np.ndarray, shear_modulus: float, nodes: int) -> Springs:
    """The springs of zero length that are -mu K, K = sum of w grad N_a . grad N_b over the points."""
    ends, product = _pairs(cells, np.einsum("kq,kqai,kqbi->kab", weight, slopes, slopes), nodes)
    kinds = np.full(len(ends), SpringKind.SOLID, dtype=np.uint8)
    return Springs(ends, np.zeros(len(ends)), -shear_modulus * product, kinds)


def boundary_facets(cells: np.ndarray) -> np.ndarray:
    """Facets of one element only, outward, (f, 6) uint32."""
    facets = cells[:, FACETS].reshape(-1, 6)
    _, first, count = np.unique(np.sort(facets[:, :3], axis=1), axis=0, return_index=True, return_counts=True)
    return np.ascontiguousarray(facets[np.sort(first[count == 1])], dtype=np.uint32)


def parts_of_facets(facets: np.ndarray) -> np.ndarray:
    """The four flat triangles of each facet (f, 6), (4 f, 3) uint32."""
    return np.ascontiguousarray(np.asarray(facets)[:, PARTS_OF_FACET].reshape(-1, 3), dtype=np.uint32)


def flat_parts(points: np.ndarray, cells: np.ndarray) -> np.ndarray:
    """The eight tetrahedra of each element, cut along the diagonal that leaves the smallest of them largest,
    (8 k, 4) uint32. Raises MassSpringError where one is flat or inside out."""
    options = np.stack([cells[:, parts] for parts in MIDDLE_PARTS])
    volumes = tetrahedron_volumes(points, np.ascontiguousarray(options.reshape(-1, 4), dtype=np.uint32))
    best = volumes.reshape(3, len(cells), 4).min(axis=2).argmax(axis=0)
    middle = options[best, np.arange(len(cells))]
    return np.ascontiguousarray(
        np.concatenate([cells[:, CORNER_PARTS], middle], axis=1).reshape(-1, 4), dtype=np.uint32
    )


def _check_folds(points: np.ndarray, cells: np.ndarray, weight: np.ndarray) -> None:
    worst = int(weight.min(axis=1).argmin())
    if not weight[worst].min() > 0.0:
        place = ", ".join(f"{1e3 * c:.1f}" for c in points[cells[worst, :4]].mean(axis=0))
        raise MassSpringError(
            f"{int((weight <= 0.0).any(axis=1).sum())} quadratic elements fold, the worst one at ({place}) mm; "
            "use more nodes, or straight sides there"
        )


def _pairs(cells: np.ndarray, local: np.ndarray, nodes: int) -> tuple[np.ndarray, np.ndarray]:
    """Pairs of nodes that share an element, (s, 2) uint32, and the sums of `local` (k, 10, 10) over the elements."""
    rows, columns = np.repeat(cells, 10, axis=1).ravel(), np.tile(cells, (1, 10)).ravel()
    whole = coo_array((local.ravel(), (rows.astype(np.int64), columns.astype(np.int64))), shape=(nodes, nodes))
    upper = triu(whole.tocsr(), 1).tocoo()
    order = np.lexsort((upper.col, upper.row))
    ends = np.column_stack([upper.row, upper.col])[order]
    return np.ascontiguousarray(ends, dtype=np.uint32), upper.data[order]


def _lumped(cells: np.ndarray, volume: np.ndarray, nodes: int) -> np.ndarray:
    """What each node has of the volumes (k,) of the elements [m³], (n,)."""
    share = np.r_[np.full(4, CORNER_MASS), np.full(len(PAIRS), (1.0 - 4.0 * CORNER_MASS) / len(PAIRS))]
    return np.bincount(cells.ravel(), weights=(volume[:, None] * share).ravel(), minlength=nodes)


def _touching(kind: Contact, facets: np.ndarray) -> np.ndarray:
    if kind not in ("facets", "nodes"):
        raise MassSpringError(f"unknown contact '{kind}'; choose facets or nodes")
    return facets if kind == "facets" else facets[:0]


def _inertia(kind: Inertia, mass: np.ndarray, springs: Springs) -> np.ndarray | None:
    if kind == "lumped":
        return None
    if kind != "stiffness":
        raise MassSpringError(f"unknown inertia '{kind}'; choose lumped or stiffness")
    diagonal = np.zeros(len(mass))
    for end in springs.ends.T:
        diagonal += np.bincount(end, weights=springs.stiffness, minlength=len(mass))
    return mass.sum() * diagonal / diagonal.sum()
