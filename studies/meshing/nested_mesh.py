"""Nested meshes of a reference: each halves some elements of the coarser one and is nearer to the true shape."""

from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np
from skfem import ElementTetP2, MeshTet, MeshTet2

from reference_fem import facet_nodes, nodes
from reference_fem.elements.evaluate import Evaluator
from reference_fem.elements.shapes import basis_table, element_nodes
from studies.base.errors import StudyError
from studies.geometry.mesh.organ_mesh import tetrahedron_volumes
from studies.geometry.mesh.quality import smallest_jacobian
from studies.geometry.surface.distance import distance_to_surface
from studies.meshing.bounds import HELD_AREA, REFERENCE_SHAPE, REFERENCE_UNDER_TOOL
from studies.meshing.held_mesh import HeldMesh, held_mesh, rim_sides
from studies.meshing.kept_shape import area_error, level_that_holds
from studies.meshing.moving_tools import fine_under_tools
from studies.meshing.opened_mesh import opened_elements
from studies.meshing.reference_mesh import on_true_sides
from studies.meshing.rest_surface import rest_surfaces
from studies.meshing.scene_mesh import mesh_for
from studies.meshing.shaping import aimed, drawn_middles, laid_out
from studies.meshing.true_shape import true_shape
from studies.meshing.true_surface import true_surface
from studies.scene.organ_file import remeshed
from studies.scene.scene import Scene

SHARE = 0.42
"""Position of the mid-side node of a side that starts at an outline, as a share of its length from there (measured,
docs/theory.md, section 6: smaller shares overshoot once elements are small)."""
UPRIGHT = 0.05
"""Smallest Jacobian over its mean below which the new nodes of an element return to the curve of its parent."""
LEAST = 0.02
"""The same below which the mid-side nodes of an element are not shifted."""
SMALLEST = 0.012
"""Smallest edge of marked elements at outlines, over the diagonal of the body: elements whose halves would be smaller
are not marked. Larger ones may be halved several times, with their neighbours; edges down to a fifth of this were seen.
The strain there grows without bound as elements shrink, until a neo-Hookean element inverts and there is no
equilibrium. 0.012 causes an error of 0.1 to 0.2 % in the force of the clamped ball (docs/theory.md, section 6)."""
REGULAR = 1.0 / (6.0 * np.sqrt(2.0))
"""Volume of a regular tetrahedron over the cube of its edge."""
CHILD = 0.25
"""Expected error indicator of each half of an element, over that of the element."""
LOST, MORE = 0.5 * HELD_AREA, 2.0
"""LOST: error of the area of a held region [%] up to which the coarsest mesh is accepted. Otherwise finer ones are
tried, up to MORE times its surface nodes. Two hanging spleens lost 5 and 6 % at 270 nodes, 0.2 and 0.3 % at 292, so
that their references turned too far (docs/population.md)."""
FAR = 0.8 * REFERENCE_SHAPE
"""Distance [%] from the true surface, over its size, beyond which elements are halved before all others."""
GROWTH = 1.3
"""Factor by which the number of elements grows between two selections of the largest indicators."""


@dataclass(frozen=True, eq=False)
class NestedMesh:
    scene: Scene
    body: HeldMesh
    """The mesh before its vertices were moved to the true shape: its elements are parts of the flat elements of the
    coarsest mesh."""
    points: np.ndarray
    """P2 nodes on the true shape [m], (n, 3), with mid-side nodes half-way."""
    back: np.ndarray = field(default_factory=lambda: np.zeros(0, dtype=np.int64))
    """Boundary nodes that are off the true shape, since elements would fold otherwise."""

    @property
    def off(self) -> int:
        """Their number."""
        return len(self.back)

    @cached_property
    def mesh(self) -> MeshTet2:
        """The second-order mesh, with mid-side nodes shifted towards outlines and fronts of cuts."""
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
        """The mesh opened along the cuts that the scene makes before time t [s], and for each of its nodes the node of
        `mesh`, (n',). Raises StudyError."""
        ways = zip(self.scene.cuts, self.body.faces_of_cuts, strict=True)
        made = [faces for cut, faces in ways if cut.at < t]
        if not made:
            return self.mesh, np.arange(len(nodes(self.mesh)))
        return opened_elements(self.mesh, np.concatenate(made))

    @property
    def solved(self) -> MeshTet2:
        """The mesh that is solved last, opened along all cuts of the scene."""
        return self._opened[0]

    @property
    def parent(self) -> np.ndarray:
        """For each node of the mesh that is solved last its node in `mesh`, (n',)."""
        return self._opened[1]

    @cached_property
    def held(self) -> list[np.ndarray]:
        """Nodes of each held region, in `mesh`."""
        return [np.unique(facets) for facets in self.body.facets(self.mesh)[:-1]]

    def held_in(self, parent: np.ndarray) -> list[np.ndarray]:
        """The same in an opened mesh; `parent` (n',): the node of `mesh` of each of its nodes."""
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

    @cached_property
    def far(self) -> np.ndarray:
        """Elements with a facet that is farther from the true surface than FAR, or nearest to a part of that surface so
        far away, (ne,) bool. Without facets next to nodes of `back`: halving brings these no nearer."""
        far = np.zeros(self.mesh.nelements, dtype=bool)
        truth = true_surface(self.scene.organ) if remeshed(self.scene.organ) else None
        if truth is None:
            return far
        facets, bound = facet_nodes(self.mesh), FAR / 100.0 * truth.size
        found = list[np.ndarray]()
        for name, side in rest_surfaces(nodes(self.mesh), facets).items():
            if name not in truth.sides:
                continue
            near = side.nearest(truth.sides[name][0])
            away = distance_to_surface(side.lattice()[0], *truth.sides[name]).reshape(len(side.facets), -1)
            found += [side.facets[near.facet[near.distance > bound]], side.facets[away.max(axis=1) > bound]]
        corners = {tuple(sorted(one)) for one in np.concatenate(found)[:, :3].tolist()} if found else set()
        beside = np.isin(facets, self.back).any(axis=1)
        chosen = np.array([tuple(sorted(one)) in corners for one in facets[:, :3].tolist()]) & ~beside
        far[self.mesh.f2t[0, self.mesh.boundary_facets()[chosen]]] = True
        return far

    @property
    def lost_area(self) -> float:
        """The largest error of the area of a held region [%]; 0 if the true area is unknown."""
        *facets, _ = self.body.facets(self.mesh)
        pairs = zip(self.scene.held, facets, strict=True)
        errors = [100.0 * abs(area_error(self.scene.organ, held, self.points, some)) for held, some in pairs]
        return max((error for error in errors if error == error), default=0.0)

    def lumen_at(self, t: float) -> np.ndarray | None:
        """Middles of the facets of a filled lumen [m], (f, 3), by their corners; None if it is not filled at time t
        [s]: a cut may drain it."""
        if not self.scene.filled_at(t):
            return None
        return nodes(self.mesh)[self.body.facets(self.mesh)[-1][:, :3]].mean(axis=1)

    def finer(self, indicator: np.ndarray, elements: int) -> tuple["NestedMesh", np.ndarray]:
        """A mesh of about `elements` elements in which those with the largest indicator (ne,) are halved; and the
        element of this mesh of which each is a part, (new ne,)."""
        body, parents = marked(self.body, np.where(self.small_at_outlines, 0.0, indicator), elements)
        cells, flat = element_nodes(body.mesh), MeshTet2.from_mesh(self.body.mesh)
        owner = at_nodes(body.mesh, parents)
        bent = Evaluator(replace(flat, doflocs=np.ascontiguousarray(self.points.T)))
        where = Evaluator(flat).invert(owner, nodes(body.mesh))
        guess = interpolated(bent, owner, where)
        shape = true_shape(self.scene.organ)
        if shape is None:
            return replace(self, body=body, points=guess, back=self.back[:0]), parents
        points, back = upright(guess, aimed(self.scene, body, shape, guess), cells, UPRIGHT)
        return replace(self, body=body, points=points, back=np.flatnonzero(back)), parents


def at_nodes(mesh: MeshTet | MeshTet2, of_elements: np.ndarray) -> np.ndarray:
    """For each P2 node the value of one of its elements, (n,), from values (ne,) of the elements."""
    cells = element_nodes(mesh)
    values = np.empty(int(cells.max()) + 1, dtype=of_elements.dtype)
    values[cells] = of_elements[:, None]
    return values


def base_mesh(scene: Scene, surface_nodes: int, at_contact: int) -> NestedMesh:
    """The coarsest mesh of a family: with `surface_nodes`, or up to MORE times as many if a held region loses area:
    halving does not restore a lost end of it. Raises StudyError for one that cannot be made, or that still loses more
    than bodies may."""
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
    body = fine_under_tools(scene, coarse.refined(scene, 0, at_contact), REFERENCE_UNDER_TOOL)
    points, shape = nodes(on_true_sides(scene, organ_mesh, coarse, body)), true_shape(scene.organ)
    if shape is not None and not smallest_jacobian(points, element_nodes(body.mesh)).min() > 0.0:
        # An element may fold between its integration points; its parts would then fold at theirs.
        points = laid_out(scene, organ_mesh, coarse, body, shape)
    return NestedMesh(scene, body, points)


def small_at_outlines(body: HeldMesh, points: np.ndarray, least: float) -> np.ndarray:
    """Elements with a vertex on an outline or the front of a cut whose halves would have edges shorter than `least` [m]
    if their vertices were at `points` (n, 3) [m], (ne,) bool."""
    small = edges_of(points, body.mesh.t.T) * 0.5 ** (1 / 3) < least
    there = np.zeros(body.mesh.nelements, dtype=bool)
    if small.any():  # finding the elements at outlines takes longer
        there[body.at_outlines()] = True
    return there & small


def edges_of(points: np.ndarray, cells: np.ndarray) -> np.ndarray:
    """Edge of the regular tetrahedron with the same volume as each of `cells` (k, 4) [m], (k,)."""
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
        # Sorted by rounded value, then by number, since the last bits of an indicator differ between processors.
        order = np.lexsort((np.arange(count), -np.round(expected / expected.max(), 12)))
        chosen = order[: min(room, int((expected > CHILD * expected.max()).sum()))]
        body, of = body.halved(np.sort(chosen))
        split = np.bincount(of)[of]
        parents, expected = parents[of], expected[of] * CHILD ** np.log2(split)
    return body, parents


def upright(safe: np.ndarray, target: np.ndarray, cells: np.ndarray, least: float) -> tuple[np.ndarray, np.ndarray]:
    """`target` (n, 3) [m], with the nodes of those elements (k, 10) moved back to `safe` whose smallest Jacobian would
    be below `least` but is not at `safe`; and which nodes these are."""
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
