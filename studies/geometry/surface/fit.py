"""Brings a surface mesh nearer to its shape where even nodes are too sparse: thin margins, tips, the floor of folds."""

from collections.abc import Sequence
from functools import cached_property

import numpy as np

from studies.base.errors import StudyError
from studies.geometry.mesh.organ_mesh import (
    Surface,
    mean_edge,
    triangle_areas,
    triangle_normals,
    unique_edges,
)
from studies.geometry.mesh.quality import triangle_radius_ratio
from studies.geometry.shape.levelset import Shape
from studies.geometry.shape.regions import Region
from studies.geometry.surface.distance import ChangingFacets
from studies.geometry.surface.intersections import crossing_triangles
from studies.geometry.surface.node_count import flip_edges, split_edge
from studies.geometry.surface.sides import (
    along_facets,
    lattice,
    outline_edges,
    places_on,
    region_area,
    region_side,
    with_middles,
)
from studies.geometry.surface.snap import outlined

FLOOR = 0.3
"""Smallest radius ratio of a triangle that a new node may make; the fill has good elements above 0.2."""
SHARPEST = -0.5
"""Smallest cosine between the normals of neighbours at a new node (120 degrees); a sharper fold gives slivers."""
ROUNDS = 16
"""Smallest number of rounds in which nodes are added; each round measures the distances again."""
TRIED = 30
"""Points, the farthest first, that a round tries in addition to the number of nodes that it has to add."""
ENOUGH = 0.003
"""Deviation over the size below which no node is added for the shape."""
APART = 2.0
"""Smallest distance between nodes that are added in one round, in mean edges."""
BEFORE = 0.6
"""Share of the added nodes that come before the outlines of regions, which spoil the fit a little."""
BESIDE = 2.5
"""Distance from an outline, in mean edges, within which the surface is relaxed; farther away nodes stay in place."""
STRAIGHT, CURVED, AREA = 0.01, 0.007, 0.02
"""Bounds of a good fit: deviation of straight and of curved sides from the shape, over the size, and relative deviation
of the area of a region."""
FEWEST_AT_OUTLINE = 10
"""Edges of the outline of a region; with fewer the region loses more than a few per cent of its area."""


def fitted(shape: Shape, base: Surface, nodes: int, regions: Sequence[Region], truth: Surface, curved: bool) -> "Fit":
    """A surface that follows its shape, with the outline of every region on its edges and `nodes` nodes, or fewer if no
    edge can be split any more.

    base: a surface of evenly spread nodes on f = 0, fewer than `nodes`; truth: a fine surface; curved: the sides will
    be quadratic. Raises StudyError if an outline does not fit, or if triangles cross.
    """
    fit = Fit(shape, base, [], truth, curved)
    fit.grow(len(base[0]) + round(BEFORE * (nodes - len(base[0]))))
    fit = Fit(shape, outlined(shape, *fit.surface, regions, BESIDE * mean_edge(*fit.surface)), regions, truth, curved)
    fit.fill_outlines(nodes)
    fit.grow(nodes)
    fit.split_longest(nodes)
    if len(crossing_triangles(*fit.surface)):
        raise StudyError(f"{shape.name}: its surface of {nodes} nodes would cut through itself; use more nodes")
    return fit


class Fit:
    """A surface on f = 0 to which nodes are added where it is farthest from its shape, in either direction."""

    def __init__(self, shape: Shape, surface: Surface, regions: Sequence[Region], truth: Surface, curved: bool):
        """surface: points (n, 3) [m] and triangles (t, 3) with the outlines of `regions` on edges; truth: the same of a
        surface fine enough to represent f = 0; curved: the sides will be quadratic, with mid-side nodes on f = 0."""
        self.shape, self.regions, self.curved = shape, list(regions), curved
        self.points, self.triangles = surface
        self.outlines = self.find_outlines()
        self.truth = truth
        self.size = float(np.linalg.norm(np.ptp(truth[0], axis=0)))

    @cached_property
    def gaps(self) -> ChangingFacets:
        return ChangingFacets(*self.truth)

    def deviation(self) -> float:
        """Largest distance between the surface and its shape, in either direction, over the size [1]."""
        return float(max(away.max() for _, away in self.distances())) / self.size

    def area_error(self) -> float:
        """Largest relative deviation of the area of a region from that on the true surface [1]; 0 without regions."""
        errors = [0.0]
        points, facets = with_middles(self.shape, self.points, self.triangles, self.regions, self.curved)
        for region in self.regions:
            inside = (region_side(region, self.points) <= 0)[self.triangles].all(axis=1)
            area = triangle_areas(*along_facets(points, facets[inside])).sum()
            errors.append(abs(float(area) / region_area(region, *self.truth) - 1.0))
        return max(errors)

    def badness(self) -> float:
        """The larger of deviation and area error, each over its bound [1]; 1 or less is good enough."""
        return max(self.deviation() / (CURVED if self.curved else STRAIGHT), self.area_error() / AREA)

    def distances(self) -> tuple[tuple[np.ndarray, np.ndarray], tuple[np.ndarray, np.ndarray]]:
        """Points (m, 3) [m] on the true surface and their distances (m,) [m] from this one, and the reverse."""
        points, facets = with_middles(self.shape, self.points, self.triangles, self.regions, self.curved)
        places = along_facets(points, facets)[0].reshape(len(facets), -1, 3)
        ahead, behind = self.gaps.measure(places, lattice()[1])
        return (self.truth[0], ahead), (places.reshape(-1, 3), behind.ravel())

    def grow(self, nodes: int) -> None:
        """Adds nodes until there are `nodes`, or until a round adds none."""
        batch = max(1, (nodes - len(self.points)) // ROUNDS)
        while len(self.points) < nodes and self.add(min(batch, nodes - len(self.points))):
            pass

    def add(self, count: int) -> int:
        """Adds up to `count` nodes, far from each other, where the surface is farthest from its shape; returns how
        many."""
        (samples, ahead), (places, behind) = self.distances()
        targets, away = np.concatenate([samples, places]), np.concatenate([ahead, behind])
        apart = APART * mean_edge(*self.surface)
        added, left = 0, np.argsort(-away, kind="stable")
        for _ in range(TRIED + count):
            left = left[away[left] > ENOUGH * self.size]
            if added == count or not len(left):
                break
            target = targets[left[0]]
            grown = self.add_near(target, on_shape=left[0] < len(samples))
            added += grown
            # Near a failed point others fail too; near a new node the distances have changed.
            reach = apart if grown else apart / 8.0
            left = left[np.linalg.norm(targets[left] - target, axis=1) > reach]
        return added

    def add_near(self, target: np.ndarray, on_shape: bool) -> bool:
        """Splits an edge near `target` (3,) [m]; returns whether one could be split without spoiling a triangle.

        on_shape: whether the target lies on the true surface; the new node is then tried there first. Else, and on an
        outline, it is the middle of the edge, projected onto f = 0.
        """
        near = np.argsort(np.linalg.norm(self.points - target, axis=1))[:6]
        edges = unique_edges(self.triangles[np.isin(self.triangles, near).any(axis=1)])
        middles = places_on(self.shape, self.points, edges, self.outlines, self.regions)
        for k in np.argsort(np.linalg.norm(middles - target, axis=1))[:3]:
            on_outline = self.is_outline(edges[k])
            for place in [middles[k]] if on_outline or not on_shape else [target, middles[k]]:
                if self.split(edges[k], place, on_outline):
                    return True
        return False

    def fill_outlines(self, nodes: int) -> None:
        """Splits the longest edges of each outline until it has FEWEST_AT_OUTLINE edges, twice as many if the area
        error of its region is over AREA, as long as there are fewer than `nodes` nodes."""
        for region in self.regions:
            alone = Fit(self.shape, self.surface, [region], self.truth, self.curved)
            fewest = FEWEST_AT_OUTLINE * (2 if alone.area_error() > AREA else 1)
            while len(edges := outline_edges(*self.surface, region)) < fewest and len(self.points) < nodes:
                if not self.split_first(edges):
                    break

    def split_longest(self, nodes: int) -> None:
        while len(self.points) < nodes and self.split_first(unique_edges(self.triangles)):
            pass

    def split_first(self, edges: np.ndarray) -> bool:
        """Splits the longest of the edges (e, 2) that allows it, an edge of an outline on its curve; False if none."""
        length = np.linalg.norm(np.diff(self.points[edges], axis=1)[:, 0], axis=1)
        for edge in edges[np.argsort(-length, kind="stable")]:
            place = places_on(self.shape, self.points, edge[None], self.outlines, self.regions)[0]
            if self.split(edge, place, self.is_outline(edge)):
                return True
        return False

    def find_outlines(self) -> np.ndarray:
        return np.concatenate([np.empty((0, 2), int), *(outline_edges(*self.surface, r) for r in self.regions)])

    @property
    def surface(self) -> Surface:
        return self.points, self.triangles

    def split(self, edge: np.ndarray, place: np.ndarray, on_outline: bool) -> bool:
        """Splits an edge at a point `place` (3,) [m] on f = 0, then flips edges around it; False, and nothing changed,
        if that spoils a triangle or crosses an outline."""
        count = len(self.points)
        points, triangles = split_edge(self.points, self.triangles, edge)
        points[-1] = place
        if not on_outline and self.crosses(points, triangles, count):
            return False
        around = triangles[(triangles == count).any(axis=1)]
        ring = unique_edges(around)
        ring = ring[[(row != count).all() and not self.is_outline(row) for row in ring]]
        triangles = flip_edges(points, triangles, ring, lambda k, m: True, 1.0)
        # None is left if all four were flipped; triangles that a flip made are better than those before it.
        around = np.isin(triangles, around).sum(axis=1) == 3
        worst = triangle_radius_ratio(points, triangles[around]).min(initial=np.inf)
        if worst < FLOOR or folds(points, triangles, count):
            return False
        self.points, self.triangles = points, triangles
        if on_outline:
            self.outlines = self.find_outlines()
        return True

    def is_outline(self, edge: np.ndarray) -> bool:
        return bool((edge == self.outlines).all(axis=1).any())

    def crosses(self, points: np.ndarray, triangles: np.ndarray, node: int) -> bool:
        """Whether a new node lies on the outline of a region, or on another side of it than one of its neighbours."""
        ring = np.unique(triangles[(triangles == node).any(axis=1)])
        sides = [region_side(region, points[ring]) for region in self.regions]
        own = ring == node
        return any(side[own][0] == 0 or (side[own][0] * side < 0).any() for side in sides)


def folds(points: np.ndarray, triangles: np.ndarray, node: int) -> bool:
    """Whether the normals of two neighbours among the triangles around a node have a cosine below SHARPEST."""
    near = triangles[np.isin(triangles, triangles[(triangles == node).any(axis=1)]).any(axis=1)]
    normals = triangle_normals(points, near)
    normals /= np.maximum(np.linalg.norm(normals, axis=1, keepdims=True), 1e-300)
    shared = (near[:, None, :, None] == near[None, :, None, :]).any(axis=3).sum(axis=2)
    return bool(((normals @ normals.T)[shared == 2] < SHARPEST).any())
