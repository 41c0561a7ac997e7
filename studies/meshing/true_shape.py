"""Second-order meshes of a scene's organ whose sides follow its true shape."""

from dataclasses import replace

import numpy as np
from skfem import MeshTet2

from reference_fem import Evaluator, nodes
from reference_fem.elements.shapes import edge_index
from studies.base.lookup import lookup
from studies.geometry import CurvedMesh, true_shape_of
from studies.geometry.mesh.organ_mesh import unique_edges
from studies.geometry.mesh.quality import PAIRS
from studies.geometry.organs import SHAPES
from studies.geometry.shape.levelset import Shape, at_depth, project
from studies.meshing.held_mesh import HeldMesh, rim_sides
from studies.scene.cut import Cut
from studies.scene.organ_file import remeshed, scanned
from studies.scene.scene import Held, Organ


def true_shape(organ: Organ) -> Shape | None:
    """The organ as a level function, the same for all its meshes; None for a mesh file that is used unchanged. Raises
    StudyError for an unknown organ, or a file that cannot be read."""
    if organ.shape != "file":
        return lookup(organ.shape, SHAPES, "organ")(**organ.parameters)
    if not remeshed(organ):
        return None
    source, how = scanned(organ, organ.shape)
    return true_shape_of(source, **how)


def on_true_shape(
    smooth: CurvedMesh, body: HeldMesh, shape: Shape, helds: tuple[Held, ...], cuts: tuple[Cut, ...] = ()
) -> MeshTet2:
    """The mesh with the nodes of its boundary on the true surfaces, those of outlines and of the traces of cuts on the
    true ones: a body held over a polygon has a first-order error of the force. smooth: `studies.geometry.curved` of the
    same cells."""
    mesh = MeshTet2.from_mesh(body.mesh)
    points = nodes(mesh).copy()
    points[mesh.nvertices + edge_index(mesh, smooth.cells[:, np.array(PAIRS)].reshape(-1, 2))] = smooth.points[
        smooth.cells[:, 4:].ravel()
    ]
    for held, facets in zip(helds, body.facets(mesh)[: len(helds)], strict=True):
        rim = np.unique(rim_sides(facets))
        points[rim] = project(shape, points[rim], (held.region.level,))
    points = in_cut_planes(points, body, shape, cuts)
    return replace(mesh, doflocs=np.ascontiguousarray(points.T))


def in_cut_planes(points: np.ndarray, body: HeldMesh, shape: Shape, cuts: tuple[Cut, ...]) -> np.ndarray:
    """P2 nodes at `points` (n, 3) [m] with those of the faces of each cut in its plane, those of its traces also on the
    true surface: sides that only follow the surface, or are bent by smoothing, would leave the plane."""
    if not cuts:
        return points
    mesh, points = MeshTet2.from_mesh(body.mesh), points.copy()
    lumen = body.facets(mesh)[-1][:, :3]
    for cut, faces in zip(cuts, body.faces_of_cuts, strict=True):
        _, rim = body.rim(faces)
        inner = np.isin(rim, lumen).all(axis=1)
        flat, outside, inside = (
            np.concatenate([np.unique(vertices), mesh.nvertices + edge_index(mesh, ends)])
            for vertices, ends in ((faces, unique_edges(faces)), (rim[~inner],) * 2, (rim[inner],) * 2)
        )
        points[flat] -= np.outer(cut.plane.level(points[flat]), cut.unit_normal)
        for trace, surface in ((outside, shape), (inside, at_depth(shape, shape.wall or 0.0))):
            points[trace] = project(surface, points[trace], (cut.plane.level,))
    return points


def as_curved(body: HeldMesh, coarse: HeldMesh, curved_coarse: MeshTet2) -> MeshTet2:
    """The finer mesh with sides as curved as those of the coarse one on the true shape: the quadratic map of a coarse
    element takes its parts with it, so parts of any size remain positive; moving each vertex by itself would fold small
    elements next to large ones."""
    if body is coarse:
        return curved_coarse
    plain, finer = MeshTet2.from_mesh(coarse.mesh), MeshTet2.from_mesh(body.mesh)
    move = Evaluator(plain).displacement(nodes(curved_coarse) - nodes(plain), nodes(finer))
    return replace(finer, doflocs=np.ascontiguousarray((nodes(finer) + move).T))
