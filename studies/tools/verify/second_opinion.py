"""The oracles that another code answers, where the extra `crosscheck` is installed; none elsewhere."""

import numpy as np
from skfem import MeshTet

from reference_fem import Problem, crosscheck
from reference_fem.oracles import Oracle
from studies.geometry import LIVER_PROBE_NORMAL, LIVER_PROBE_POINT, organ

NODES = 300
"""Surface nodes of the liver: about 7,400 unknowns."""
REACH = 0.03
"""Radius of the gripped patch about the probe point [m]."""
PULL = 0.02
"""Displacement of the patch, outward [m]."""


def second_opinions() -> tuple[Oracle, ...]:
    """Ball with clamped caps, thick sphere and liver, solved by NGSolve too; empty without it."""
    return crosscheck.opinions(pulled_liver) if crosscheck.available() else ()


def pulled_liver() -> Problem:
    """The liver on its bare area, a patch of its surface pulled outward."""
    mesh = organ("liver", NODES)
    outside = mesh.points[: mesh.surface_count]
    grip = np.flatnonzero(np.linalg.norm(outside - np.asarray(LIVER_PROBE_POINT), axis=1) < REACH)
    attached = np.unique(np.concatenate(list(mesh.patches.values())))
    solid = MeshTet(np.ascontiguousarray(mesh.points.T), np.ascontiguousarray(mesh.tetrahedra.T))
    return crosscheck.pulled_organ(solid, attached, grip, PULL * np.asarray(LIVER_PROBE_NORMAL))
