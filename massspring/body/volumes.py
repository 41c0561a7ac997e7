"""The volumes that a body keeps: the whole, wall and lumen, m regions, or one per node.

Each is a signed sum of oriented triangles, V_r = Σ_f s_rf (1/6) x_i · (x_j × x_k) (docs/theory.md, eq. 8.1), so one
sweep over triangles computes any kind. A region is bounded by its outer faces. The volume of a node is a quarter of the
volume of all tetrahedra around it, so a quarter of the volume that their outer faces enclose.
"""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Protocol

import numpy as np
from scipy.sparse import coo_array, csr_array, vstack
from scipy.sparse.linalg import lsqr

from massspring.body.partition import FACES_OF_TETRAHEDRON, node_patches, partition, tetrahedron_faces
from massspring.body.surface import check_surface
from massspring.errors import MassSpringError
from massspring.kernels.forces.volume import cones_into, tetrahedron_volumes_into

DEPENDENT = 1e-8
"""Relative residual below which a volume is a sum of others; independent ones of a mesh leave more than 1e-4."""
PATCH = 8
"""Most nodes of a patch. The inside of a larger patch would be too soft for springs without length, whose bulk modulus
there is −mu/3."""


class Solid(Protocol):
    """What volumes are made of: the arrays of a `Body`, or of any other mesh that has them."""

    @property
    def rest(self) -> np.ndarray: ...
    @property
    def triangles(self) -> np.ndarray: ...
    @property
    def tetrahedra(self) -> np.ndarray: ...
    @property
    def share(self) -> np.ndarray | None: ...


@dataclass(frozen=True, eq=False)
class Volumes:
    """m volumes over f triangles; independent of each other."""

    names: tuple[str, ...]
    """m different names."""
    triangles: np.ndarray
    """Oriented, (f, 3) uint32."""
    share: csr_array
    """s_rf, the part of triangle f in volume r, (m, f)."""

    def __post_init__(self) -> None:
        if len(set(self.names)) != len(self.names) or len(self.names) != self.count:
            raise MassSpringError(f"{self.count} volumes are named {self.names}; give each its own name")

    @property
    def count(self) -> int:
        """m."""
        return self.share.shape[0]  # pyright: ignore[reportOptionalSubscript]

    @property
    def highest_node(self) -> int:
        """Largest node number in use."""
        return int(self.triangles.max())

    def renumbered(self, number: np.ndarray) -> "Volumes":
        """The same volumes with node i renumbered to `number[i]`, (n,) uint32."""
        return replace(self, triangles=number[self.triangles])

    def jacobian(self, x: np.ndarray) -> csr_array:
        """J_r = ∂V_r/∂x [m²] at positions `x` (n, 3) [m], (m, 3n) (eq. 8.2)."""
        a, b, c = (x[corner] for corner in self.triangles.T)
        sixth = np.cross(b - a, c - a) / 6.0
        rows = np.repeat(np.arange(len(sixth)), 9)
        columns = (3 * self.triangles.astype(np.int64)[:, :, None] + np.arange(3)).ravel()
        values = np.broadcast_to(sixth[:, None, :], (len(sixth), 3, 3)).ravel()
        corner = coo_array((values, (rows, columns)), shape=(len(sixth), x.size)).tocsr()
        return csr_array(self.share @ corner)

    def measure(self, x: np.ndarray) -> np.ndarray:
        """V_r [m³] at positions `x` (n, 3) [m], (m,) (eq. 8.1). Positions are taken relative to their mean."""
        six = np.empty(len(self.triangles))
        cones_into(np.ascontiguousarray(x, dtype=np.float64), self.triangles, x.mean(axis=0), six)
        return self.share @ six / 6.0

    def parts_of(self, triangles: np.ndarray) -> np.ndarray:
        """p with Σ_r p_r V_r = the volume inside the closed surface `triangles` (f, 3), (m,).

        Raises MassSpringError where the volumes do not add up to it.
        """
        united, place = _united(self.triangles, triangles)
        rows = _moved(self.share, place[0], len(united))
        right = np.zeros(len(united))
        right[place[1][0]] = place[1][1]
        start = np.ones(self.count)  # exact for regions and nodes
        factors = lsqr(rows.T, right, atol=1e-15, btol=1e-15, iter_lim=10 * self.count + 100, x0=start)[0]
        if np.abs(rows.T @ factors - right).max() > DEPENDENT:
            raise MassSpringError("the kept volumes do not add up to the whole body; keep one volume per node")
        return factors

    def joined(self, other: "Volumes") -> "Volumes":
        """Both kinds together. Raises MassSpringError when a volume of `other` is a sum of the rest."""
        triangles, place = _united(self.triangles, other.triangles)
        mine = _moved(self.share, place[0], len(triangles))
        rows = _moved(other.share, place[1], len(triangles))
        for r in range(other.count):
            row = rows[[r]]
            _refuse_dependent(mine, self.names + other.names[:r], row, other.names[r])
            mine = csr_array(vstack([mine, row]))
        return Volumes(self.names + other.names, triangles, mine)

    @staticmethod
    def whole(body: Solid) -> "Volumes":
        """The tissue inside the body's surface; where copies of cells share it, of all copies together."""
        if body.share is not None:
            return Volumes.of_cells(("whole",), body.tetrahedra, csr_array(body.share[None]))
        return Volumes(("whole",), body.triangles, csr_array(np.ones((1, len(body.triangles)))))

    @staticmethod
    def of_cells(names: tuple[str, ...], cells: np.ndarray, weight: csr_array) -> "Volumes":
        """Sums over tetrahedra `cells` (k, 4), of which two or more may have the same face: V_r = Σ_t w_rt V_t with
        `weight` (m, k)."""
        outer = cells[:, FACES_OF_TETRAHEDRON].reshape(-1, 3)
        faces, place = _united(outer, outer[:0])
        column, sense = place[0]
        row = np.repeat(np.arange(len(cells)), len(FACES_OF_TETRAHEDRON))
        bounded = csr_array(weight @ coo_array((sense, (row, column)), shape=(len(cells), len(faces))).tocsr())
        bounded.eliminate_zeros()
        used = np.unique(bounded.indices)
        return Volumes(names, faces[used], csr_array(bounded[:, used]))

    @staticmethod
    def closed_surfaces(body: Solid, surfaces: Mapping[str, np.ndarray]) -> "Volumes":
        """One volume per closed surface: name -> triangles (f, 3) that enclose it with a positive volume.

        {"wall": all boundary triangles, "lumen": the inner ones turned round} for a hollow organ. Raises
        MassSpringError for an open or inside-out surface, or one whose volume follows from the others.
        """
        kept: Volumes | None = None
        for name, given in surfaces.items():
            triangles = np.ascontiguousarray(given, dtype=np.uint32)
            try:
                check_surface(body.rest, triangles)
            except MassSpringError as error:
                raise MassSpringError(f"volume '{name}': {error}") from error
            one = Volumes((name,), triangles, csr_array(np.ones((1, len(triangles)))))
            kept = one if kept is None else kept.joined(one)
        if kept is None:
            raise MassSpringError("no surface is given; name at least one")
        return kept

    @staticmethod
    def regions(body: Solid, count: int) -> "Volumes":
        """`count` connected regions of tetrahedra of about equal volume. Raises MassSpringError for too many.

        More volumes than nodes would leave less than two of three motions of a node free: the body locks.
        """
        _need_tetrahedra(body, "regions")
        if count > len(body.rest):
            raise MassSpringError(
                f"{count} regions asked of a mesh of {len(body.rest)} nodes; more volumes than nodes lock it, "
                f"give up to {len(body.rest)} or refine the mesh"
            )
        sizes = tetrahedron_volumes(body.rest, body.tetrahedra)
        region = partition(body.rest, body.tetrahedra.astype(np.int64), sizes, count)
        triangles, first, second = tetrahedron_faces(body.tetrahedra)
        a, b = region[first // 4], np.where(second >= 0, region[second // 4], -1)
        between = np.flatnonzero(a != b)
        inner = between[b[between] >= 0]
        rows, columns = np.r_[a[between], b[inner]], np.r_[between, inner]
        share = coo_array((np.r_[np.ones(len(between)), -np.ones(len(inner))], (rows, columns)), shape=(count, len(a)))
        return Volumes(tuple(f"region {r}" for r in range(count)), triangles[between], share.tocsr()[:, between])

    @staticmethod
    def patches(body: Solid, size: int = PATCH) -> "Volumes":
        """The volumes of connected patches of about `size` nodes: sums of nodal ones. Raises MassSpringError.

        Fewer volumes lock less: three unknowns a node and one volume for eight of them leave 24 for each, near the
        count of stable mixed elements. How many are best depends on the organ.
        """
        nodal = Volumes.nodal(body)
        patch = node_patches(body.rest, body.tetrahedra, size)
        count = int(patch.max()) + 1
        united = coo_array((np.ones(len(patch)), (patch, np.arange(len(patch)))), shape=(count, len(patch))).tocsr()
        share = csr_array(united @ nodal.share)
        share.data[np.abs(share.data) < DEPENDENT] = 0.0
        share.eliminate_zeros()
        used = np.unique(share.indices)
        return Volumes(tuple(f"patch {r}" for r in range(count)), nodal.triangles[used], share[:, used])

    @staticmethod
    def nodal(body: Solid) -> "Volumes":
        """One volume per node: a quarter of the volume of every tetrahedron around it."""
        _need_tetrahedra(body, "nodal volumes")
        cells = body.tetrahedra.astype(np.int64)
        if body.share is not None:
            of, quarter = np.repeat(np.arange(len(cells)), 4), np.repeat(body.share / 4.0, 4)
            weight = coo_array((quarter, (cells.ravel(), of)), shape=(len(body.rest), len(cells))).tocsr()
            return Volumes.of_cells(tuple(f"node {i}" for i in range(len(body.rest))), cells, weight)
        triangles, first, second = tetrahedron_faces(cells)
        face, inner, outer = np.arange(len(triangles)), np.flatnonzero(second >= 0), np.flatnonzero(second < 0)
        around = triangles[outer].astype(np.int64)
        rows = np.r_[cells.ravel()[first], cells.ravel()[second[inner]], around.ravel()]
        columns = np.r_[face, inner, np.repeat(outer, 3)]
        values = np.r_[np.full(len(face), 0.25), np.full(len(inner), -0.25), np.full(around.size, 0.25)]
        share = coo_array((values, (rows, columns)), shape=(len(body.rest), len(triangles))).tocsr()
        return Volumes(tuple(f"node {i}" for i in range(len(body.rest))), triangles, share)


def tetrahedron_volumes(points: np.ndarray, tetrahedra: np.ndarray) -> np.ndarray:
    """Volumes [m³] of `tetrahedra` (k, 4) uint32 with nodes at `points` (n, 3) [m], (k,)."""
    volumes = np.empty(len(tetrahedra))
    tetrahedron_volumes_into(points, tetrahedra, volumes)
    return volumes


def _need_tetrahedra(body: Solid, what: str) -> None:
    if not len(body.tetrahedra):
        raise MassSpringError(f"{what} are made of tetrahedra, the body has none; fill its mesh or keep the whole")


def _united(mine: np.ndarray, others: np.ndarray) -> tuple[np.ndarray, list[tuple[np.ndarray, np.ndarray]]]:
    """The union of both lists of triangles, where orientation does not count, and for each list (index in the union, ±1
    for the orientation)."""
    both = np.vstack([mine, others]).astype(np.int64)
    _, first, inverse = np.unique(np.sort(both, axis=1), axis=0, return_index=True, return_inverse=True)
    inverse = inverse.reshape(-1)
    # Even permutations keep the sense of a triangle.
    sense = np.sign(_parity(both) * _parity(both[first])[inverse])
    united = np.ascontiguousarray(both[first], dtype=np.uint32)
    cut = len(mine)
    return united, [(inverse[:cut], sense[:cut]), (inverse[cut:], sense[cut:])]


def _parity(triangles: np.ndarray) -> np.ndarray:
    """+1 where the three numbers ascend cyclically, −1 where they descend."""
    a, b, c = triangles.T
    return np.sign((b - a) * (c - b) * (c - a))


def _moved(share: csr_array, place: tuple[np.ndarray, np.ndarray], size: int) -> csr_array:
    index, sense = place
    old = share.tocoo()
    return coo_array((old.data * sense[old.col], (old.row, index[old.col])), shape=(share.shape[0], size)).tocsr()  # pyright: ignore[reportOptionalSubscript]


def _refuse_dependent(rows: csr_array, names: tuple[str, ...], row: csr_array, name: str) -> None:
    """Volumes are independent functions of the positions exactly when their rows of shares are."""
    right = row.toarray().ravel()
    factors = lsqr(rows.T, right, atol=1e-13, btol=1e-13, iter_lim=10 * rows.shape[0] + 100)[0]  # pyright: ignore[reportOptionalSubscript]
    if np.linalg.norm(rows.T @ factors - right) < DEPENDENT * np.linalg.norm(right):
        used = [names[r] for r in np.flatnonzero(np.abs(factors) > 0.5 * np.abs(factors).max())]
        parts = ", ".join(used[:4]) + (f" and {len(used) - 4} more" if len(used) > 4 else "")
        raise MassSpringError(f"volume '{name}' is redundant: it follows from {parts}; leave one of them out")
