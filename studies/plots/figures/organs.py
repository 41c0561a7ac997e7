"""The organs: smooth, with their meshes, and cut open, with coloured attachments, sizes and volumes."""

from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.colors import to_rgb
from matplotlib.figure import Figure
from matplotlib.patches import Patch

from studies.base.counting import heading, readable
from studies.geometry import OrganMesh
from studies.geometry.organs import make_shape
from studies.geometry.shape.levelset import Shape
from studies.geometry.shape.regions import region_from_dict
from studies.geometry.surface.first_surface import first_surface
from studies.plots.style.cut import cut_face, cut_surface
from studies.plots.style.page import blank, finish, page, panels
from studies.plots.style.render import Camera, draw_faces, draw_surface, frame, scale_bar, smooth_normals, uniform
from studies.plots.style.style import BLUE, GREEN, NORMAL, ORANGE, PURPLE, SKY, save, styled

TITLE = "Organs"
FRONT = Camera(azimuth=-72.0, elevation=14.0)
BEHIND = Camera(azimuth=108.0, elevation=-10.0)
OTHER_SIDES = {
    "stomach": ("from the right and behind", Camera(azimuth=150.0, elevation=20.0)),
    "kidney": ("from the spine", Camera(azimuth=-155.0, elevation=-8.0)),
    "spleen": ("from the stomach", Camera(azimuth=-140.0, elevation=-14.0)),
    "bladder": ("from the right", Camera(azimuth=176.0, elevation=8.0)),
}
"""Views of the meshes, which show what the front hides: hila, grooves, bare areas; from behind for other organs."""
FIRST_SIDES = {"spleen": Camera(azimuth=-12.0, elevation=22.0)}
"""Views of the smooth pictures; from the front for other organs. The spleen shows its side towards the ribs and its
notched border."""
TISSUE, CUT = "#D9B3A6", "#B5655A"
PATCH_COLOURS = (BLUE, ORANGE, GREEN, PURPLE, SKY)
WIDTH, HEIGHT = 3.1, 8.6
"""Width and height of a column [inch]."""
ROUND = (0.001, 0.002, 0.005, 0.01, 0.02, 0.05, 0.1, 0.2, 0.5, 1.0)
"""Lengths of a scale bar [m]."""
FINE = 90
"""Cells of the smooth picture along the diagonal of the box of the organ."""
DPI = 110


@styled
def figure(meshes: Mapping[str, OrganMesh]) -> Figure:
    """One column per organ of SHAPES: smooth, with its mesh from another side, and cut open; each at its own scale.

    meshes: name -> filled mesh.
    """
    if not meshes:
        return blank(TITLE, "no organ given")
    sheet = page(WIDTH * len(meshes), HEIGHT)
    axes = panels(sheet, 3, len(meshes))
    names = dict.fromkeys(patch for mesh in meshes.values() for patch in mesh.patches)
    colours = {patch: PATCH_COLOURS[k % len(PATCH_COLOURS)] for k, patch in enumerate(names)}
    for column, (name, mesh) in zip(axes.T, meshes.items(), strict=True):
        side, camera = OTHER_SIDES.get(name, ("from behind", BEHIND))
        shape = make_shape(mesh.recipe["organ"], mesh.recipe["parameters"])
        draw_smooth(column[0], shape, mesh, colours)
        draw_mesh(column[1], mesh, colours, camera)
        draw_cut(column[2], mesh)
        for panel, title in zip(column, (heading(name), side, "cut open"), strict=True):
            panel.set_title(title, size=NORMAL + 1.5 * (panel is column[0]))
        _describe(column[2], mesh, shape)
    handles = [Patch(color=colour, label=f"attached: {readable(patch)}") for patch, colour in colours.items()]
    handles.append(Patch(color=CUT, label="cut face"))
    return finish(sheet, TITLE, handles, columns=6)


def draw_smooth(axes: Axes, shape: Shape, mesh: OrganMesh, colours: Mapping[str, str]) -> None:
    camera = FIRST_SIDES.get(mesh.name, FRONT)
    points, triangles = first_surface(replace(shape, cell=shape.size / FINE))
    own = uniform(TISSUE, len(triangles))
    middle = points[triangles].mean(axis=1)
    for patch, data in mesh.recipe["regions"].items():
        own[region_from_dict(data).level(middle) <= 0] = to_rgb(colours.get(patch, TISSUE))
    draw_surface(axes, points, triangles, own, camera, edges=0.0)
    window(axes, points, camera)


def draw_mesh(axes: Axes, mesh: OrganMesh, colours: Mapping[str, str], camera: Camera) -> None:
    triangles = mesh.outer_triangles
    own = uniform(TISSUE, len(triangles))
    for patch in mesh.patches:
        held = np.zeros(len(mesh.points), bool)
        held[mesh.patches[patch]] = True
        own[held[triangles].all(axis=1)] = to_rgb(colours[patch])
    draw_surface(axes, mesh.points, triangles, own, camera, edges=0.5)
    window(axes, mesh.points, camera)


def draw_cut(axes: Axes, mesh: OrganMesh) -> None:
    """Draws the part of the filled mesh behind its middle: tetrahedra on the cut face, and the lumen behind it."""
    normal = np.array([0.0, -1.0, 0.0])
    height = float((mesh.points @ normal).mean())
    corners, source = cut_surface(mesh.points, mesh.triangles, normal, height)
    light = smooth_normals(mesh.points, mesh.triangles)[source]
    draw_faces(axes, corners, light, uniform(TISSUE, len(corners)), FRONT, edges=0.4)
    face = cut_face(mesh.points, mesh.tetrahedra, normal, height)
    # The cut face is in front of everything, so it is drawn last, with all corners anticlockwise seen from the eye.
    turned = np.cross(face[:, 2] - face[:, 0], face[:, 3] - face[:, 1]) @ normal < 0
    face[turned] = face[turned][:, ::-1]
    draw_faces(axes, face, np.tile(normal, (len(face), 1)), uniform(CUT, len(face)), FRONT, edges=0.4)
    window(axes, mesh.points, FRONT)


def window(axes: Axes, points: np.ndarray, camera: Camera) -> None:
    """Sets the window around all points (n, 3) [m], with a scale bar at the bottom."""
    seen = camera.see(points)[:, :2]
    low, high = seen.min(axis=0), seen.max(axis=0)
    margin = 0.05 * (high - low).max()
    frame(axes, low - (margin, 3.2 * margin), high + margin)
    length = max((bar for bar in ROUND if bar <= 0.3 * (high - low).max()), default=ROUND[0])
    scale_bar(axes, low[0], low[1] - margin, length, f"{1e3 * length:g} mm", size=NORMAL)


def _describe(axes: Axes, mesh: OrganMesh, shape: Shape) -> None:
    inside = f"{1e6 * (mesh.lumen_volume if mesh.hollow else mesh.volume):,.0f} mL"
    words = [f"wall {1e3 * (shape.wall or 0.0):g} mm, content {inside}" if mesh.hollow else inside]
    if shape.literature is not None:
        words.append(f"literature {shape.literature.volume_ml:,.0f} mL")
    words += [f"{mesh.outer_count:,} nodes, {len(mesh.outer_triangles):,} triangles"]
    words += [f"{len(mesh.tetrahedra):,} tetrahedra"]
    place = {"transform": axes.transAxes, "ha": "center", "va": "top"}
    axes.text(0.5, -0.02, "\n".join(words), size=NORMAL, linespacing=1.35, **place)


def draw_organs(meshes: Mapping[str, OrganMesh], path: Path) -> None:
    """Writes the picture as PNG. Raises StudyError if it cannot be written."""
    save(figure(meshes), path, DPI)
