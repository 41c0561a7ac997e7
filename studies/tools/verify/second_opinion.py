"""The oracles that another code answers, where the extra `crosscheck` is installed; none elsewhere."""

import numpy as np

from reference_fem import Problem, crosscheck
from reference_fem.oracles import Oracle
from studies.geometry import LIVER_PROBE_NORMAL, LIVER_PROBE_POINT, OrganMesh, organ
from studies.meshing.held_mesh import straight
from studies.meshing.opened_mesh import opened_mesh
from studies.meshing.scene_mesh import mesh_for
from studies.scene.library import BALL_INCISED

NODES = 300
"""Surface nodes of the liver: about 7,400 unknowns."""
REACH = 0.03
"""Radius of the gripped patch about the probe point [m]."""
PULL = 0.02
"""Displacement of the patch, outward [m]."""
CUT_NODES = 80
"""Surface nodes of the ball that is cut: about 2,800 unknowns."""


def second_opinions() -> tuple[Oracle, ...]:
    """Ball with clamped caps, thick sphere, liver and a ball that is cut, solved by NGSolve too; empty without it."""
    return crosscheck.opinions(pulled_liver, incised_ball) if crosscheck.available() else ()


def pulled_liver() -> Problem:
    """The liver on its bare area, a patch of its surface pulled outward."""
    mesh = organ("liver", NODES)
    outside = mesh.points[: mesh.surface_count]
    grip = np.flatnonzero(np.linalg.norm(outside - np.asarray(LIVER_PROBE_POINT), axis=1) < REACH)
    attached = np.unique(np.concatenate(list(mesh.patches.values())))
    return crosscheck.pulled_organ(straight(mesh), attached, grip, PULL * np.asarray(LIVER_PROBE_NORMAL))


def incised_ball() -> Problem:
    """ball_incised at its end, on a coarse mesh that is cut from the start."""
    bottom, top = BALL_INCISED.held
    mesh = opened_mesh(mesh_for(BALL_INCISED, CUT_NODES, even=True)).mesh
    assert isinstance(mesh, OrganMesh)  # its sides are straight
    pull = top.path(BALL_INCISED.checkpoints[-1])
    return crosscheck.pulled_organ(straight(mesh), mesh.patches[bottom.name], mesh.patches[top.name], pull)
