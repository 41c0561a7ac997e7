"""Second-order meshes of a scene's organ whose sides follow its true shape."""

from dataclasses import replace

import numpy as np
from skfem import MeshTet2

from reference_fem import Evaluator, nodes
from reference_fem.elements.shapes import edge_index
from studies.base.lookup import lookup
from studies.geometry import CurvedMesh, true_shape_of
from studies.geometry.mesh.jacobian import PAIRS
from studies.geometry.organs import SHAPES
from studies.geometry.shape.levelset import Shape, project
from studies.meshing.held_mesh import HeldMesh, rim_sides
from studies.scene.organ_file import remeshed, scanned
from studies.scene.scene import Held, Organ


def true_shape(organ: Organ) -> Shape | None:
    """The organ as a level function, the same for all its meshes; None for a mesh file that comes as it is.

    Raises StudyError for an organ that there is not, or a file that cannot be read.
    """
    if organ.shape != "file":
        return lookup(organ.shape, SHAPES, "organ")(**organ.parameters)
    if not remeshed(organ):
        return None
    source, how = scanned(organ, organ.shape)
    return true_shape_of(source, **how)


def on_true_shape(smooth: CurvedMesh, body: HeldMesh, shape: Shape, helds: tuple[Held, ...]) -> MeshTet2:
    """The mesh with the nodes of its boundary on the true surfaces, those of outlines on the true outlines.

    smooth: `studies.geometry.curved` of the same vertices and tetrahedra.
    A polygon instead would hold the body h²/8r too little or too much, of first order in the force.
    """
    mesh = MeshTet2.from_mesh(body.mesh)
    points = nodes(mesh).copy()
    points[mesh.nvertices + edge_index(mesh, smooth.cells[:, np.array(PAIRS)].reshape(-1, 2))] = smooth.points[
        smooth.cells[:, 4:].ravel()
    ]
    for held, facets in zip(helds, body.facets(mesh)[: len(helds)], strict=True):
        rim = np.unique(rim_sides(facets))
        points[rim] = project(shape, points[rim], (held.region.level,))
    return replace(mesh, doflocs=np.ascontiguousarray(points.T))


def as_curved(body: HeldMesh, coarse: HeldMesh, curved_coarse: MeshTet2) -> MeshTet2:
    """The finer mesh with sides as curved as those of the coarse one that lie on the true shape.

    The quadratic map of a coarse element takes its parts with it exactly, so they stay upright however small they are;
    moving each new vertex onto the surface by itself folds small elements beside large ones.
    """
    if body is coarse:
        return curved_coarse
    plain, finer = MeshTet2.from_mesh(coarse.mesh), MeshTet2.from_mesh(body.mesh)
    move = Evaluator(plain).displacement(nodes(curved_coarse) - nodes(plain), nodes(finer))
    return replace(finer, doflocs=np.ascontiguousarray((nodes(finer) + move).T))
