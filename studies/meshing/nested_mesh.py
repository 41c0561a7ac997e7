"""Nested meshes of a reference: each halves some elements of the one before and is closer to the true shape."""

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from skfem import ElementTetP2, MeshTet, MeshTet2

from reference_fem import nodes
from reference_fem.elements.evaluate import Evaluator
from reference_fem.elements.shapes import basis_table, element_nodes
from studies.base.errors import StudyError
from studies.geometry.mesh.jacobian import smallest_jacobian
from studies.geometry.mesh.organ_mesh import tetrahedron_volumes
from studies.meshing.bounds import HELD_AREA
from studies.meshing.held_mesh import HeldMesh, held_mesh, rim_sides
from studies.meshing.kept_shape import area_error, level_that_holds
from studies.meshing.opened_mesh import opened_elements
from studies.meshing.outlines import drawn_middles
from studies.meshing.reference_mesh import on_true_sides
from studies.meshing.scene_mesh import mesh_for
from studies.meshing.shaping import aimed, laid_out
from studies.meshing.true_shape import true_shape
from studies.scene.organ_file import remeshed
from studies.scene.scene import Scene

SHARE = 0.42
"""Where the middle of a side stands that leaves an outline, as a share of its length from there (measured,
docs/theory.md, section 6: nearer ones overshoot once elements are small)."""
UPRIGHT = 0.05
"""Smallest Jacobian, over that of the mean, below which the new nodes of an element go back to its parent's curve."""
LEAST = 0.02
"""The same below which an element keeps its middles where they are."""
SMALLEST = 0.012
"""Of the diagonal of the body: elements at outlines whose halves would have a smaller edge are not marked. A mesh may
halve what is larger several times, and neighbours with it: down to a fifth of that was seen. The strain there grows
without bound as they shrink, until a neo-Hookean element inverts and no equilibrium is found; 0.012 leaves 0.1 to 0.2 %
of the force of the clamped ball (docs/theory.md, section 6)."""
REGULAR = 1.0 / (6.0 * np.sqrt(2.0))
"""Volume of a regular tetrahedron over the cube of its edge."""
CHILD = 0.25
"""Of an element's error indicator that each half of it is expected to have."""
LOST, MORE = 0.5 * HELD_AREA, 2.0
"""Error of the area of a held region [%] with which the coarsest mesh is taken as it is; otherwise finer ones are
tried, up to so many times its surface nodes. Two hanging spleens lost 5 and 6 % at 270 nodes, 0.2 and 0.3 % at 292:
their references turned too far (docs/population.md)."""
GROWTH = 1.3
"""Factor by which elements may grow at a time while marks are chosen: then the largest indicators are known again."""


@dataclass(frozen=True, eq=False)
class NestedMesh:
    """One mesh of a family."""

    scene: Scene
    body: HeldMesh
    """Its vertices before they were moved: parts of the flat elements of the coarsest mesh."""
    points: np.ndarray
    """P2 nodes on the true shape [m], (n, 3); middles half-way."""
    off: int = 0
    """Boundary nodes that were put back, or elements would fold."""

    @cached_property
    def mesh(self) -> MeshTet2:
        """Middles of sides that leave an outline, or the front of a cut, are drawn to it."""
        flat = MeshTet2.from_mesh(self.body.mesh)
        *held, _ = self.body.facets(flat)
        outlines = np.concatenate([*(rim_sides(facets)[:, :2].ravel() for facets in held), self.body.front]).astype(int)
        target = drawn_middles(self.points, flat, outlines, SHARE)
        points, _ = upright(self.points, target, element_nodes(flat), LEAST)
        return replace(flat, doflocs=np.ascontiguousarray(points.T))

    @cached_property
    def _opened(self) -> tuple[MeshTet2, np.ndarray]:
        return self.opened_until(np.inf)

    def opened_until(self, t: float) -> tuple[MeshTet2, np.ndarray]:
        """The mesh opened along the cuts that the scene makes before time t [s], and for each of its nodes the one of
        `mesh` that it was, (n',). Raises StudyError."""
        ways = zip(self.scene.cuts, self.body.faces_of_cuts, strict=True)
        made = [faces for cut, faces in ways if cut.at < t]
        if not made:
            return self.mesh, np.arange(len(nodes(self.mesh)))
        return opened_elements(self.mesh, np.concatenate(made))

    @property
    def solved(self) -> MeshTet2:
        """The mesh that is solved last: opened along all the scene's cuts."""
        return self._opened[0]

    @property
    def parent(self) -> np.ndarray:
        """For each node of the mesh that is solved last the one of `mesh` that it was, (n',)."""
        return self._opened[1]

    @cached_property
    def held(self) -> list[np.ndarray]:
        """Nodes of each held region, in `mesh`."""
        return [np.unique(facets) for facets in self.body.facets(self.mesh)[:-1]]

    def held_in(self, parent: np.ndarray) -> list[np.ndarray]:
        """The same in an opened mesh, whose nodes were `parent` (n',)."""
        return [np.flatnonzero(np.isin(parent, held)) for held in self.held]

    @cached_property
    def patches(self) -> list[np.ndarray]:
        """The same in the mesh that is solved last."""
        return self.held_in(self.parent)

    @cached_property
    def small_at_outlines(self) -> np.ndarray:
        """Elements with a vertex on an outline whose halves would be smaller than SMALLEST, (ne,) bool."""
        least = SMALLEST * float(np.linalg.norm(np.ptp(self.points, axis=0)))
        return small_at_outlines(self.body, self.points, least)

    @property
    def lost_area(self) -> float:
        """The largest error of the area of a held region [%]; 0 where the true area is not known."""
        *facets, _ = self.body.facets(self.mesh)
        pairs = zip(self.scene.held, facets, strict=True)
        errors = [100.0 * abs(area_error(self.scene.organ, held, self.points, some)) for held, some in pairs]
        return max((error for error in errors if error == error), default=0.0)

    def lumen_at(self, t: float) -> np.ndarray | None:
        """Middles of the corners of the facets of a filled lumen [m], (f, 3); None where none is filled at time t [s]:
        a cut lets the content go."""
        if not self.scene.filled_at(t):
            return None
        return nodes(self.mesh)[self.body.facets(self.mesh)[-1][:, :3]].mean(axis=1)

    def finer(self, indicator: np.ndarray, elements: int) -> tuple["NestedMesh", np.ndarray]:
        """A mesh of about so many elements, those halved whose indicator (ne,) is largest; and the element of this mesh
        of which each of its elements is a part, (new ne,)."""
        body, parents = marked(self.body, np.where(self.small_at_outlines, 0.0, indicator), elements)
        cells, flat = element_nodes(body.mesh), MeshTet2.from_mesh(self.body.mesh)
        owner = at_nodes(body.mesh, parents)
        bent = Evaluator(replace(flat, doflocs=np.ascontiguousarray(self.points.T)))
        where = Evaluator(flat).invert(owner, nodes(body.mesh))
        guess = interpolated(bent, owner, where)
        shape = true_shape(self.scene.organ)
        if shape is None:
            return replace(self, body=body, points=guess, off=0), parents
        points, back = upright(guess, aimed(self.scene, body, shape, guess), cells, UPRIGHT)
        return replace(self, body=body, points=points, off=int(back.sum())), parents


def at_nodes(mesh: MeshTet | MeshTet2, of_elements: np.ndarray) -> np.ndarray:
    """For each P2 node the value (ne,) of one of its elements, (n,)."""
    cells = element_nodes(mesh)
    values = np.empty(int(cells.max()) + 1, dtype=of_elements.dtype)
    values[cells] = of_elements[:, None]
    return values


def base_mesh(scene: Scene, surface_nodes: int, at_contact: int) -> NestedMesh:
    """The coarsest mesh of a family: with `surface_nodes`, or up to MORE times as many where those lose area of a held
    region. Halving brings no end of a region back, and what is held by less of it turns too far.

    Raises StudyError for one that cannot be made, or that still loses more than bodies may.
    """
    if not remeshed(scene.organ):
        return _base_mesh(scene, surface_nodes, at_contact)
    lost = lambda level: _base_mesh(scene, level, at_contact).lost_area  # noqa: E731
    level = level_that_holds(surface_nodes, round(MORE * surface_nodes), lost, LOST)
    mesh = _base_mesh(scene, level, at_contact)
    if mesh.lost_area > HELD_AREA:
        raise StudyError(
            f"scene '{scene.name}': of all reference meshes from {surface_nodes} to {MORE * surface_nodes:g} surface "
            f"nodes the area of a held region is at least {mesh.lost_area:.2g} % off that on the true surface "
            f"(allowed: {HELD_AREA:g} %); give its plan a larger base, or the region a smoother outline"
        )
    return mesh


def _base_mesh(scene: Scene, surface_nodes: int, at_contact: int) -> NestedMesh:
    organ_mesh = mesh_for(scene, surface_nodes, on_shape=True)
    coarse = held_mesh(scene, organ_mesh)
    body = coarse.refined(scene, 0, at_contact)
    points, shape = nodes(on_true_sides(scene, organ_mesh, coarse, body)), true_shape(scene.organ)
    if shape is not None and not smallest_jacobian(points, element_nodes(body.mesh)).min() > 0.0:
        # An element may fold between the points where the reference integrates it: a part of it folds there too.
        points = laid_out(scene, organ_mesh, coarse, body, shape)
    return NestedMesh(scene, body, points)


def small_at_outlines(body: HeldMesh, points: np.ndarray, least: float) -> np.ndarray:
    """Elements with a vertex on an outline or the front of a cut whose halves would have edges shorter than `least` [m]
    if their vertices were at `points` (n, 3) [m], (ne,) bool."""
    small = edges_of(points, body.mesh.t.T) * 0.5 ** (1 / 3) < least
    there = np.zeros(body.mesh.nelements, dtype=bool)
    if small.any():  # finding what is at outlines takes longer
        there[body.at_outlines()] = True
    return there & small


def edges_of(points: np.ndarray, cells: np.ndarray) -> np.ndarray:
    """Edge of the regular tetrahedron that has the volume of each of `cells` (k, 4) [m], (k,)."""
    return np.cbrt(np.abs(tetrahedron_volumes(points, cells)) / REGULAR)


def marked(body: HeldMesh, indicator: np.ndarray, elements: int, least: float = 0.0) -> tuple[HeldMesh, np.ndarray]:
    """`body` with elements halved until there are `elements`, and the parent of each; largest indicators first.
    Elements at outlines are not marked where their halves would have edges shorter than `least` [m]."""
    parents, expected = np.arange(body.mesh.nelements), indicator.astype(float)
    while body.mesh.nelements < elements:
        if least > 0.0:
            expected = np.where(small_at_outlines(body, body.mesh.p.T, least), 0.0, expected)
        if not expected.max() > 0.0:
            break
        count = body.mesh.nelements
        room = max(1, (min(elements, int(GROWTH * count)) - count) // 3)
        # Rounded, then by number: the last bits of an indicator differ between processors.
        order = np.lexsort((np.arange(count), -np.round(expected / expected.max(), 12)))
        chosen = order[: min(room, int((expected > CHILD * expected.max()).sum()))]
        body, of = body.halved(np.sort(chosen))
        split = np.bincount(of)[of]
        parents, expected = parents[of], expected[of] * CHILD ** np.log2(split)
    return body, parents


def upright(safe: np.ndarray, target: np.ndarray, cells: np.ndarray, least: float) -> tuple[np.ndarray, np.ndarray]:
    """`target` (n, 3) [m] with the nodes of elements (k, 10) back at `safe` whose smallest Jacobian would be below
    `least` and is not at `safe`; and which nodes those are."""
    back = np.zeros(len(safe), dtype=bool)
    moved = (target != safe).any(axis=1)
    while True:
        x = np.where(back[:, None], safe, target)
        folded = np.flatnonzero(smallest_jacobian(x, cells) < least)
        new = np.zeros_like(back)
        new[cells[folded]] = True
        new &= moved & ~back
        if not new.any():
            return x, back
        back |= new


def interpolated(mesh: Evaluator, element: np.ndarray, local: np.ndarray) -> np.ndarray:
    """Points (n, 3) [m] of `mesh` at reference coordinates (n, 3) of its elements (n,)."""
    values, _ = basis_table(ElementTetP2(), local.T)
    return np.einsum("na,nai->ni", values, mesh.x[mesh.table[element]])
