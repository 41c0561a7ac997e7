"""Moves a HeldMesh onto the true shape of its organ, as linear or quadratic tetrahedra."""

import warnings
from dataclasses import replace

import numpy as np
from skfem import MeshTet2

from reference_fem import facet_nodes, nodes
from reference_fem.elements.shapes import edge_index
from studies.base.errors import StudyError
from studies.geometry import CurvedMesh, OrganMesh, curved
from studies.geometry.mesh.organ_mesh import tetrahedron_volumes, turn_inverted
from studies.geometry.mesh.quality import PAIRS, tetrahedron_radius_ratio
from studies.geometry.shape.levelset import Shape, at_depth, project
from studies.meshing.bounds import SHAPE
from studies.meshing.held_mesh import HeldMesh, rim_sides
from studies.meshing.quadratic_mesh import TURNED, QuadraticMesh, uprightness
from studies.meshing.retreat import Measure, retreat
from studies.meshing.true_shape import as_curved, in_cut_planes, on_true_shape, true_shape
from studies.scene.scene import Scene

OFF = 0.01 * SHAPE
"""Distance of a node from its target, over the size of the body, beyond which there is a warning."""


def linear_mesh(scene: Scene, organ_mesh: OrganMesh, coarse: HeldMesh, fine: HeldMesh) -> OrganMesh:
    """The finer mesh with its vertices on the true shape, those of rims on the true outline; that of a file is not
    changed, whose flat sides already enclose the volume of the file's surface. Raises StudyError."""
    cells, shape = upright_cells(fine)[:, :4], None if scene.organ.shape == "file" else true_shape(scene.organ)
    points = nodes(fine.mesh)[: fine.mesh.nvertices]
    if shape is not None and fine is not coarse:
        aim = aimed(scene, fine, shape, laid_out(scene, organ_mesh, coarse, fine, shape))[: len(points)]
        points = moved_vertices(points, aim, cells, organ_mesh.name)
        tell(organ_mesh.name, points, aim)
    order, new, outer_count, surface_count = boundary_first(fine, cells)
    *held, outer, lumen = (facets[:, :3] for facets in all_facets(fine))
    return replace(
        organ_mesh,
        points=np.ascontiguousarray(points[order]),
        triangles=new[np.concatenate([outer, lumen])],
        tetrahedra=new[cells],
        surface_count=surface_count,
        outer_count=outer_count,
        patches=named_patches(scene, organ_mesh.name, held, new),
        cuts=named_cuts(scene, fine, new),
    )


def quadratic_mesh(
    scene: Scene, organ_mesh: OrganMesh, coarse: HeldMesh, fine: HeldMesh, share: float
) -> QuadraticMesh:
    """The finer mesh with mid-side nodes, curved if the true shape is known, else with a warning; those of sides that
    start at an outline are placed at `share` of the side from it. Raises StudyError."""
    cells, points, shape = upright_cells(fine), nodes(fine.mesh), true_shape(scene.organ)
    if shape is None:
        warnings.warn(
            f"{organ_mesh.name}: its true shape is not known, so the sides of its quadratic elements stay straight",
            stacklevel=2,
        )
    else:
        points = curved_points(scene, organ_mesh, coarse, fine, shape)
    if share != 0.5:
        points = drawn_points(points, fine, share, organ_mesh.name)
    order, new, outer_count, surface_count = boundary_first(fine, cells)
    *held, outer, lumen = all_facets(fine)
    return QuadraticMesh(
        name=organ_mesh.name,
        points=np.ascontiguousarray(points[order]),
        cells=new[cells],
        facets=new[np.concatenate([outer, lumen])],
        lumen=new[lumen][:, TURNED],
        surface_count=surface_count,
        outer_count=outer_count,
        patches=named_patches(scene, organ_mesh.name, held, new),
        recipe=organ_mesh.recipe,
        cuts=named_cuts(scene, fine, new),
    )


def curved_points(scene: Scene, organ_mesh: OrganMesh, coarse: HeldMesh, fine: HeldMesh, shape: Shape) -> np.ndarray:
    """Nodes of the finer second-order mesh [m], (n, 3), with boundary nodes on the true shape as far as no element
    folds, else with a warning. Raises StudyError."""
    points = laid_out(scene, organ_mesh, coarse, fine, shape)
    aim = aimed(scene, fine, shape, points)
    if fine is not coarse:
        cells = upright_cells(fine)
        measure = upright_against(nodes(fine.mesh), cells)
        if not measure(points, cells, np.arange(len(cells))).min() > 0.0:
            points = less_bent(points, fine, organ_mesh.name)
        points = moved(points, aim, cells, measure, organ_mesh.name)
    tell(organ_mesh.name, points, aim)
    return points


def drawn_points(points: np.ndarray, body: HeldMesh, share: float, name: str) -> np.ndarray:
    """Nodes at `points` (n, 3) [m], with mid-side nodes of sides that start at an outline shifted towards `share` of
    it, as far as no element folds."""
    held, mesh = all_facets(body)[:-2], MeshTet2.from_mesh(body.mesh)
    outlines = np.concatenate([*(rim_sides(facets)[:, :2].ravel() for facets in held), body.front])
    cells = upright_cells(body)
    measure = upright_against(nodes(body.mesh), cells)
    return moved(points, drawn_middles(points, mesh, outlines, share), cells, measure, name)


def less_bent(points: np.ndarray, body: HeldMesh, name: str) -> np.ndarray:
    """Nodes [m], (n, 3), with sides curved towards `points` (n, 3) as far as the flat parts of each element remain
    positive; those of a fully curved element may not be. Raises StudyError."""
    cells, count = upright_cells(body), body.mesh.nvertices
    vertices = moved_vertices(nodes(body.mesh)[:count], points[:count], cells[:, :4], name)
    plain = with_middles(vertices, body)
    # A side keeps its curve if its ends do not reach their targets.
    bent = points + plain - with_middles(points[:count], body)
    return moved(plain, bent, cells, upright_against(plain, cells), name)


def with_middles(vertices: np.ndarray, body: HeldMesh) -> np.ndarray:
    """The vertices (v, 3) and the midpoints of the edges, in the order of `reference_fem.nodes`."""
    return np.concatenate([vertices, vertices[body.mesh.edges].mean(axis=0)])


def moved_vertices(safe: np.ndarray, target: np.ndarray, cells: np.ndarray, name: str) -> np.ndarray:
    """Vertices moved from `safe` towards `target` (v, 3) [m] as far as no tetrahedron (k, 4) becomes much flatter.
    Raises StudyError."""
    before = tetrahedron_radius_ratio(safe, cells)
    return moved(safe, target, cells, lambda x, some, which: tetrahedron_radius_ratio(x, some) / before[which], name)


def laid_out(scene: Scene, organ_mesh: OrganMesh, coarse: HeldMesh, fine: HeldMesh, shape: Shape) -> np.ndarray:
    """Nodes of the finer mesh [m], (n, 3), as curved as the coarse one, whose sides follow the true shape as far as
    none of its elements folds. Raises StudyError."""
    plain = MeshTet2.from_mesh(coarse.mesh)
    bent = on_true_shape(curved(organ_mesh, may_fold=True, shape=shape), coarse, shape, scene.held, scene.cuts)
    cells, straight = upright_cells(coarse), nodes(plain)
    points = moved(straight, nodes(bent), cells, upright_against(straight, cells), organ_mesh.name)
    return nodes(as_curved(fine, coarse, replace(plain, doflocs=np.ascontiguousarray(points.T))))


def upright_against(points: np.ndarray, cells: np.ndarray) -> Measure:
    """A measure of `uprightness` for elements (k, 10), relative to the straight ones at `points` (n, 3) [m]."""
    volume = tetrahedron_volumes(points, cells[:, :4])
    return lambda x, some, which: uprightness(x, some, volume[which])


def moved(safe: np.ndarray, target: np.ndarray, cells: np.ndarray, measure: Measure, name: str) -> np.ndarray:
    """Points (n, 3) [m] moved from `safe` towards `target` as far as the elements allow (retreat.py). Raises
    StudyError."""
    share = retreat(safe, target, cells, measure, name)[:, None]
    # Exact for nodes that reach their target: safe + (target - safe) would be rounded.
    return np.where(share == 1.0, target, safe + share * (target - safe))


def tell(name: str, points: np.ndarray, aim: np.ndarray) -> None:
    """Warns of nodes off the true shape: `points` (n, 3) have their targets at `aim` [m]."""
    off = np.linalg.norm(aim - points, axis=1)
    far = off > OFF * float(np.ptp(points, axis=0).max())
    if far.any():
        warnings.warn(
            f"{name}: {int(far.sum())} of {len(points)} nodes stay up to {1e3 * off.max():.2g} mm off the true shape, "
            "or elements would fold; use more nodes",
            stacklevel=2,
        )


def aimed(scene: Scene, fine: HeldMesh, shape: Shape, points: np.ndarray) -> np.ndarray:
    """Target positions of the nodes at `points` (n, 3) [m]: boundary nodes on the true surface, those of rims and of
    the trace of a cut on the true outline; others do not move."""
    *held, outer, lumen = all_facets(fine)
    points = points.copy()
    for facets, surface in ((outer, shape), (lumen, at_depth(shape, shape.wall or 0.0))):
        chosen = np.unique(facets)
        points[chosen] = project(surface, points[chosen])
    for region, facets in zip((h.region for h in scene.held), held, strict=True):
        rim = np.unique(rim_sides(facets))
        points[rim] = project(shape, points[rim], (region.level,))
    return in_cut_planes(points, fine, shape, scene.cuts)


def all_facets(body: HeldMesh) -> list[np.ndarray]:
    """Six-node facets (f, 6) of each held region, then of the outer surface, then of the lumen."""
    mesh = MeshTet2.from_mesh(body.mesh)
    table, (*held, lumen) = facet_nodes(mesh), body.facets(mesh)
    return [*held, table[~np.isin(table[:, :3], lumen).all(axis=1)], lumen]


def boundary_first(body: HeldMesh, cells: np.ndarray) -> tuple[np.ndarray, np.ndarray, int, int]:
    """The nodes of `cells` in the order of a body: outer surface, lumen, inside; the new number of each old node; how
    many are on the outer surface, and how many on the boundary."""
    used = np.unique(cells)
    outer, lumen = (np.intersect1d(facets, used) for facets in all_facets(body)[-2:])
    boundary = np.concatenate([outer, lumen])
    order = np.concatenate([boundary, np.setdiff1d(used, boundary)])
    new = np.full(int(order.max()) + 1, -1, np.int64)
    new[order] = np.arange(len(order))
    return order, new, len(outer), len(boundary)


def named_patches(scene: Scene, name: str, held: list[np.ndarray], new: np.ndarray) -> dict[str, np.ndarray]:
    """Nodes of the facets of each held region, by new numbers. Raises StudyError for a region without facets."""
    patches = {}
    for region, facets in zip(scene.held, held, strict=True):
        if not len(facets):
            raise StudyError(f"{name}: region {region.name!r} holds no facet; enlarge it, or use more nodes")
        patches[region.name] = np.unique(new[facets])
    return patches


def named_cuts(scene: Scene, body: HeldMesh, new: np.ndarray) -> dict[str, np.ndarray]:
    return {cut.name: new[faces] for cut, faces in zip(scene.cuts, body.faces_of_cuts, strict=True)}


def upright_cells(body: HeldMesh) -> np.ndarray:
    """Elements (k, 10) of positive volume in VTK's order; numbers as `reference_fem.nodes` has them."""
    mesh = body.mesh
    corners = turn_inverted(mesh.p.T, mesh.t.T.astype(np.int64))
    middles = edge_index(mesh, corners[:, np.array(PAIRS)].reshape(-1, 2)).reshape(-1, 6)
    return np.concatenate([corners, mesh.nvertices + middles], axis=1)


def drawn_middles(points: np.ndarray, mesh: MeshTet2, outlines: np.ndarray, share: float) -> np.ndarray:
    """Nodes at `points` (n, 3) [m] of a second-order mesh, with the middles of sides that have one end on `outlines`,
    vertices (v,), at `share` of the side from that end: near it displacement varies as √r. Sides keep their curves.

    A share of ¼ would represent √r exactly (Barsoum, Int. J. Numer. Methods Eng. 10, 1976; for tetrahedra Nejati,
    Paluszny and Zimmerman, Eng. Fract. Mech. 144, 2015), but it folds elements with curved sides.
    """
    on = np.zeros(mesh.nvertices, dtype=bool)
    on[outlines] = True
    ends = np.asarray(mesh.edges).T
    ends = np.where(on[ends[:, :1]], ends, ends[:, ::-1])
    leaving = on[ends].sum(axis=1) == 1
    near, far = points[ends].transpose(1, 0, 2)
    middle = (1 - share) * (1 - 2 * share) * near + share * (2 * share - 1) * far
    moved = middle + 4 * share * (1 - share) * points[mesh.nvertices :]
    middles = np.where(leaving[:, None], moved, points[mesh.nvertices :])
    return np.vstack([points[: mesh.nvertices], middles])


def curved_mesh(mesh: OrganMesh, shape: Shape | None = None) -> CurvedMesh:
    """`studies.geometry.curved`, but where an element would fold, its sides are curved less, and a warning states the
    deviation. shape: the true shape of a scan, which its recipe does not contain. Raises StudyError as `curved`."""
    target = curved(mesh, may_fold=True, shape=shape)
    if target.smallest_jacobian > 0.0:
        return target
    straight = target.points.copy()
    straight[target.cells[:, 4:]] = mesh.points[mesh.tetrahedra[:, np.array(PAIRS)]].mean(axis=2)
    points = moved(straight, target.points, target.cells, upright_against(straight, target.cells), mesh.name)
    off = np.linalg.norm(points - target.points, axis=1)
    boundary = np.isin(np.arange(len(points)), boundary_facets(mesh, target.cells))
    held = boundary & (off > 0.0)
    if held.any():
        warnings.warn(
            f"{mesh.name}: {int(held.sum())} of {int(boundary.sum())} boundary nodes stay up to "
            f"{1e3 * off[held].max():.2g} mm off the true shape, or elements would fold; use more nodes",
            stacklevel=2,
        )
    return replace(target, points=points)


def boundary_facets(mesh: OrganMesh, cells: np.ndarray) -> np.ndarray:
    """The boundary of the quadratic elements `cells` (k, 10) of a mesh, (t, 6): corners, then the nodes between first
    and second, second and third, third and first."""
    count = len(mesh.points)
    sides = np.sort(cells[:, np.array(PAIRS)].reshape(-1, 2), axis=1) @ [count, 1]
    keys, first = np.unique(sides, return_index=True)
    middles = cells[:, 4:].ravel()[first]
    pairs = [np.sort(mesh.triangles[:, pair], axis=1) @ [count, 1] for pair in ([0, 1], [1, 2], [2, 0])]
    return np.column_stack([mesh.triangles, *(middles[np.searchsorted(keys, pair)] for pair in pairs)])
