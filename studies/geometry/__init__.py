"""Meshes of organs: gmsh and meshio live here only. Lengths in metres, surface nodes numbered first."""

from studies.geometry.api.organs import attach, ball, ball_octant, curved, fill, liver, organ, organ_family
from studies.geometry.api.scans import scan
from studies.geometry.files.reading import read_mesh
from studies.geometry.mesh.checks import check_surface, check_tetrahedra
from studies.geometry.mesh.organ_mesh import OrganMesh
from studies.geometry.mesh.second_order import CurvedMesh
from studies.geometry.organs import SHAPES
from studies.geometry.organs.ball import project_ball
from studies.geometry.organs.bladder import BLADDER_REGIONS
from studies.geometry.organs.kidney import KIDNEY_REGIONS
from studies.geometry.organs.liver import (
    LIVER_PRESS_DIRECTION,
    LIVER_PROBE_NORMAL,
    LIVER_PROBE_POINT,
    LIVER_REGIONS,
    project_liver,
)
from studies.geometry.organs.spleen import SPLEEN_REGIONS
from studies.geometry.organs.stomach import STOMACH_REGIONS
from studies.geometry.organs.variation import vary
from studies.geometry.shape.regions import BallRegion, EllipsoidRegion, HalfSpace, Region

__all__ = [
    "BLADDER_REGIONS",
    "KIDNEY_REGIONS",
    "LIVER_PRESS_DIRECTION",
    "LIVER_PROBE_NORMAL",
    "LIVER_PROBE_POINT",
    "LIVER_REGIONS",
    "SHAPES",
    "SPLEEN_REGIONS",
    "STOMACH_REGIONS",
    "BallRegion",
    "CurvedMesh",
    "EllipsoidRegion",
    "HalfSpace",
    "OrganMesh",
    "Region",
    "attach",
    "ball",
    "ball_octant",
    "check_surface",
    "check_tetrahedra",
    "curved",
    "fill",
    "liver",
    "organ",
    "organ_family",
    "project_ball",
    "project_liver",
    "read_mesh",
    "scan",
    "vary",
]
