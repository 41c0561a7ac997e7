"""The camera, the lamp, what hides what; styles, labels and organs."""

import matplotlib
import numpy as np
import pytest
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.collections import PolyCollection
from matplotlib.figure import Figure
from matplotlib.patches import Patch

from massspring import METHODS
from studies.plots import volume_history
from studies.plots.style.page import finish, page, spread_out
from studies.plots.style.render import LIGHT, Camera, draw_surface, shade, uniform, vertex_normals
from studies.plots.style.style import BLUE, STATUS_LOOKS, VERMILLION, method_colour, styled
from studies.store.record import Status
from tests.studies.plots.made_up import POINTS, RADIUS, TRIANGLES, run

FRONT = Camera(azimuth=-90.0, elevation=0.0)


def test_camera_is_a_rotation_that_looks_along_y():
    turned = Camera(33.0, 21.0).frame
    assert turned @ turned.T == pytest.approx(np.eye(3), abs=1e-12)
    assert np.linalg.det(turned) == pytest.approx(1.0)
    assert FRONT.see(np.array([1.0, 2.0, 3.0])) == pytest.approx([1.0, 3.0, -2.0])


def test_normals_of_an_octahedron_point_outward():
    normals = vertex_normals(POINTS, TRIANGLES)
    assert normals[:6] == pytest.approx(POINTS[:6] / RADIUS)
    assert normals[6] == pytest.approx(0.0)  # the node inside is on no triangle


def test_towards_the_lamp_is_brighter_and_hue_stays():
    towards = LIGHT / np.linalg.norm(LIGHT)
    bright, side, dark = shade(np.stack([towards, [0.0, 0.0, 1.0], -towards]), uniform("#404040", 3))[:, 0]
    assert bright > side > dark > 0


def drawn(points, triangles, camera=FRONT):
    axes = Figure().subplots()
    draw_surface(axes, points, triangles, uniform("#808080", len(triangles)), camera)
    (collection,) = axes.collections
    assert isinstance(collection, PolyCollection)
    return [path.vertices[:3] for path in collection.get_paths()]


def test_triangles_that_look_away_are_left_out():
    assert len(drawn(POINTS, TRIANGLES)) == 4
    assert len(drawn(POINTS, TRIANGLES[:, ::-1])) == 4
    front = [set(map(tuple, np.round(corners, 9))) for corners in drawn(POINTS, TRIANGLES)]
    assert all((0.0, 0.0) in corners for corners in front)  # node 3 at y = -r is the nearest one


def test_far_triangles_come_first():
    near, far = np.array([[0, -1, 0], [1, -1, 0], [0, -1, 1.0]]), np.array([[0, 5, 0], [2, 5, 0], [0, 5, 2.0]])
    sizes = [np.ptp(c[:, 0]) for c in drawn(np.vstack([near, far]), np.array([[0, 1, 2], [3, 4, 5]]))]
    assert sizes == [2.0, 1.0]


def test_labels_keep_their_order_and_their_distance():
    placed = spread_out(np.array([0.5, 0.1, 0.5, 0.52, 0.9]), 0.1)
    assert np.diff(np.sort(placed)).min() >= 0.1 - 1e-12
    assert placed[[1, 4]] == pytest.approx([0.1, 0.9])  # nothing near: not moved
    assert placed[[0, 2, 3]].mean() == pytest.approx(np.mean([0.5, 0.5, 0.52]))
    assert list(np.argsort(placed)) == [1, 0, 2, 3, 4]
    assert len(spread_out(np.array([]), 0.1)) == 0
    crowded = spread_out(np.array([0.9, 0.95, 1.0, 0.2]), 0.1, 1.0)
    assert crowded == pytest.approx([0.8, 0.9, 1.0, 0.2])


@styled
@pytest.mark.parametrize("letters", [5, 60])
def test_a_legend_stays_on_the_page_and_over_its_notes(letters):
    figure = page(8.0, 3.0)
    figure.subplots()
    finish(figure, "Title", [Patch(label="w" * letters) for _ in range(7)], ["n" * 400], columns=4)
    FigureCanvasAgg(figure).draw()
    box, note = figure.legends[0].get_window_extent(), figure.texts[-1].get_window_extent()
    assert box.x0 >= 0 and box.x1 <= figure.bbox.width and note.y0 >= 0 and note.y1 <= box.y0


def test_every_method_and_every_status_has_a_look_of_its_own():
    assert len({method_colour(method.name) for method in METHODS}) == len(METHODS) and set(STATUS_LOOKS) == set(Status)
    colours, markers = ({look[k] for look in STATUS_LOOKS.values()} for k in (0, 1))
    assert len({*colours, BLUE, VERMILLION}) == len(Status) + 2 and len(markers) == len(Status)


def test_the_users_own_settings_change_nothing(tmp_path):
    volume_history.draw([run()], tmp_path / "a.png")
    with matplotlib.rc_context({"font.size": 30, "axes.facecolor": "red", "savefig.dpi": 20, "lines.marker": "x"}):
        volume_history.draw([run()], tmp_path / "b.png")
    assert (tmp_path / "a.png").read_bytes() == (tmp_path / "b.png").read_bytes()
