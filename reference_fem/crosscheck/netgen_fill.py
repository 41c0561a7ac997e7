"""Netgen's own tetrahedra inside a closed surface."""

import numpy as np

from reference_fem.crosscheck.ngsolve_code import load


def netgen_fill(points: np.ndarray, triangles: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Points (n, 3) [m], those given first, and tetrahedra (k, 4) of positive volume inside the triangles (t, 3),
    outward. Raises SolveError where the extra is missing."""
    netgen = load("netgen.meshing")
    net = netgen.Mesh(dim=3)
    net.AddPoints(np.ascontiguousarray(points))
    face = net.Add(netgen.FaceDescriptor(surfnr=1, domin=1, domout=0, bc=1))
    net.AddElements(dim=2, index=face, data=np.ascontiguousarray(triangles, dtype=np.int32), base=0)
    net.GenerateVolumeMesh()
    found = np.array([point.p for point in net.Points()])
    cells = np.array([[vertex.nr - 1 for vertex in cell.vertices] for cell in net.Elements3D()])
    return found, cells[:, [0, 2, 1, 3]]
