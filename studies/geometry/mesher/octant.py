"""One eighth of a ball, fine at the contact: three planes of symmetry make the rest unnecessary."""

from typing import Any

import gmsh
import numpy as np

from studies.geometry.mesh.organ_mesh import surface_first, tetrahedron_volumes
from studies.geometry.mesher.gmsh_calls import TETRAHEDRON, fresh_model, read_elements


def build_octant(recipe: dict[str, Any], arrays: dict[str, np.ndarray]) -> dict[str, np.ndarray]:
    """Octant x, y, z >= 0 of the ball of `radius` [m]: the arrays of jobs.PARTS.

    The element size grows from `h_pole` [m] at (0, 0, radius) to `h` [m] at a distance of one radius. Nodes of the
    planes of symmetry have exactly coordinate 0, and nodes of the sphere the distance `radius` up to rounding.
    """
    radius, h, h_pole = recipe["radius"], recipe["h"], recipe["h_pole"]
    with fresh_model(Mesh_Algorithm3D=1, Mesh_Optimize=1, Mesh_OptimizeNetgen=1, Mesh_MeshSizeExtendFromBoundary=0):
        # Unit radius inside gmsh: its geometric tolerances are absolute.
        gmsh.model.occ.addSphere(0, 0, 0, 1.0, angle1=0, angle2=np.pi / 2, angle3=np.pi / 2)
        gmsh.model.occ.synchronize()
        size = f"{h_pole / radius!r} + {(h - h_pole) / radius!r} * Min(1, Sqrt(x*x + y*y + (z - 1)*(z - 1)))"
        field = gmsh.model.mesh.field.add("MathEval")
        gmsh.model.mesh.field.setString(field, "F", size)
        gmsh.model.mesh.field.setAsBackgroundMesh(field)
        gmsh.model.mesh.generate(3)
        _, points, tetrahedra = read_elements(TETRAHEDRON)
    points[np.abs(points) < 1e-9] = 0.0
    distance = np.linalg.norm(points, axis=1)
    on_sphere = np.abs(distance - 1.0) < 1e-9
    points[on_sphere] /= distance[on_sphere][:, None]
    inverted = tetrahedron_volumes(points, tetrahedra) < 0
    tetrahedra[inverted] = tetrahedra[inverted][:, [0, 2, 1, 3]]
    points, triangles, tetrahedra, count = surface_first(radius * points, tetrahedra)
    cells = {"triangles": triangles, "tetrahedra": tetrahedra}
    return {"points": points, **cells, "surface_count": np.array(count), "outer_count": np.array(count)}
