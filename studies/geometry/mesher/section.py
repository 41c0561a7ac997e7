"""Fills a surface on both sides of planes whose sections are meshed, so that the blades of cuts lie on faces."""

from itertools import pairwise, product
from typing import Any

import gmsh
import numpy as np

from studies.base.errors import StudyError
from studies.geometry.mesh.organ_mesh import (
    Surface,
    connected,
    signed_volume,
    tetrahedron_facets,
    tetrahedron_volumes,
    triangle_areas,
    triangle_normals,
)
from studies.geometry.mesh.quality import MIN_WALL_RATIO, tetrahedron_radius_ratio
from studies.geometry.mesher.gmsh_calls import TRIANGLE, fill_surface, fresh_model
from studies.geometry.shape.levelset import Shape, at_depth, project
from studies.geometry.shape.regions import ON_CURVE, BallRegion, HalfSpace, Region, region_from_dict
from studies.geometry.surface.first_surface import first_surface
from studies.geometry.surface.sheet import LEAST_PIECE, check_apart, check_sheet

ROUND = 16
"""Fewest sides of the polygon that represents the edge of a disc: with 16 it has 2.6 % less area than the disc."""
SHARP = 15.0
"""Angle of a triangle of the section [degrees] below which it may prevent the fill of the body next to it."""
FEWEST_CELLS = 30
"""Fewest tetrahedra of a separate piece."""


def check_clear(shape: Shape, cuts: list[dict[str, Any]], held: list[Region], nodes: int) -> None:
    """Raises StudyError for cuts that no mesh of the shape with so many surface nodes can have (surface/sheet.py).
    held: regions whose outlines the cuts must not cross."""
    if not cuts:
        return
    surface, sheets = first_surface(shape), {}
    for cut in cuts:
        plane = plane_of(cut)
        sheets[cut["name"]] = plane, check_sheet(shape.name, cut["name"], surface, plane, _within(cut), held)
    edge = np.sqrt(2.0 / np.sqrt(3.0) * triangle_areas(*surface).sum() / nodes)
    check_apart(shape.name, sheets, float(edge))


def plane_of(cut: dict[str, Any]) -> HalfSpace:
    """The plane of a cut as a region, whose outline on a surface is the trace of the cut."""
    plane = region_from_dict(cut["plane"])
    assert isinstance(plane, HalfSpace)  # the only kind that a cut has
    return plane


def with_front(shape: Shape, surface: Surface, cut: dict[str, Any]) -> Surface:
    """The surface with the two nodes of the trace that are nearest to a straight front moved exactly onto it; the trace
    has to lie on edges. Raises StudyError unless the front meets the trace twice, at different nodes."""
    points, triangles = surface
    plane, within = plane_of(cut), _within(cut)
    edges = trace(plane, points, triangles, shape.size, cut["name"])
    if within is None or isinstance(within, BallRegion):
        return surface
    level = within.level(points)
    crossing = edges[(level[edges] <= 0).sum(axis=1) == 1]
    if len(crossing) != 2:
        raise StudyError(
            f"{shape.name}: the front of cut {cut['name']!r} meets the trace {len(crossing)} times and not twice; "
            "move it, or cut the whole section"
        )
    ends = crossing[np.arange(2), np.abs(level[crossing]).argmin(axis=1)]
    if ends[0] == ends[1]:
        raise StudyError(
            f"{shape.name}: the blade of cut {cut['name']!r} holds no face; use more nodes or a larger one"
        )
    points = points.copy()
    points[ends] = project(shape, points[ends], (plane.level, within.level))
    return points, triangles


def _within(cut: dict[str, Any]) -> Region | None:
    return None if cut["within"] is None else region_from_dict(cut["within"])


def trace(plane: HalfSpace, points: np.ndarray, triangles: np.ndarray, size: float, name: str) -> np.ndarray:
    """Edges (e, 2) of a surface that lie in the plane, between triangles on different sides of it; size: of the box of
    the shape [m]. Raises StudyError if the trace of the cut `name` touches itself."""
    on = np.abs(plane.level(points)) <= 10 * ON_CURVE * size
    side = _side(plane, points, triangles, size)
    half = triangles[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2)
    keys, inverse = np.unique(np.sort(half, axis=1), axis=0, return_inverse=True)
    sides = np.bincount(inverse.reshape(-1), weights=np.repeat(side, 3))
    edges = keys[on[keys].all(axis=1) & (sides == 0)]
    if (np.bincount(edges.ravel())[np.unique(edges)] != 2).any():
        raise StudyError(f"the trace of cut {name!r} touches itself; move the plane, or use more nodes")
    return edges


def _side(plane: HalfSpace, points: np.ndarray, triangles: np.ndarray, size: float) -> np.ndarray:
    """Side of each triangle (t,): −1 behind the plane, 1 in front; for a triangle in the plane that of the body."""
    flat = (np.abs(plane.level(points)) <= 10 * ON_CURVE * size)[triangles].all(axis=1)
    outward = triangle_normals(points, triangles) @ np.asarray(plane.normal, float)
    return np.where(np.where(flat, outward < 0, plane.level(points[triangles].mean(axis=1)) > 0), 1, -1)


def fill_cut(
    shape: Shape, surface: Surface, cuts: list[dict[str, Any]]
) -> tuple[np.ndarray, np.ndarray, list[np.ndarray]]:
    """Fills a surface on both sides of each cut: all points (n, 3) [m], those of the surface first, tetrahedra (k, 4),
    and the faces (f, 3) of each blade, anticlockwise seen from in front of its plane.

    Raises StudyError for a piece that is too small or cannot be filled.
    """
    points, triangles = surface
    planes, sections, blades = [plane_of(cut) for cut in cuts], list[np.ndarray](), list[np.ndarray]()
    for plane, cut in zip(planes, cuts, strict=True):
        edges = trace(plane, *surface, shape.size, cut["name"])
        new, faces, blade = section(plane, points, edges, _within(cut), f"cut {cut['name']!r}")
        points = np.concatenate([points, new])
        sections.append(faces)
        blades.append(faces[blade])
    # Every triangle bounds the body on its side of each plane; a triangle of a section bounds it on both sides of its
    # plane.
    walls, sides = [triangles], [np.stack([_side(plane, points, triangles, shape.size) for plane in planes], axis=1)]
    for k, faces in enumerate(sections):
        side = np.stack([_side(plane, points, faces, shape.size) for plane in planes], axis=1)
        for sign, caps in ((-1, faces), (1, faces[:, ::-1])):
            walls.append(caps)
            sides.append(np.where(np.arange(len(planes)) == k, sign, side))
    every, side, cells = np.concatenate(walls), np.concatenate(sides), np.empty((0, 4), np.int64)
    for signs in product((-1, 1), repeat=len(planes)):
        here = every[(side == signs).all(axis=1)]
        for piece in _pieces(here, len(points)) if len(here) else []:
            near = [k for k, faces in enumerate(sections) if np.isin(faces, piece).all(axis=1).any()]
            name = f"cut {' or '.join(repr(cuts[k]['name']) for k in near)}"
            share = signed_volume(points, piece) / signed_volume(*surface)
            if not share > LEAST_PIECE:
                raise StudyError(
                    f"{shape.name}: {name} leaves a piece of {100 * share:.2g} % of the volume; move the plane"
                )
            used, local = np.unique(piece, return_inverse=True)
            try:
                filled, inside = fill_surface(points[used], local.reshape(-1, 3))
            except StudyError as error:
                faces = np.concatenate([sections[k] for k in near])
                raise StudyError(f"{shape.name}: {name} {why_not_filled(points, faces, error)}") from error
            if len(inside) < FEWEST_CELLS:
                raise StudyError(f"{shape.name}: {name} leaves a piece of {len(inside)} tetrahedra; use more nodes")
            number = np.concatenate([used, len(points) + np.arange(len(filled) - len(used))])
            points = np.concatenate([points, filled[len(used) :]])
            cells = np.concatenate([cells, number[inside]])
    return points, cells, blades


def cut_wall(
    shape: Shape, points: np.ndarray, triangles: np.ndarray, tetrahedra: np.ndarray, cut: dict[str, Any]
) -> tuple[np.ndarray, np.ndarray]:
    """Cuts a layered wall: its points (n (layers + 1), 3) [m], in the order of mesh/wall_layers.py, with those below
    the trace moved into the plane, and the faces (f, 3) of the blade.

    The faces are sides of prisms, anticlockwise seen from in front of the plane. triangles (t, 3): of the outer
    surface. Raises StudyError if the move flattens an element.
    """
    plane, within = plane_of(cut), _within(cut)
    count = int(triangles.max()) + 1
    edges = trace(plane, points[:count], triangles, shape.size, cut["name"])
    over, points, rings = np.unique(edges), points.copy(), len(points) // count
    groups = [(over, (plane.level,))]
    if within is not None:
        ends = np.abs(within.level(points[over])) <= 10 * ON_CURVE * shape.size
        groups = [(over[~ends], (plane.level,)), (over[ends], (plane.level, within.level))]
        edges = edges[within.level(points[edges].mean(axis=1)) < 0]
    for ring in range(1, rings):
        depth = (shape.wall or 0.0) * (1.0 if ring == 1 else (ring - 1) / (rings - 1))
        for columns, levels in groups:
            nodes = ring * count + columns
            points[nodes] = project(at_depth(shape, depth), points[nodes], levels)
    worst = float(tetrahedron_radius_ratio(points, tetrahedra).min())
    if worst < MIN_WALL_RATIO or (tetrahedron_volumes(points, tetrahedra) <= 0).any():
        raise StudyError(
            f"{shape.name}: cut {cut['name']!r} meets the wall so slanting that it flattens an element (radius ratio "
            f"{worst:.2g} under {MIN_WALL_RATIO:g}); turn the plane, or use more nodes"
        )
    faces = tetrahedron_facets(tetrahedra)
    columns = np.sort(faces % count, axis=1)
    keys = columns[:, 0] * count + columns[:, 2]
    blade = ((columns[:, 1] == columns[:, 0]) | (columns[:, 1] == columns[:, 2])) & (columns[:, 0] < columns[:, 2])
    blade &= np.isin(keys, edges.min(axis=1) * count + edges.max(axis=1))
    # Both elements at a face contain it; that of the element behind the plane is anticlockwise seen from in front.
    blade &= triangle_normals(points, faces) @ np.asarray(plane.normal, float) > 0
    return points, faces[blade]


def why_not_filled(points: np.ndarray, faces: np.ndarray, error: StudyError) -> str:
    """Why a side of a cut could not be filled: too sharp an angle in its `faces` (f, 3), else the `error`."""
    a, b, c = points[faces].transpose(1, 0, 2)
    sides = np.stack([b - a, c - b, a - c])
    sides /= np.linalg.norm(sides, axis=2)[:, :, None]
    angles = np.degrees(np.arccos(np.clip(-np.einsum("kfi,kfi->kf", sides, np.roll(sides, 1, axis=0)), -1.0, 1.0)))
    if angles.min() < SHARP:
        return (
            f"has its front so near to the surface that an angle of {angles.min():.2g} degrees is left between them; "
            "move it, or use more nodes"
        )
    return f"leaves a piece that cannot be filled: {error}"


def _pieces(triangles: np.ndarray, count: int) -> list[np.ndarray]:
    pairs = np.concatenate([triangles[:, [0, 1]], triangles[:, [1, 2]]])
    label = connected(pairs, count)[triangles[:, 0]]
    return [triangles[label == k] for k in np.unique(label)]


def section(
    plane: HalfSpace, points: np.ndarray, edges: np.ndarray, within: Region | None, name: str
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Meshes the section of a plane, whose trace is `edges` (e, 2): new points (n, 3) [m] in the plane, triangles (t,
    3) of all points, old ones first, anticlockwise seen from in front, and which of them belong to the blade (t,).

    Raises StudyError for a section or blade without faces, and for a front or disc that does not fit.
    """
    if not len(edges):
        raise StudyError(f"{name}: no edge of the surface lies in its plane, so small is what it cuts; use more nodes")
    normal = np.asarray(plane.normal, float) / np.linalg.norm(plane.normal)
    one = np.cross(normal, np.eye(3)[np.abs(normal).argmin()])
    axes = np.stack([one / np.linalg.norm(one), np.cross(normal, one / np.linalg.norm(one))])
    step = float(np.linalg.norm(points[edges[:, 0]] - points[edges[:, 1]], axis=1).mean())
    nodes = np.unique(edges)
    outlines, tiny = [np.searchsorted(nodes, loop) for loop in loops(edges)], 10 * ON_CURVE * float(np.ptp(points))
    if within is None:
        front, chain = np.empty((0, 3)), np.empty(0, np.int64)
    elif isinstance(within, BallRegion):
        front = _rim(plane, within, normal, axes, step)
        chain = len(nodes) + np.arange(len(front) + 1) % len(front)
        if (within.level(points[nodes]) <= tiny).any():
            raise StudyError(f"{name}: its disc reaches the surface; give a smaller one, or a half space")
    else:
        ends = np.flatnonzero(np.abs(within.level(points[nodes])) <= tiny)
        if len(ends) != 2:
            raise StudyError(f"{name}: its front meets the trace {len(ends)} times and not twice; move it")
        start, end = points[nodes[ends]]
        count = max(2, round(float(np.linalg.norm(end - start)) / step))
        share = np.arange(1, count)[:, None] / count
        front = (1 - share) * start + share * end
        chain = np.concatenate([ends[:1], len(nodes) + np.arange(len(front)), ends[1:]])
    given = np.concatenate([points[nodes], front])
    flat, triangles = meshed((given - plane.point) @ axes.T, outlines, chain)
    new = np.asarray(plane.point) + flat[len(given) :] @ axes
    number = np.concatenate([nodes, len(points) + np.arange(len(flat) - len(nodes))])
    centre = np.concatenate([given, new])[triangles].mean(axis=1)
    blade = np.ones(len(triangles), bool) if within is None else within.level(centre) < 0
    if not blade.any():
        raise StudyError(f"{name}: its blade holds no face; use more nodes or a larger one")
    return np.concatenate([front, new]), number[triangles], blade


def loops(edges: np.ndarray) -> list[np.ndarray]:
    """The closed loops of edges (e, 2), as the nodes of each in order; every node must have two edges."""
    neighbours: dict[int, list[int]] = {}
    for a, b in edges.tolist():
        neighbours.setdefault(a, []).append(b)
        neighbours.setdefault(b, []).append(a)
    rings, left = [], sorted(neighbours)
    while left:
        loop = [left[0], neighbours[left[0]][0]]
        while loop[-1] != loop[0]:
            one, other = neighbours[loop[-1]]
            loop.append(other if one == loop[-2] else one)
        rings.append(np.array(loop[:-1]))
        left = [node for node in left if node not in loop]
    return rings


def _rim(plane: HalfSpace, within: BallRegion, normal: np.ndarray, axes: np.ndarray, step: float) -> np.ndarray:
    """Points (f, 3) [m], about `step` [m] apart, on the circle in which a ball meets the plane."""
    away = float(plane.level(np.array([within.center]))[0])
    radius = np.sqrt(within.radius**2 - away**2)
    count = max(ROUND, round(2 * np.pi * radius / step))
    turn = 2 * np.pi * np.arange(count)[:, None] / count
    return np.asarray(within.center) - away * normal + radius * (np.cos(turn) * axes[0] + np.sin(turn) * axes[1])


def meshed(flat: np.ndarray, outlines: list[np.ndarray], chain: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Meshes a plane region: points (m, 2), the given `flat` first, and triangles (t, 3), anticlockwise. outlines:
    loops of point numbers that bound the region; chain (c,): point numbers whose connections become edges, from outline
    to outline, or a ring whose first point is also its last."""
    size, add = float(np.ptp(flat)), gmsh.model.geo
    closed = len(chain) > 0 and chain[0] == chain[-1]
    with fresh_model(Mesh_Algorithm=6):
        # Unit size inside gmsh: its tolerances are absolute.
        for k, (x, y) in enumerate(flat / size):
            add.addPoint(x, y, 0.0, tag=k + 1)
        front = [add.addLine(int(a) + 1, int(b) + 1) for a, b in pairwise(chain)]
        faces = [add.addPlaneSurface([add.addCurveLoop(front)])] if closed else []
        for loop in outlines:
            ends = [int(np.flatnonzero(loop == end)[0]) for end in chain[[0, -1]] if end in loop] if len(chain) else []
            loop = np.roll(loop, -ends[0]) if ends else loop
            lines = [add.addLine(int(a) + 1, int(b) + 1) for a, b in zip(loop, np.roll(loop, -1), strict=True)]
            if ends:
                half = (ends[1] - ends[0]) % len(loop)
                back = [-line for line in front[::-1]]
                rings = [[*lines[:half], *back], [*front, *lines[half:]]]
                faces += [add.addPlaneSurface([add.addCurveLoop(ring)]) for ring in rings]
            else:
                inner = [add.addCurveLoop([-line for line in front[::-1]])] if closed else []
                faces.append(add.addPlaneSurface([add.addCurveLoop(lines), *inner]))
        add.synchronize()
        for _, line in gmsh.model.getEntities(1):
            gmsh.model.mesh.setTransfiniteCurve(line, 2)
        gmsh.model.mesh.generate(2)
        tags, coordinates, _ = gmsh.model.mesh.getNodes()
        corners = [gmsh.model.mesh.getElementsByType(TRIANGLE, face)[1] for face in faces]
    order = np.argsort(tags)
    x = size * np.asarray(coordinates).reshape(-1, 3)[order, :2]
    triangles = np.searchsorted(tags[order], np.concatenate(corners)).reshape(-1, 3).astype(np.int64)
    x[: len(flat)] = flat
    a, b, c = x[triangles].transpose(1, 0, 2)
    turned = (b - a)[:, 0] * (c - a)[:, 1] - (b - a)[:, 1] * (c - a)[:, 0] < 0
    triangles[turned] = triangles[turned][:, ::-1]
    return x, triangles
