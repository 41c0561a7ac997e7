"""One stored solution of the finite-element reference: a load path on one mesh."""

from dataclasses import dataclass
from functools import cached_property
from itertools import product
from typing import NamedTuple
from weakref import WeakValueDictionary

import numpy as np
from scipy.spatial import KDTree
from skfem import ElementTetP2, MeshTet2

from reference_fem import Evaluator, facet_nodes, surface_triangles
from reference_fem.elements.shapes import basis_table
from studies.scene.cut import nearest_cut, normals_at, sides_of
from studies.scene.scene import Scene
from studies.store.record import Record


class _Remembering(Evaluator):
    """An Evaluator that caches the points it has located, since all runs on a mesh and several metrics use the same
    points. It tries only elements that can be nearer to a point than the nearest so far.

    The Evaluator of reference_fem tries all elements, and accepts an inverse map that did not converge, which happens
    for one point in about a thousand.
    """

    def __init__(self, mesh: MeshTet2, among: np.ndarray | None = None) -> None:
        """among: the elements that are searched, (ne,) bool."""
        super().__init__(mesh)
        if among is not None:
            self.table, self.corners = self.table[among], self.corners[among]
            self.tree = KDTree(self.corners.mean(axis=1))
        self.size = float(np.linalg.norm(np.ptp(self.x, axis=0)))
        control = self.x[self.table]  # an element lies within the hull of its Bézier points
        control[:, 4:] = 2.0 * control[:, 4:] - control[:, ElementTetP2.refdom.edges].mean(axis=2)
        self.lowest, self.highest = control.min(axis=1), control.max(axis=1)
        self.located: dict[bytes, tuple[np.ndarray, np.ndarray]] = {}

    def locate(self, points: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """As Evaluator.locate; `outside` refers only to points that were not cached."""
        key = points.tobytes()
        if key not in self.located:
            self.located[key] = super().locate(points)
        return self.located[key]

    def improve(self, points: np.ndarray, open_: np.ndarray, count: int, places: tuple[np.ndarray, np.ndarray]) -> None:
        """As Evaluator.improve, without elements whose box is farther away than the nearest element so far."""
        element, local = places
        count = min(count, len(self.table))
        near = self.tree.query(points[open_], k=count)[1].reshape(len(open_), count)
        here = points[open_][:, None]
        outside = np.maximum(self.lowest[near] - here, here - self.highest[near])
        least = np.linalg.norm(np.maximum(outside, 0.0), axis=2)
        while (may := least < self.outside[open_][:, None]).any():
            some = np.flatnonzero(may.any(axis=1))
            at, where = may[some].argmax(axis=1), open_[some]
            least[some, at] = np.inf  # one try is enough
            candidate = near[some, at]
            reference = self.invert(candidate, points[where])
            nearest = np.clip(reference, 0.0, 1.0)
            nearest /= np.maximum(1.0, nearest.sum(axis=1))[:, None]
            distance, lost = (self.miss(candidate, at, points[where]) for at in (nearest, reference))
            reference[lost > 0.0] = nearest[lost > 0.0]  # the inverse map did not converge
            better = distance < self.outside[where]
            where = where[better]
            element[where], local[where], self.outside[where] = candidate[better], reference[better], distance[better]

    def miss(self, element: np.ndarray, local: np.ndarray, points: np.ndarray) -> np.ndarray:
        """Distance (n,) [m] from `points` (n, 3) to the places that reference coordinates (n, 3) are in elements (n,);
        0 within NOTHING."""
        values, _ = basis_table(ElementTetP2(), local.T)
        distance = np.linalg.norm(points - np.einsum("ma,mai->mi", values, self.x[self.table[element]]), axis=1)
        return np.where(distance < NOTHING * self.size, 0.0, distance)


_EVALUATORS: WeakValueDictionary[tuple[bytes, ...], _Remembering] = WeakValueDictionary()
"""Cache by nodes, tetrahedra and searched elements: solutions that differ only by a setting share a mesh, and a
solution may be loaded twice."""


OCTANTS = np.array(list(product((1.0, -1.0), repeat=3)))
"""Signs that mirror an octant into the whole body, (8, 3)."""
NOTHING = 1e-9
"""Distance from an element, over the size of the body, below which a point is inside."""
BESIDE = 1e-3
"""Distance from a cut, over the size of the body, at which a point is surely on one side of it."""
SAME_PLACE = 1e-5
"""Distance over the size of the body below which two points coincide: far above the rounding of a published reference,
far below an edge."""
TURNED = [0, 2, 1, 5, 4, 3]
"""A six-node facet seen from its other side."""


class Boundary(NamedTuple):
    """The boundary of the whole body."""

    points: np.ndarray
    """Rest positions of all nodes [m], (n, 3), including those inside the body."""
    facets: np.ndarray
    """Six nodes of each facet, outward, (f, 6): corners, then the nodes between first and second, second and third,
    third and first."""
    displacement: np.ndarray
    """Displacements of the nodes at the last checkpoint [m], (n, 3)."""


@dataclass(frozen=True, eq=False)
class Solution:
    """One stored load path."""

    scene: Scene
    record: Record

    def field(self, name: str) -> np.ndarray:
        """Stored values by name."""
        return self.record.fields[name].values

    @cached_property
    def force(self) -> np.ndarray:
        """The probed force at each checkpoint [N], (K,)."""
        return self.scene.output_force(self.field("contact_force"), self.field("held_force"))

    @cached_property
    def mesh(self) -> MeshTet2:
        """The second-order mesh."""
        return MeshTet2(np.ascontiguousarray(self.field("nodes").T), np.ascontiguousarray(self.field("tetrahedra").T))

    @cached_property
    def size(self) -> float:
        """Diagonal of the whole body at rest [m]."""
        return (2.0 if self.scene.symmetric else 1.0) * float(np.linalg.norm(np.ptp(self.field("nodes"), axis=0)))

    @cached_property
    def _evaluators(self) -> dict[int, Evaluator]:
        """One evaluator for the whole body, or for a cut body one for each part between the planes of its cuts: a point
        on a cut is in two parts, and next to the mouth of a cut the nearest element may be in the wrong part."""
        if not self.scene.cuts:
            return {0: self._evaluator(None)}
        middles = self.field("nodes")[self.field("tetrahedra")[:, :4]].mean(axis=1)
        side = sides_of(self.scene.cuts, middles)
        return {int(one): self._evaluator(side == one) for one in np.unique(side)}

    def _evaluator(self, among: np.ndarray | None) -> Evaluator:
        part = b"" if among is None else among.tobytes()
        key = self.field("nodes").tobytes(), self.field("tetrahedra").tobytes(), part
        evaluator = _EVALUATORS.get(key)
        if evaluator is None:
            evaluator = _EVALUATORS[key] = _Remembering(self.mesh, among)
        return evaluator

    @cached_property
    def triangles(self) -> np.ndarray:
        """Surface of linear triangles through all second-order nodes, (s, 3)."""
        return surface_triangles(self.mesh)

    def displacement(self, points: np.ndarray, checkpoint: int = -1) -> np.ndarray:
        """Displacement [m] of the material points `points` (m, 3) [m]; of an octant, mirrored.

        Points are located only once, since metrics of all runs on a mesh use the same ones.
        """
        return self._mirrored(self.field("displacement")[[checkpoint]], points)[0]

    def opening(self, points: np.ndarray) -> np.ndarray:
        """Displacement in front of the nearest of the scene's cuts less that behind it at the last checkpoint [m],
        (m, 3), at `points` (m, 3) [m] of it."""
        cuts = self.scene.cuts
        normal, level = normals_at(cuts, points), np.array([cut.plane.level(points) for cut in cuts])
        step = BESIDE * self.size * normal
        points = points - normal * level[nearest_cut(cuts, points), np.arange(len(points)), None]
        return self.displacement(points + step) - self.displacement(points - step)

    def displacements(self, points: np.ndarray) -> np.ndarray:
        """Displacement [m] of the material points `points` (m, 3) [m] at every checkpoint, (K, m, 3)."""
        return self._mirrored(self.field("displacement"), points)

    def _mirrored(self, nodal: np.ndarray, points: np.ndarray) -> np.ndarray:
        """Nodal fields (k, n, 3) [m] at points (m, 3) [m], (k, m, 3); those of an octant mirrored."""
        sign = np.where(points < 0, -1.0, 1.0) if self.scene.symmetric else np.ones_like(points)
        count, nodes, _ = nodal.shape
        # One field of 3 k components: the evaluator takes any number of them.
        columns = nodal.transpose(1, 0, 2).reshape(nodes, 3 * count)
        values, side = np.empty((len(points), 3 * count)), sides_of(self.scene.cuts, points)
        for one in np.unique(side):
            # A part without elements is where planes meet outside the body.
            evaluator = self._evaluators.get(int(one)) or self._evaluator(None)
            values[side == one] = evaluator.displacement(columns, (sign * points)[side == one])
        return sign * values.reshape(len(points), count, 3).transpose(1, 0, 2)

    def outside(self, triangles: np.ndarray) -> np.ndarray:
        """Those of the boundary triangles or facets (s, 3 or 6) that do not lie in a plane of symmetry."""
        if not self.scene.symmetric:
            return triangles
        return triangles[~np.any(np.all(np.abs(self.field("nodes")[triangles]) < 1e-12, axis=1), axis=1)]

    @cached_property
    def boundary(self) -> Boundary:
        """The boundary nodes and facets of the reference with their displacements; for an octant with all eight mirror
        images."""
        nodes, moved, facets = self.field("nodes"), self.field("displacement")[-1], facet_nodes(self.mesh)
        if not self.scene.symmetric:
            return Boundary(nodes, facets, moved)
        part, count = self.outside(facets), len(nodes)
        every = [part if sign.prod() > 0 else part[:, TURNED] for sign in OCTANTS]
        images = (OCTANTS[:, None, :] * nodes).reshape(-1, 3) + 0.0  # turns -0 into 0, which `unique` would keep apart
        points, first, new = np.unique(images, axis=0, return_index=True, return_inverse=True)
        facets = new.ravel()[np.vstack([facets + k * count for k, facets in enumerate(every)])]
        return Boundary(points, facets, (OCTANTS[:, None, :] * moved).reshape(-1, 3)[first])

    def surface(self, checkpoint: int = -1) -> tuple[np.ndarray, np.ndarray]:
        """Deformed surface of the whole body: points (n, 3) [m], triangles (s, 3)."""
        points = self.field("nodes") + self.field("displacement")[checkpoint]
        if not self.scene.symmetric:
            return points, self.triangles
        part = self.outside(self.triangles)
        faces = [
            part + k * len(points) if s.prod() > 0 else part[:, ::-1] + k * len(points) for k, s in enumerate(OCTANTS)
        ]
        return (OCTANTS[:, None, :] * points).reshape(-1, 3), np.vstack(faces)


def doubled(points: np.ndarray, facets: np.ndarray, size: float) -> np.ndarray:
    """Whether each of the facets (f, 3 or 6) of a body of a size [m] at rest lies at the place of another one, as the
    faces of a cut do, (f,) bool."""
    middles = points[facets[:, :3]].mean(axis=1)
    distance, _ = KDTree(middles).query(middles, k=2)
    return distance[:, 1] < SAME_PLACE * size
