"""A body: particles, springs, its closed surface and the volumes that can be kept."""

from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np

from massspring.axis import closest_virtual_node, virtual_nodes
from massspring.errors import MassSpringError
from massspring.kernels.deformation import tetrahedron_volumes_into
from massspring.kernels.volume import enclosed_volume
from massspring.springs import (
    EDGES_OF_TETRAHEDRON,
    EDGES_OF_TRIANGLE,
    SpringKind,
    Springs,
    bending_pairs,
    lengths,
    matched_scale,
    unique_edges,
    van_gelder_weights,
)
from massspring.surface import check_finite, check_surface
from massspring.volumes import Volumes

AXIS_MASS_SHARE = 0.25
"""A pyramid over the axis has a quarter of its mass at the apex (linear shape functions)."""
SURFACE_WEIGHTS = {SpringKind.STRUCTURAL: 1.0, SpringKind.BENDING: 0.5, SpringKind.INNER: 0.5, SpringKind.AXIAL: 1.0}
"""Relative stiffness of the kinds; their sum is scaled to the shear modulus. The paper names no values."""
STIFFNESS_LAWS = ("van_gelder", "uniform")
SAME_VOLUME = 1e-9
"""Relative: both are sums of the same determinants, up to round-off of some million additions."""
NO_TETRAHEDRA = np.empty((0, 4), dtype=np.uint32)


@dataclass(frozen=True, eq=False)
class Material:
    """Isotropic tissue."""

    shear_modulus: float
    """mu [Pa]."""
    density: float
    """rho [kg/m³]."""

    def __post_init__(self) -> None:
        for name, unit in (("shear_modulus", "Pa"), ("density", "kg/m³")):
            value = getattr(self, name)
            if not (np.isfinite(value) and value > 0):
                raise MassSpringError(f"{name} is {value} {unit}; it must be a positive finite number")


@dataclass(frozen=True, eq=False)
class Body:
    """n nodes at rest; the solver never changes it."""

    rest: np.ndarray
    """Rest positions [m], (n, 3)."""
    mass: np.ndarray
    """[kg], (n,)."""
    springs: Springs
    triangles: np.ndarray
    """Closed surface, outward, (f, 3) uint32; of several sheets for a hollow body (inner sheets face the lumen)."""
    tetrahedra: np.ndarray = field(default_factory=lambda: NO_TETRAHEDRA)
    """(k, 4) uint32, positive; empty for a surface body."""
    law: str = "given"
    """Stiffness law, recorded with every result: it alone moves a force by 12–16 %."""
    volumes: Volumes | None = None
    """What methods keep; None: the whole."""

    def __post_init__(self) -> None:
        check_finite("rest positions", self.rest)
        check_finite("masses", self.mass)
        check_surface(self.rest, self.triangles)
        if len(self.mass) != len(self.rest):
            raise MassSpringError(f"{len(self.mass)} masses for {len(self.rest)} nodes; give one mass per node")
        if not (self.mass > 0).all():
            node = int(np.argmin(self.mass))
            raise MassSpringError(f"node {node} has mass {self.mass[node]:g} kg; every node needs a positive mass")
        self._check_springs()
        if len(self.tetrahedra) and not (self.tetrahedron_volumes > 0).all():
            worst = int(np.argmin(self.tetrahedron_volumes))
            raise MassSpringError(
                f"tetrahedron {worst} has volume {self.tetrahedron_volumes[worst]:.3g} m³; "
                "swap two of its nodes or remove it"
            )
        self._check_volumes()

    def _check_volumes(self) -> None:
        filled = float(self.tetrahedron_volumes.sum())
        if len(self.tetrahedra) and abs(filled - self.volume) > SAME_VOLUME * filled:
            raise MassSpringError(
                f"the surface encloses {self.volume:.6g} m³ but the tetrahedra fill {filled:.6g} m³; "
                "give all sheets of their boundary, each turned outward of the tissue"
            )
        if int(self.kept.triangles.max()) >= len(self.rest):
            raise MassSpringError(
                f"a kept volume names a node beyond the {len(self.rest)} there are; build it on this body"
            )
        if not (self.rest_volumes > 0).all():
            worst = int(np.argmin(self.rest_volumes))
            name, volume = self.kept.names[worst], self.rest_volumes[worst]
            raise MassSpringError(f"volume '{name}' is {volume:.3g} m³ at rest; turn its triangles round")

    def _check_springs(self) -> None:
        springs = self.springs
        if springs.count and int(springs.ends.max()) >= len(self.rest):
            raise MassSpringError(
                f"a spring ends at node {int(springs.ends.max())}, but there are {len(self.rest)} nodes"
            )
        check_finite("spring stiffnesses", springs.stiffness)
        if not (springs.rest_length > 0).all():
            worst = int(np.argmin(springs.rest_length))
            raise MassSpringError(
                f"spring {worst} has rest length {springs.rest_length[worst]:g} m; weld its two nodes"
            )

    @property
    def node_count(self) -> int:
        """Number of nodes, virtual ones included."""
        return len(self.rest)

    @property
    def surface_nodes(self) -> np.ndarray:
        """Nodes of the closed surface, ascending, (c,) uint32."""
        return np.unique(self.triangles).astype(np.uint32)

    @property
    def volume(self) -> float:
        """Rest volume V0 [m³]."""
        return float(enclosed_volume(self.rest, self.triangles))

    @property
    def kept(self) -> Volumes:
        """The volumes that methods keep: `volumes`, or the whole."""
        return Volumes.whole(self) if self.volumes is None else self.volumes

    @cached_property
    def rest_volumes(self) -> np.ndarray:
        """V0_r [m³] of the kept volumes, (m,)."""
        return self.kept.measure(self.rest)

    @property
    def tetrahedron_volumes(self) -> np.ndarray:
        """Rest volumes [m³], (k,)."""
        volumes = np.empty(len(self.tetrahedra))
        tetrahedron_volumes_into(self.rest, self.tetrahedra, volumes)
        return volumes

    @property
    def size(self) -> float:
        """Diagonal of the bounding box at rest [m]."""
        return float(np.linalg.norm(np.ptp(self.rest, axis=0)))

    def keeping(self, volumes: Volumes) -> "Body":
        """The same body with other volumes to keep. Raises MassSpringError for one that is not positive at rest."""
        return replace(self, volumes=volumes)

    def stiffened(self, factor: float) -> "Body":
        """The same body with every spring `factor` times as stiff."""
        return replace(self, springs=replace(self.springs, stiffness=self.springs.stiffness * factor))


def tetrahedral_body(
    points: np.ndarray, triangles: np.ndarray, tetrahedra: np.ndarray, material: Material, law: str = "van_gelder"
) -> Body:
    """Springs on the edges of a tetrahedral mesh, matched to the shear modulus.

    `points` (n, 3) [m]; `triangles` (f, 3), its boundary, outward; `tetrahedra` (k, 4), positive; `law` one of
    `STIFFNESS_LAWS`: "van_gelder" k ∝ Σ V_t/L² (Van Gelder 1998), "uniform" one k for all. Raises MassSpringError.
    """
    tetrahedra = np.ascontiguousarray(tetrahedra, dtype=np.uint32)
    triangles = np.ascontiguousarray(triangles, dtype=np.uint32)
    points = np.ascontiguousarray(points, dtype=np.float64)
    if law not in STIFFNESS_LAWS:
        raise MassSpringError(f"unknown stiffness law '{law}'; known: {', '.join(STIFFNESS_LAWS)}")
    volumes = np.empty(len(tetrahedra))
    tetrahedron_volumes_into(points, tetrahedra, volumes)
    edges = unique_edges(tetrahedra, EDGES_OF_TETRAHEDRON)
    length = lengths(points, edges)
    weight = van_gelder_weights(tetrahedra, volumes, edges, length) if law == "van_gelder" else np.ones(len(edges))
    stiffness = weight * matched_scale(material.shear_modulus, float(volumes.sum()), weight, length)
    mass = (
        np.bincount(tetrahedra.ravel(), weights=np.repeat(volumes, 4), minlength=len(points)) * material.density / 4.0
    )
    kind = np.full(len(edges), SpringKind.SOLID, dtype=np.uint8)
    springs = Springs(np.ascontiguousarray(edges, dtype=np.uint32), length, stiffness, kind)
    return Body(points, mass, springs, triangles, tetrahedra, law)


def surface_body(points: np.ndarray, triangles: np.ndarray, material: Material, axis: str = "straight") -> Body:
    """The paper's body (JHC05, section 3): structural, bending and inner springs, virtual nodes on the dominant axis.

    `points` (n, 3) [m] are the surface nodes, `triangles` (f, 3) outward; `axis` one of `AXES`. The virtual nodes
    follow the surface nodes; consecutive ones are joined by axial springs, without which the axis could come apart.
    Raises MassSpringError.
    """
    triangles = np.ascontiguousarray(triangles, dtype=np.uint32)
    points = np.ascontiguousarray(points, dtype=np.float64)
    check_surface(points, triangles)
    structural = unique_edges(triangles, EDGES_OF_TRIANGLE)
    virtual = virtual_nodes(points, triangles, float(lengths(points, structural).mean()), axis)
    nearest = closest_virtual_node(points, virtual)
    used, nearest = np.unique(nearest, return_inverse=True)
    rest = np.vstack([points, virtual[used]])
    first = len(points)
    groups = {
        SpringKind.STRUCTURAL: structural,
        SpringKind.BENDING: bending_pairs(triangles),
        SpringKind.INNER: np.column_stack([np.arange(first), first + nearest]),
        SpringKind.AXIAL: np.column_stack([np.arange(first, len(rest) - 1), np.arange(first + 1, len(rest))]),
    }
    ends = np.vstack(list(groups.values())).astype(np.uint32)
    kind = np.repeat([int(k) for k in groups], [len(g) for g in groups.values()]).astype(np.uint8)
    length = lengths(rest, ends)
    weight = np.array([SURFACE_WEIGHTS[SpringKind(k)] for k in range(SpringKind.SOLID)])[kind]
    volume = float(enclosed_volume(points, triangles))
    stiffness = weight * matched_scale(material.shear_modulus, volume, weight, length)
    mass = _surface_mass(points, triangles, nearest, len(used)) * material.density * volume
    return Body(rest, mass, Springs(ends, length, stiffness, kind), triangles, law="per_kind")


def _surface_mass(points: np.ndarray, triangles: np.ndarray, nearest: np.ndarray, axis_nodes: int) -> np.ndarray:
    """Shares of the mass, (n + a,), summing to 1: by area on the surface, by the area they carry on the axis."""
    corners = points[triangles]
    area = 0.5 * np.linalg.norm(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1)
    share = np.bincount(triangles.ravel(), weights=np.repeat(area, 3), minlength=len(points)) / (3.0 * area.sum())
    axis = np.bincount(nearest, weights=share, minlength=axis_nodes)
    return np.concatenate([(1.0 - AXIS_MASS_SHARE) * share, AXIS_MASS_SHARE * axis])
