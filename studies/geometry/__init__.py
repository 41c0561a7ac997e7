"""Meshes of organs: gmsh and meshio live here only. Lengths in metres, surface nodes numbered first."""

from typing import TYPE_CHECKING

from studies.base.face import lazy

if TYPE_CHECKING:
    from studies.geometry.api.organs import attach, ball, ball_octant, curved, fill, liver, organ, organ_family
    from studies.geometry.api.scans import painted, scan, true_shape_of
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
    from studies.geometry.shape.regions import BallRegion, EllipsoidRegion, HalfSpace, PaintedRegion, Region

_FACE = {
    "BLADDER_REGIONS": "studies.geometry.organs.bladder",
    "KIDNEY_REGIONS": "studies.geometry.organs.kidney",
    "LIVER_PRESS_DIRECTION": "studies.geometry.organs.liver",
    "LIVER_PROBE_NORMAL": "studies.geometry.organs.liver",
    "LIVER_PROBE_POINT": "studies.geometry.organs.liver",
    "LIVER_REGIONS": "studies.geometry.organs.liver",
    "SHAPES": "studies.geometry.organs",
    "SPLEEN_REGIONS": "studies.geometry.organs.spleen",
    "STOMACH_REGIONS": "studies.geometry.organs.stomach",
    "BallRegion": "studies.geometry.shape.regions",
    "CurvedMesh": "studies.geometry.mesh.second_order",
    "EllipsoidRegion": "studies.geometry.shape.regions",
    "HalfSpace": "studies.geometry.shape.regions",
    "OrganMesh": "studies.geometry.mesh.organ_mesh",
    "PaintedRegion": "studies.geometry.shape.regions",
    "Region": "studies.geometry.shape.regions",
    "attach": "studies.geometry.api.organs",
    "ball": "studies.geometry.api.organs",
    "ball_octant": "studies.geometry.api.organs",
    "check_surface": "studies.geometry.mesh.checks",
    "check_tetrahedra": "studies.geometry.mesh.checks",
    "curved": "studies.geometry.api.organs",
    "fill": "studies.geometry.api.organs",
    "liver": "studies.geometry.api.organs",
    "organ": "studies.geometry.api.organs",
    "organ_family": "studies.geometry.api.organs",
    "painted": "studies.geometry.api.scans",
    "project_ball": "studies.geometry.organs.ball",
    "project_liver": "studies.geometry.organs.liver",
    "read_mesh": "studies.geometry.files.reading",
    "scan": "studies.geometry.api.scans",
    "true_shape_of": "studies.geometry.api.scans",
    "vary": "studies.geometry.organs.variation",
}
"""Where each name lives; its module is loaded when the name is asked for."""

if not TYPE_CHECKING:
    __all__ = list(_FACE)
    __getattr__, __dir__ = lazy(__name__, _FACE)
